"""Where particles may stand, level by level."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from blesim.filters.plan_motion import PlanMotion
from blesim.venue.venue import Venue


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Floors:
    """Where particles begin and what stops them, by level.

    Attributes
    ----------
    beacon_level : ndarray of int64, (beacons,)
        Level of each beacon.
    motion : dict of int to PlanMotion
        Enterable area with the map, bounds without.
    walls : bool
        Whether a step may not leave it.
    """

    beacon_level: NDArray[np.int64]
    motion: dict[int, PlanMotion]
    walls: bool

    @classmethod
    def of(cls, venue: Venue, *, use_map: bool) -> "Floors":
        """Floors of a venue."""
        plan = venue.floor_plan
        bounds = {level.level: level.bounds for level in plan.levels}
        areas = plan.walkable if use_map else bounds
        # A level that is all obstacles can be on the map, but nobody is on it.
        motion = {n: PlanMotion.on(area) for n, area in areas.items() if area.area > 0}
        return cls(beacon_level=venue.beacon_level.astype(np.int64), motion=motion, walls=use_map)
