"""A scripted walk as a scenario tells it: route, pace, and how the phone is carried."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from blesim.columns import LONGEST_STEP_M
from blesim.scenario.at_least import AtLeast
from blesim.scenario.carried import IN_HAND, Carried
from blesim.settings import LevelNumber, MapCoordinate, Name, Settings, Text
from blesim.walkers.gait import Gait

# On average: shorter ones would be hundreds of steps a metre.
_SHORTEST_STEP_M = 0.1


class RouteStop(Settings):
    """A place of a route: a node of the aisle graph, or a map position on an aisle.

    Attributes
    ----------
    node : str or None
        Id of a node; layouts call the node beside a beacon like the beacon.
    x_m, y_m : float or None
        Position within half a metre of an aisle's centre. [m]
    level : int
        Level of the position.
    pause_s : float
        How long to stand there. [s]
    """

    node: Name | None = None
    x_m: MapCoordinate | None = None
    y_m: MapCoordinate | None = None
    level: LevelNumber = 0
    pause_s: float = Field(default=0.0, ge=0, le=86400)

    @model_validator(mode="before")
    @classmethod
    def _node_alone(cls, value: object) -> object:
        return {"node": value} if isinstance(value, str) else value

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """Schema of a stop: the id of a node, or the mapping."""
        mapping = handler.resolve_ref_schema(handler(core_schema))
        node = {"type": "string", "description": "Id of a node of the aisle graph."}
        return {"anyOf": [node, mapping]}

    @model_validator(mode="after")
    def _one_place(self) -> "RouteStop":
        position = (self.x_m is not None, self.y_m is not None)
        if all(position) == (self.node is not None) or any(position) != all(position):
            raise ValueError("give either 'node' or both 'x_m' and 'y_m'")
        return self


class WalkPlan(Settings):
    """One walk of one phone along a route.

    Attributes
    ----------
    name : str
        Unique in the scenario; names the random numbers of this walk.
    phone : str
        A name of the scenario's phones.
    carrying : str or tuple of CarriedFrom
        How the phone is carried; a list where that changes on the way.
    kind : str
        ``walk`` to be positioned, ``survey`` to learn from.
    split : str
        Part of a benchmark the walk belongs to.
    start_s : float
        When it begins, within the first week: beacons send from time 0 on, and everything before
        the start is drawn as well. [s]
    speed_m_s : float
        Pace; indoors, with a phone in the hand, people walk about 1 m/s. [m/s]
    turn_rate_deg_s : float
        How fast the walker turns on the spot; assumed. [degree/s]
    gait : Gait
        How the walker steps.
    marks : str
        ``way-points``: the tester presses at every end of a product section and every junction;
        ``stops``: at every stop of the route, too; ``none``.
    route : tuple of RouteStop
        Stops in order, joined by the shortest way along the aisles.
    """

    name: Name
    phone: Name
    carrying: Carried = IN_HAND
    kind: Literal["walk", "survey"] = "walk"
    split: Text = ""
    start_s: float = Field(default=0.0, ge=0, le=7 * 86400)
    speed_m_s: float = Field(default=1.0, ge=0.05, le=10)
    turn_rate_deg_s: float = Field(default=180.0, ge=1, le=3600)
    gait: Gait = Gait()
    marks: Literal["way-points", "stops", "none"] = "way-points"
    route: Annotated[tuple[RouteStop, ...], AtLeast(2, "stops")]

    @model_validator(mode="after")
    def _steps_are_possible(self) -> "WalkPlan":
        speed_m_s = np.array(self.speed_m_s)
        mean_m = float(self.gait.step_length_m(speed_m_s))
        longest_m = float(self.gait.longest_step_m(speed_m_s))
        if mean_m < _SHORTEST_STEP_M or longest_m > LONGEST_STEP_M:
            raise ValueError(
                f"at {self.speed_m_s:g} m/s this gait makes steps of {mean_m:.2f} m, up to"
                f" {longest_m:.2f} m; mend 'speed_m_s' or 'gait' for {_SHORTEST_STEP_M:g} to"
                f" {LONGEST_STEP_M:g} m"
            )
        return self
