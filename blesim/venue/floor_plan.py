"""The floor plan: bounds of each level, obstacles with a material, where people can walk."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from blesim.errors import VenueError
from blesim.settings import LEVEL_RANGE
from blesim.venue.materials import MATERIALS, Material

FLOOR_TO_CEILING_M = float("inf")


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """A shelf, wall or pillar: its outline, what it is made of and how high it stands.

    Attributes
    ----------
    id : str
        Name on the map.
    outline : shapely.Polygon
        In local metres. [m]
    material : str
        A name of `MATERIALS`.
    level : int
        Level it stands on.
    height_m : float
        Top above the floor; infinite for floor to ceiling. [m]

    Raises
    ------
    VenueError
        If the material is unknown, the outline is not a valid polygon, or the height not positive.
    """

    id: str
    outline: Polygon
    material: str
    level: int = 0
    height_m: float = FLOOR_TO_CEILING_M

    def __post_init__(self) -> None:
        if self.material not in MATERIALS:
            known = ", ".join(sorted(MATERIALS))
            raise VenueError(
                f"obstacle '{self.id}': unknown material '{self.material}'; use one of {known}"
            )
        _refuse_bad_outline(f"obstacle '{self.id}'", self.outline)
        if not self.height_m > 0:
            raise VenueError(f"obstacle '{self.id}': height_m {self.height_m} must be positive")

    @property
    def loss(self) -> Material:
        """What the obstacle costs a radio link."""
        return MATERIALS[self.material]


@dataclass(frozen=True, slots=True, kw_only=True)
class Level:
    """One level of the building: its number and its bounds in local metres.

    Raises
    ------
    VenueError
        If the bounds are not a valid polygon, or the number is out of a recording's range.
    """

    level: int
    bounds: Polygon

    def __post_init__(self) -> None:
        _refuse_bad_outline(f"level {self.level}", self.bounds)
        refuse_bad_level("the floor plan", self.level)


@dataclass(frozen=True, kw_only=True)
class FloorPlan:
    """Everything built: levels and obstacles.

    Attributes
    ----------
    levels : tuple of Level
        At least one, each number once.
    obstacles : tuple of Obstacle
        Each inside the bounds of its level.

    Raises
    ------
    VenueError
        If levels or obstacles repeat, an obstacle stands on no level or out of bounds.
    """

    levels: tuple[Level, ...]
    obstacles: tuple[Obstacle, ...] = field(default=())

    def __post_init__(self) -> None:
        if not self.levels:
            raise VenueError("a floor plan needs at least one level with its bounds")
        refuse_repeated("level", [str(level.level) for level in self.levels])
        refuse_repeated("obstacle", [obstacle.id for obstacle in self.obstacles])
        for obstacle in self.obstacles:
            bounds = self.bounds(obstacle.level, f"obstacle '{obstacle.id}'")
            if not shapely.covers(shapely.buffer(bounds, 1e-6), obstacle.outline):
                raise VenueError(
                    f"obstacle '{obstacle.id}' reaches out of the bounds of level {obstacle.level}"
                )

    def bounds(self, level: int, who: str) -> Polygon:
        """Bounds of a level; `who` asks, and is named in the error if there is no such level."""
        for candidate in self.levels:
            if candidate.level == level:
                return candidate.bounds
        known = ", ".join(str(known.level) for known in self.levels)
        raise VenueError(f"{who} is on level {level}, but the floor plan has only {known}")

    @cached_property
    def walkable(self) -> Mapping[int, BaseGeometry]:
        """Area of each level where a person can stand: its bounds without its obstacles."""
        return {
            level.level: shapely.difference(
                level.bounds, shapely.union_all(self._outlines(level.level))
            )
            for level in self.levels
        }

    def _outlines(self, level: int) -> list[Polygon]:
        return [obstacle.outline for obstacle in self.obstacles if obstacle.level == level]


def refuse_repeated(what: str, ids: Sequence[str]) -> None:
    """Raise `VenueError` if a name stands twice."""
    seen: set[str] = set()
    for name in ids:
        if name in seen:
            raise VenueError(f"{what} '{name}' is there twice; give each its own id")
        seen.add(name)


def refuse_bad_level(who: str, level: int) -> None:
    """Raise `VenueError` if a recording could not hold the number of a level."""
    if not LEVEL_RANGE[0] <= level <= LEVEL_RANGE[1]:
        raise VenueError(f"{who}: level {level} is not within {LEVEL_RANGE[0]} to {LEVEL_RANGE[1]}")


def _refuse_bad_outline(who: str, outline: Polygon) -> None:
    if outline.is_empty or not outline.area > 0:
        raise VenueError(f"{who}: the outline encloses no area")
    if not outline.is_valid:
        raise VenueError(f"{who}: bad outline: {shapely.is_valid_reason(outline)}")
