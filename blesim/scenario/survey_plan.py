"""A survey on the spot as a scenario tells it: where to stand, which ways to look, how long."""

from typing import Annotated

from pydantic import Field, model_validator

from blesim.scenario.carried import IN_HAND, Carried
from blesim.settings import LevelNumber, MapCoordinate, Name, Settings, Text


class Spot(Settings):
    """A place to stand. [m]."""

    x_m: MapCoordinate
    y_m: MapCoordinate


class Area(Settings):
    """A rectangle of the map, its sides along the axes. [m]."""

    west_m: MapCoordinate
    south_m: MapCoordinate
    east_m: MapCoordinate
    north_m: MapCoordinate

    @model_validator(mode="after")
    def _has_an_inside(self) -> "Area":
        if not (self.west_m < self.east_m and self.south_m < self.north_m):
            raise ValueError("west_m must be less than east_m, and south_m less than north_m")
        return self

    @property
    def box_m(self) -> tuple[float, float, float, float]:
        """West, south, east and north. [m]."""
        return (self.west_m, self.south_m, self.east_m, self.north_m)


class SurveyPlan(Settings):
    """A survey by somebody who stands at one spot after the other.

    The tester goes straight from spot to spot, around what stands in between, and marks the
    beginning and the end of each stand.

    Attributes
    ----------
    name : str
        Unique among walks and surveys.
    phone : str
        A name of the scenario's phones.
    carrying : str or tuple of CarriedFrom
        How the phone is carried; a list where that changes on the way.
    spots : tuple of Spot
        Where to stand, in this order; or else:
    grid_m : float or None
        Spacing of a grid over everything walkable. [m]
    area : Area or None
        The grid covers this alone, and starts half a spacing off its corner.
    level : int
        Level of the survey.
    directions_deg : tuple of float
        Which ways to look at each spot, from the map's x axis counter-clockwise. [degree]
    stand_s : float
        How long to look each way. [s]
    start_s : float
        When it begins. [s]
    speed_m_s, turn_rate_deg_s : float
        Pace from spot to spot, and how fast the tester turns. [m/s], [degree/s]
    split : str
        Part of a benchmark it belongs to.
    """

    name: Name
    phone: Name
    carrying: Carried = IN_HAND
    spots: tuple[Spot, ...] = ()
    grid_m: float | None = Field(default=None, ge=0.1, le=100)
    area: Area | None = None
    level: LevelNumber = 0
    directions_deg: Annotated[tuple[float, ...], Field(min_length=1, max_length=360)] = (0.0,)
    stand_s: float = Field(default=10.0, gt=0, le=86400)
    start_s: float = Field(default=0.0, ge=0, le=7 * 86400)
    speed_m_s: float = Field(default=1.0, ge=0.05, le=10)
    turn_rate_deg_s: float = Field(default=180.0, ge=1, le=3600)
    split: Text = ""

    @model_validator(mode="after")
    def _either(self) -> "SurveyPlan":
        if bool(self.spots) == (self.grid_m is not None):
            raise ValueError("give either 'spots' or 'grid_m'")
        if self.area is not None and self.grid_m is None:
            raise ValueError("'area' limits a grid; give 'grid_m' too, or leave it out")
        return self
