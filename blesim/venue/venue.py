"""The venue: floor plan, aisle graph, beacons and product sections that fit together."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import Self

import numpy as np
import shapely
from numpy.typing import NDArray

from blesim.errors import VenueError
from blesim.settings import Settings
from blesim.venue.beacons import Beacon
from blesim.venue.floor_plan import FloorPlan, refuse_repeated
from blesim.venue.graph import SAME_PLACE_M, AisleGraph
from blesim.venue.sections import Section

# A beacon is mounted on a shelf face; deeper inside than this it is drawn in the wrong place.
_FACE_TOLERANCE_M = 0.02


class Georeference(Settings):
    """Where the local metres are on Earth: WGS 84 of the origin, azimuth of the map's y axis.

    Attributes
    ----------
    latitude_deg, longitude_deg : float
        Of the local origin. [degree]
    bearing_deg : float
        Azimuth of the map's y axis, clockwise from north. [degree]
    """

    latitude_deg: float
    longitude_deg: float
    bearing_deg: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Venue:
    """A building with its beacons, as built or as somebody surveyed it.

    Attributes
    ----------
    name : str
        What it is called.
    floor_plan : FloorPlan
        Levels and obstacles.
    beacons : tuple of Beacon
        In the order of the recordings.
    graph : AisleGraph or None
        Where people walk, if the venue is laid out in aisles.
    sections : tuple of Section
        Product sections; they need a graph.
    georeference : Georeference or None
        Where it is on Earth, if known.

    Raises
    ------
    VenueError
        If ids repeat, a beacon is out of bounds or inside an obstacle, an aisle runs through an
        obstacle, or a section is not on its aisle.
    """

    name: str
    floor_plan: FloorPlan
    beacons: tuple[Beacon, ...]
    graph: AisleGraph | None = None
    sections: tuple[Section, ...] = field(default=())
    georeference: Georeference | None = None

    def __post_init__(self) -> None:
        refuse_repeated("beacon", [beacon.id for beacon in self.beacons])
        refuse_repeated("section", [section.id for section in self.sections])
        for beacon in self.beacons:
            self._refuse_misplaced(beacon)
        if self.graph is not None:
            _refuse_blocked(self.graph, self.floor_plan)
        for section in self.sections:
            self._refuse_off_aisle(section)

    def _refuse_misplaced(self, beacon: Beacon) -> None:
        who = f"beacon '{beacon.id}'"
        place = f"({beacon.x_m:g}, {beacon.y_m:g})"
        point = shapely.Point(beacon.x_m, beacon.y_m)
        if shapely.distance(self.floor_plan.bounds(beacon.level, who), point) > _FACE_TOLERANCE_M:
            raise VenueError(f"{who} at {place} is out of the bounds of level {beacon.level}")
        for obstacle in self.floor_plan.obstacles:
            if obstacle.level != beacon.level or beacon.z_m > obstacle.height_m:
                continue
            if shapely.contains(shapely.buffer(obstacle.outline, -_FACE_TOLERANCE_M), point):
                raise VenueError(
                    f"{who} at {place} is inside obstacle '{obstacle.id}'; put it on a face"
                )

    def _refuse_off_aisle(self, section: Section) -> None:
        if self.graph is None:
            raise VenueError(f"section '{section.id}' needs an aisle graph to lie on")
        for x_m, y_m in (section.start_m, section.end_m):
            edge, offset_m, distance_m = self.graph.nearest([x_m], [y_m], [section.level])
            places = self.graph.xy_m(edge, offset_m)
            if distance_m[0] > 0.01:
                raise VenueError(
                    f"section '{section.id}': ({x_m:g}, {y_m:g}) is {distance_m[0]:.2f} m off the"
                    f" aisles; the nearest place on them is ({places[0, 0]:g}, {places[0, 1]:g})"
                )

    @cached_property
    def beacon_row(self) -> MappingProxyType[str, int]:
        """Row of each beacon by its id."""
        return MappingProxyType({beacon.id: row for row, beacon in enumerate(self.beacons)})

    @cached_property
    def beacon_xyz_m(self) -> NDArray[np.float64]:
        """Positions of the beacons, (number of beacons, 3). [m]."""
        rows = [(beacon.x_m, beacon.y_m, beacon.z_m) for beacon in self.beacons]
        return np.array(rows, dtype=np.float64).reshape(-1, 3)

    @cached_property
    def beacon_level(self) -> NDArray[np.int16]:
        """Level of each beacon, (number of beacons,)."""
        return np.array([beacon.level for beacon in self.beacons], dtype=np.int16)

    @cached_property
    def beacon_places(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Edge and offset [m] of the place on the graph beside each beacon, two arrays (n,).

        Raises
        ------
        VenueError
            If the venue has no aisle graph.
        """
        if self.graph is None:
            raise VenueError(f"venue '{self.name}' has no aisle graph")
        x_m, y_m, _ = self.beacon_xyz_m.T
        edge, offset_m, _ = self.graph.nearest(x_m, y_m, self.beacon_level)
        return edge, offset_m

    def with_beacons(self, beacons: tuple[Beacon, ...]) -> Self:
        """Return the same building with other beacons."""
        return replace(self, beacons=beacons)


def _refuse_blocked(graph: AisleGraph, floor_plan: FloorPlan) -> None:
    """Raise if an edge leaves the walkable area of its level."""
    for row, edge in enumerate(graph.edges):
        name = f"aisle '{edge.branch}', edge {edge.first} - {edge.second}"
        floor_plan.bounds(int(graph.level[row]), name)
        line = shapely.linestrings(graph.node_xy_m[graph.ends[row]])
        walkable = shapely.buffer(floor_plan.walkable[int(graph.level[row])], SAME_PLACE_M)
        if shapely.covers(walkable, line):
            continue
        for obstacle in floor_plan.obstacles:
            if obstacle.level == graph.level[row] and shapely.crosses(line, obstacle.outline):
                raise VenueError(f"{name} runs through obstacle '{obstacle.id}'")
        raise VenueError(f"{name} leaves the bounds of level {graph.level[row]}")
