"""How far from the centre lines of the aisles people may walk, and where the shelves are."""

from dataclasses import dataclass
from typing import Self

import numpy as np
import shapely
from numpy.typing import NDArray

from blesim.errors import VenueError
from blesim.venue.graph import AisleGraph, read_only
from blesim.venue.venue import Venue

BODY_RADIUS_M = 0.25
# Nobody strays further from the centre line, however wide the hall; assumed.
_FURTHEST_ASIDE_M = 2.0
# How far a shelf may stand from the centre line and still be that of the section; assumed.
_REACH_M = 4.0
LEFT, RIGHT, EITHER, NEITHER = range(4)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Clearance:
    """Room beside the centre lines.

    Attributes
    ----------
    edge_m : ndarray of float64, (edges,)
        How far the middle of a body may be from each edge without touching anything. [m]
    node_m : ndarray of float64, (nodes,)
        The same around each node: the least of its edges. [m]
    """

    edge_m: NDArray[np.float64]
    node_m: NDArray[np.float64]

    @classmethod
    def of(cls, venue: Venue) -> Self:
        """Clearance in a venue with an aisle graph."""
        graph = graph_of(venue)
        free = [venue.floor_plan.walkable[int(level)].boundary for level in graph.level]
        lines = shapely.linestrings(graph.node_xy_m[graph.ends])
        beside_m = shapely.distance(lines, np.array(free, dtype=object)) - BODY_RADIUS_M
        # A micrometre keeps the rounding of recorded positions on the right side.
        free_m = np.clip(beside_m - 1e-6, 0.0, _FURTHEST_ASIDE_M)
        edge_m = np.asarray(np.round(free_m, 6), np.float64)
        node_m = np.full(len(graph.nodes), _FURTHEST_ASIDE_M)
        for end in (0, 1):
            np.minimum.at(node_m, graph.ends[:, end], edge_m)
        return cls(edge_m=read_only(edge_m), node_m=read_only(node_m))

    @property
    def width_m(self) -> NDArray[np.float64]:
        """Width that walkers use of each edge's aisle, (edges,). [m]."""
        return 2.0 * (self.edge_m + BODY_RADIUS_M)


def graph_of(venue: Venue) -> AisleGraph:
    """Aisle graph of a venue that must have one.

    Raises
    ------
    VenueError
        If it has none.
    """
    if venue.graph is None:
        raise VenueError(f"venue '{venue.name}' has no aisle graph; walkers need one")
    return venue.graph


def shelf_sides(venue: Venue) -> NDArray[np.int64]:
    """Side of each section on which its shelf stands, seen from its start to its end, (n,).

    `LEFT`, `RIGHT`, `EITHER` or `NEITHER`: a side has a shelf where an obstacle is within reach of
    the section's middle.
    """
    sides = np.full(len(venue.sections), NEITHER)
    trees: dict[int, shapely.STRtree] = {}
    for row, section in enumerate(venue.sections):
        if section.level not in trees:
            here = [o.outline for o in venue.floor_plan.obstacles if o.level == section.level]
            trees[section.level] = shapely.STRtree(here)
        start, end = np.array(section.start_m), np.array(section.end_m)
        along = (end - start) / max(float(np.hypot(*(end - start))), 1e-9)
        middle, left = (start + end) / 2, np.array([-along[1], along[0]])
        rays = shapely.linestrings([[middle, middle + s * _REACH_M * left] for s in (1, -1)])
        left_hit, right_hit = (len(trees[section.level].query(r, "intersects")) > 0 for r in rays)
        if left_hit or right_hit:
            sides[row] = EITHER if left_hit and right_hit else LEFT if left_hit else RIGHT
    return sides
