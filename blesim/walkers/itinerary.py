"""What a walker has been told to do: where to go, how fast, where to stand, where to press."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from blesim.errors import UsageError
from blesim.venue.graph import AisleGraph, GraphPosition, read_only
from blesim.venue.venue import Venue

# What is slower or longer than these is a slip of the pen, and may not fit the clock.
_SLOWEST_M_S = 1e-3
_SLOWEST_RAD_S = 1e-3
_LONGEST_S = 1e7
_FASTEST_M_S = 10.0
_QUICKEST_M_S2 = 20.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Stop:
    """A place of the route, and how long to stand there. [s]."""

    place: GraphPosition
    pause_s: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.pause_s <= _LONGEST_S:
            raise UsageError(
                f"pause_s {self.pause_s}: a pause must be from 0 to {_LONGEST_S:.0f} s"
            )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WayPoints:
    """Places that a tester can tell by sight.

    Attributes
    ----------
    xy_m : ndarray of float64, (n, 2)
        On the graph. [m]
    level : ndarray of int16, (n,)
    """

    xy_m: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))
    level: NDArray[np.int16] = field(default_factory=lambda: np.empty(0, np.int16))

    def __post_init__(self) -> None:
        if self.xy_m.shape != (len(self.level), 2):
            raise UsageError(f"way points: {self.xy_m.shape} positions, {len(self.level)} levels")
        read_only(self.xy_m)
        read_only(self.level)

    def __len__(self) -> int:
        """How many."""
        return len(self.level)


@dataclass(frozen=True, slots=True, kw_only=True)
class Itinerary:
    """A scripted walk at a steady pace.

    Attributes
    ----------
    walker : str
        Who walks; names the walker's random numbers.
    stops : tuple of Stop
        Two or more, in order; the shortest way is taken between them.
    start_s : float
        When the walk begins, on the clock of the simulation. [s]
    speed_m_s : float
        Pace. [m/s]
    turn_rate_rad_s : float
        How fast the walker turns on the spot where the way bends. [rad/s]
    acceleration_m_s2 : float or None
        How fast the walker gets to the pace and stops again; at once where not given. [m/s2]
    way_points : WayPoints
        Where the tester presses in passing.
    """

    walker: str
    stops: tuple[Stop, ...]
    start_s: float = 0.0
    speed_m_s: float = 1.0
    turn_rate_rad_s: float = np.pi
    acceleration_m_s2: float | None = None
    way_points: WayPoints = field(default_factory=WayPoints)

    def __post_init__(self) -> None:
        if len(self.stops) < 2:
            raise UsageError(f"walker '{self.walker}': a route needs at least two stops")
        if not 0.0 <= self.start_s <= _LONGEST_S:
            raise UsageError(f"walker '{self.walker}': start_s must be from 0 to {_LONGEST_S:.0f}")
        if not _SLOWEST_M_S <= self.speed_m_s <= _FASTEST_M_S:
            raise UsageError(f"walker '{self.walker}': speed_m_s must be from 0.001 to 10")
        if not self.turn_rate_rad_s >= _SLOWEST_RAD_S:
            raise UsageError(f"walker '{self.walker}': turn_rate_rad_s must be 0.001 or more")
        if (
            self.acceleration_m_s2 is not None
            and not 0.0 < self.acceleration_m_s2 <= _QUICKEST_M_S2
        ):
            raise UsageError(f"walker '{self.walker}': acceleration_m_s2 must be above 0, up to 20")


def way_points(venue: Venue, stops: Sequence[Stop] = ()) -> WayPoints:
    """Ends of product sections, junctions, and the stops that are given, each once."""
    ends = [(s.level, *end) for s in venue.sections for end in (s.start_m, s.end_m)]
    if venue.graph is not None:
        branches = venue.graph.branches_of_node
        ends += [(n.level, n.x_m, n.y_m) for n in venue.graph.nodes if len(branches[n.id]) > 1]
        ends += [_at(stop.place, venue.graph) for stop in stops]
    rows = np.array(ends, dtype=np.float64).reshape(-1, 3)
    rows = np.unique(np.round(rows, 6), axis=0)
    return WayPoints(xy_m=rows[:, 1:].copy(), level=rows[:, 0].astype(np.int16))


def _at(place: GraphPosition, graph: AisleGraph) -> tuple[int, float, float]:
    x_m, y_m = graph.xy_m(place.edge, place.offset_m)
    return int(graph.level[place.edge]), float(x_m), float(y_m)
