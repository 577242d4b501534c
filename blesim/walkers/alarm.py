"""The event that a process waits for again and again."""

from typing import Self

import simpy
from simpy.events import NORMAL


class Alarm(simpy.Event):
    """An event that happens a while after each time it is set, for the one process that waits.

    What a visitor waits for most is that time passes. A `simpy.Timeout` is made and thrown away
    every time; this event is put back into the queue.
    """

    def __init__(self, env: simpy.Environment) -> None:
        super().__init__(env)
        self._ok = True
        self._value = None
        self._schedule = env.schedule

    def after(self, delay_us: int) -> Self:
        """The event itself, set to happen so much later; not to be set again before. [us]."""
        self.callbacks = []
        self._schedule(self, NORMAL, delay_us)
        return self
