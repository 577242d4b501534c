"""Tills and who pays there."""

from dataclasses import dataclass, field

import simpy

from blesim.venue.graph import GraphPosition


@dataclass(slots=True, eq=False)
class Till:
    """A till: where it is, its queue, how many mean to pay there, whom it serves."""

    node: str
    place: GraphPosition
    desk: simpy.Resource
    bound: int = 0
    serves: list[str] = field(default_factory=list)


@dataclass(slots=True, eq=False)
class Party:
    """What the members of a group share while they shop: their till, and that one has paid."""

    till: Till | None = None
    paid: simpy.Event | None = None
