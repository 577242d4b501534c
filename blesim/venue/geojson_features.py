"""What each type of feature on a map holds: its geometry, its properties, what it becomes."""

import json
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import shapely
from pydantic import ValidationError

from blesim.errors import VenueError
from blesim.settings import MAP_LIMIT_M, LevelNumber, Name, Settings, Text, shortened
from blesim.venue.beacons import Beacon
from blesim.venue.floor_plan import FLOOR_TO_CEILING_M, Level, Obstacle
from blesim.venue.graph import Edge, Node
from blesim.venue.sections import Section

Json = dict[str, Any]
Part = Level | Obstacle | Node | Edge | Section | Beacon

Positions = list[tuple[float, ...]]


class Feature(Settings):
    """Properties of one feature; ``GEOMETRY`` is the type it needs."""

    GEOMETRY: ClassVar[str]
    feature_type: str

    def part(self, coordinates: Any) -> Part:
        """Part of a venue that the feature describes; `VenueError` if its coordinates are bad."""
        raise NotImplementedError


class LevelFeature(Feature):
    """Bounds of a level."""

    GEOMETRY: ClassVar[str] = "Polygon"
    feature_type: Literal["level"] = "level"
    level: LevelNumber

    def part(self, coordinates: Any) -> Level:
        """Level with its bounds."""
        return Level(level=self.level, bounds=_polygon(coordinates))


class FixtureFeature(Feature):
    """An obstacle; without a height it reaches from floor to ceiling."""

    GEOMETRY: ClassVar[str] = "Polygon"
    feature_type: Literal["fixture"] = "fixture"
    id: Name
    material: Text
    level: LevelNumber = 0
    height_m: float | None = None

    def part(self, coordinates: Any) -> Obstacle:
        """Obstacle with its outline."""
        return Obstacle(
            id=self.id,
            outline=_polygon(coordinates),
            material=self.material,
            level=self.level,
            height_m=FLOOR_TO_CEILING_M if self.height_m is None else self.height_m,
        )


class NodeFeature(Feature):
    """A node of the aisle graph."""

    GEOMETRY: ClassVar[str] = "Point"
    feature_type: Literal["node"] = "node"
    id: Name
    level: LevelNumber = 0

    def part(self, coordinates: Any) -> Node:
        """Node at its position."""
        x_m, y_m = _position(coordinates, 2)
        return Node(id=self.id, x_m=x_m, y_m=y_m, level=self.level)


class EdgeFeature(Feature):
    """An edge of the aisle graph; its line is drawn for the eye, its nodes count."""

    GEOMETRY: ClassVar[str] = "LineString"
    feature_type: Literal["edge"] = "edge"
    first: Name
    second: Name
    branch: Text
    one_way: bool = False

    def part(self, coordinates: Any) -> Edge:
        """Edge between its nodes."""
        _line(coordinates)
        return Edge(first=self.first, second=self.second, branch=self.branch, one_way=self.one_way)


class SectionFeature(Feature):
    """A product section along an aisle."""

    GEOMETRY: ClassVar[str] = "LineString"
    feature_type: Literal["section"] = "section"
    id: Name
    category: Text
    branch: Text
    level: LevelNumber = 0

    def part(self, coordinates: Any) -> Section:
        """Section between its ends."""
        start_m, end_m = _line(coordinates)
        return Section(
            id=self.id,
            category=self.category,
            branch=self.branch,
            start_m=start_m,
            end_m=end_m,
            level=self.level,
        )


class BeaconFeature(Feature):
    """A beacon; its other properties are the fields of `Beacon` and checked there."""

    model_config = Settings.model_config | {"extra": "allow"}

    GEOMETRY: ClassVar[str] = "Point"
    feature_type: Literal["amenity"] = "amenity"
    category: Literal["beacon"] = "beacon"

    def part(self, coordinates: Any) -> Beacon:
        """Beacon at its position."""
        x_m, y_m, z_m = _position(coordinates, 3)
        place = {"x_m": x_m, "y_m": y_m, "z_m": z_m}
        twice = sorted(place.keys() & (self.model_extra or {}).keys())
        if twice:
            raise VenueError(f"property '{twice[0]}' belongs into the coordinates")
        # Through JSON, where a UUID is a text and a tuple a list, however strict the settings.
        return Beacon.model_validate_json(json.dumps({**(self.model_extra or {}), **place}))


FEATURES: Mapping[str, type[Feature]] = {
    "level": LevelFeature,
    "fixture": FixtureFeature,
    "node": NodeFeature,
    "edge": EdgeFeature,
    "section": SectionFeature,
    "amenity": BeaconFeature,
}


def told(value: Any) -> str:
    """A value from a map for a message: as JSON, its beginning where it is long."""
    return shortened(json.dumps(value))


def reasons(fault: ValidationError) -> list[str]:
    """Everything pydantic found wrong, in words, one reason a line."""
    return [_reason(error["loc"], error["type"], error["msg"]) for error in fault.errors()]


def _reason(place: tuple[int | str, ...], kind: str, message: str) -> str:
    name = ".".join(str(part) for part in place)
    if kind == "missing":
        return f"property '{name}' is missing"
    if kind == "extra_forbidden":
        return f"property '{name}' is not known; remove it or mend its spelling"
    words = message.removeprefix("Value error, ")
    return f"property '{name}': {words[0].lower()}{words[1:]}"


def _position(coordinates: Any, count: int) -> tuple[float, ...]:
    if not isinstance(coordinates, list) or len(coordinates) != count:
        raise VenueError(f"a position needs {count} coordinates, not {told(coordinates)}")
    for number in coordinates:
        if isinstance(number, bool) or not isinstance(number, int | float):
            raise VenueError(f"coordinate {told(number)} is not a number")
        if not abs(number) <= MAP_LIMIT_M:
            raise VenueError(f"a coordinate beyond {MAP_LIMIT_M:g} m is not in local metres")
    return tuple(float(number) for number in coordinates)


def _line(coordinates: Any) -> tuple[tuple[float, float], tuple[float, float]]:
    if not isinstance(coordinates, list) or len(coordinates) != 2:
        raise VenueError("a line needs exactly two positions")
    (start_x, start_y), (end_x, end_y) = (_position(end, 2) for end in coordinates)
    return (start_x, start_y), (end_x, end_y)


def _polygon(coordinates: Any) -> shapely.Polygon:
    if not isinstance(coordinates, list) or not coordinates:
        raise VenueError("a polygon needs at least one ring")
    shell, *holes = (_ring(ring) for ring in coordinates)
    return shapely.Polygon(shell, holes)


def _ring(coordinates: Any) -> Positions:
    if not isinstance(coordinates, list) or len(coordinates) < 4:
        raise VenueError("a ring needs at least four positions, the last equal to the first")
    ring = [_position(position, 2) for position in coordinates]
    if ring[0] != ring[-1]:
        raise VenueError("a ring must end where it begins")
    return ring
