"""The venue: floor plan, aisle graph, beacons and product sections that fit together."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np
import shapely
from numpy.typing import NDArray
from pydantic import Field

from blesim.errors import VenueError
from blesim.settings import Settings
from blesim.venue.beacons import Beacon
from blesim.venue.floor_plan import FloorPlan, refuse_repeated
from blesim.venue.graph import SAME_PLACE_M, AisleGraph, GraphPosition, read_only
from blesim.venue.sections import Section

# A beacon is mounted on a shelf face; deeper inside than this it is drawn in the wrong place.
_FACE_TOLERANCE_M = 0.02
# A section lies on the centre line of its aisle, up to the rounding of the map.
_CENTRE_TOLERANCE_M = 0.01


class Georeference(Settings):
    """Where the local metres are on Earth: WGS 84 of the origin, azimuth of the map's y axis.

    Attributes
    ----------
    latitude_deg, longitude_deg : float
        Of the local origin. [degree]
    bearing_deg : float
        Azimuth of the map's y axis, clockwise from north. [degree]
    """

    latitude_deg: float = Field(ge=-90, le=90)
    longitude_deg: float = Field(ge=-180, le=180)
    bearing_deg: float = Field(ge=-360, le=360, default=0.0)


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
        if self.sections:
            self._refuse_off_aisle()

    def _refuse_misplaced(self, beacon: Beacon) -> None:
        who = f"beacon '{beacon.id}'"
        place = f"({beacon.x_m:g}, {beacon.y_m:g})"
        point = shapely.Point(beacon.x_m, beacon.y_m)
        if shapely.distance(self.floor_plan.bounds(beacon.level, who), point) > _FACE_TOLERANCE_M:
            raise VenueError(f"{who} at {place} is out of the bounds of level {beacon.level}")
        for obstacle in self.floor_plan.obstacles:
            if obstacle.level != beacon.level or beacon.z_m > obstacle.height_m:
                continue
            # The cheap question first: a buffer for each beacon and obstacle takes its time.
            if not shapely.contains(obstacle.outline, point):
                continue
            if shapely.contains(shapely.buffer(obstacle.outline, -_FACE_TOLERANCE_M), point):
                raise VenueError(
                    f"{who} at {place} is inside obstacle '{obstacle.id}'; put it on a face"
                )

    def _refuse_off_aisle(self) -> None:
        if self.graph is None:
            raise VenueError(f"section '{self.sections[0].id}' needs an aisle graph to lie on")
        ends = [(s, *end) for s in self.sections for end in (s.start_m, s.end_m)]
        sections, x_m, y_m = zip(*ends, strict=True)
        places = self.graph.nearest(x_m, y_m, [section.level for section in sections])
        for section, x, y, edge, offset_m, distance_m in zip(
            sections, x_m, y_m, *places, strict=True
        ):
            place = GraphPosition(int(edge), float(offset_m))
            who = f"section '{section.id}': ({x:g}, {y:g})"
            if not distance_m <= _CENTRE_TOLERANCE_M:
                on_x_m, on_y_m = self.graph.xy_m(place.edge, place.offset_m)
                raise VenueError(
                    f"{who} is {distance_m:.2f} m off the aisles; the nearest place on them is"
                    f" ({on_x_m:g}, {on_y_m:g})"
                )
            here = self.graph.branches_at(place)
            if section.branch not in here:
                names = " and ".join(repr(name) for name in sorted(here))
                raise VenueError(f"{who} is on aisle {names}, not on '{section.branch}'")

    @cached_property
    def beacon_row(self) -> Mapping[str, int]:
        """Row of each beacon by its id."""
        return {beacon.id: row for row, beacon in enumerate(self.beacons)}

    @cached_property
    def beacon_xyz_m(self) -> NDArray[np.float64]:
        """Positions of the beacons, (number of beacons, 3). [m]."""
        rows = [(beacon.x_m, beacon.y_m, beacon.z_m) for beacon in self.beacons]
        return read_only(np.array(rows, dtype=np.float64).reshape(-1, 3))

    @cached_property
    def beacon_level(self) -> NDArray[np.int16]:
        """Level of each beacon, (number of beacons,)."""
        return read_only(np.array([beacon.level for beacon in self.beacons], np.int16))

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
        return read_only(edge), read_only(offset_m)

    def with_beacons(self, beacons: tuple[Beacon, ...]) -> Self:
        """Return the same building with other beacons."""
        return replace(self, beacons=beacons)


def _refuse_blocked(graph: AisleGraph, floor_plan: FloorPlan) -> None:
    """Raise if an edge leaves the walkable area of its level."""
    walkable = {
        level: shapely.buffer(area, SAME_PLACE_M) for level, area in floor_plan.walkable.items()
    }
    for row, edge in enumerate(graph.edges):
        name = f"aisle '{edge.branch}', edge {edge.first} - {edge.second}"
        floor_plan.bounds(int(graph.level[row]), name)
        line = shapely.linestrings(graph.node_xy_m[graph.ends[row]])
        if shapely.covers(walkable[int(graph.level[row])], line):
            continue
        for obstacle in floor_plan.obstacles:
            if obstacle.level == graph.level[row] and _runs_inside(line, obstacle.outline):
                raise VenueError(f"{name} runs through obstacle '{obstacle.id}'")
        raise VenueError(f"{name} leaves the bounds of level {graph.level[row]}")


def _runs_inside(line: shapely.LineString, outline: shapely.Polygon) -> bool:
    """Whether some of a line lies in the interior of an outline, or all of it."""
    return bool(shapely.relate_pattern(line, outline, "T********"))
