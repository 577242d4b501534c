"""Where places are and which way points lie along a leg, worked out once for all walkers."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from blesim.venue.graph import SAME_PLACE_M, AisleGraph, GraphPosition, Leg
from blesim.walkers.itinerary import WayPoints

Passed = list[tuple[NDArray[np.float64], float]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Landmarks:
    """What walkers on one graph ask for again and again."""

    graph: AisleGraph
    _placed: dict[GraphPosition, NDArray[np.float64]] = field(default_factory=dict)
    _passed: dict[tuple[WayPoints, Leg], Passed] = field(default_factory=dict)

    def xy_m(self, place: GraphPosition) -> NDArray[np.float64]:
        """Map position of a place, (2,). [m]."""
        if place not in self._placed:
            self._placed[place] = self.graph.xy_m([place.edge], [place.offset_m])[0]
        return self._placed[place]

    def passed(self, points: WayPoints, leg: Leg) -> Passed:
        """Way points passed on a leg, its start left out, with the share of the leg before them."""
        if (points, leg) not in self._passed:
            self._passed[points, leg] = self._found(points, leg)
        return self._passed[points, leg]

    def _found(self, points: WayPoints, leg: Leg) -> Passed:
        start_m, end_m = self.graph.xy_m([leg.edge, leg.edge], [leg.start_m, leg.end_m])
        along = (end_m - start_m) / leg.length_m
        relative = points.xy_m - start_m
        ahead_m = relative @ along
        aside_m = np.abs(relative @ np.array([-along[1], along[0]]))
        passed = (aside_m <= SAME_PLACE_M) & (ahead_m > SAME_PLACE_M)
        passed &= ahead_m <= leg.length_m + SAME_PLACE_M
        passed &= points.level == self.graph.level[leg.edge]
        found = [
            (points.xy_m[row], min(float(ahead_m[row]) / leg.length_m, 1.0))
            for row in np.flatnonzero(passed)
        ]
        return sorted(found, key=lambda pair: pair[1])
