"""The door of a store that holds so many people and no more."""

import simpy
from simpy.resources.resource import Release, Request


class Door(simpy.Resource):
    """Places in the store, given out in order of arrival.

    `simpy.Resource` looks through everybody inside for the one who leaves, which takes most of a
    day with many thousands inside; this one knows where each stands in its list.
    """

    def __init__(self, env: simpy.Environment, capacity: int) -> None:
        super().__init__(env, capacity)
        self._row: dict[Request, int] = {}

    def _do_put(self, event: Request) -> None:
        super()._do_put(event)
        if event.triggered:
            self._row[event] = len(self.users) - 1

    def _do_get(self, event: Release) -> None:
        row = self._row.pop(event.request, None)
        if row is not None:
            last = self.users.pop()
            if last is not event.request:
                self.users[row] = last
                self._row[last] = row
        event.succeed()
