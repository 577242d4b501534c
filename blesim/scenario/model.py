"""What a scenario file may say: the models behind the YAML and behind `blesim schema`."""

from collections.abc import Sized
from dataclasses import dataclass
from typing import Annotated, Literal, TypeVar

import numpy as np
from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema
from pydantic_core.core_schema import no_info_after_validator_function

from blesim.columns import LONGEST_STEP_M
from blesim.radio.beacon_events import BeaconEvent
from blesim.rng import SEED_LIMIT
from blesim.scenario.presets import PhoneProfile, Radio
from blesim.settings import LevelNumber, MapCoordinate, Name, Settings, Text
from blesim.walkers.gait import Gait

# On average: shorter ones would be hundreds of steps a metre.
_SHORTEST_STEP_M = 0.1
SizedT = TypeVar("SizedT", bound=Sized)


@dataclass(frozen=True, slots=True)
class AtLeast:
    """A least number of items, checked once all items are right.

    Pydantic's own ``min_length`` counts only the items without fault, and so reports a second
    fault for every first.
    """

    count: int
    what: str

    def __get_pydantic_core_schema__(
        self, source: type[Sized], handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Check after the items."""
        return no_info_after_validator_function(self._check, handler(source))

    def __get_pydantic_json_schema__(
        self, core_schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """Tell editors the number too."""
        schema = handler(core_schema)
        least = "minProperties" if schema.get("type") == "object" else "minItems"
        return schema | {least: self.count}

    def _check(self, items: SizedT) -> SizedT:
        if len(items) < self.count:
            raise ValueError(f"give at least {self.count} {self.what}")
        return items


class VenueSource(Settings):
    """Where the venue comes from: a map beside the scenario, or a layout that blesim builds.

    Attributes
    ----------
    map : str or None
        GeoJSON file, relative to the scenario.
    layout : str or None
        ``wholesale-section`` or ``wholesale-store``.
    survey_error_m : float
        Spread of the error, east and north each, with which beacon positions were written down;
        estimators get these, the radio the true ones. [m]
    """

    map: Text | None = None
    layout: Literal["wholesale-section", "wholesale-store"] | None = None
    survey_error_m: float = Field(default=0.0, ge=0, le=20)

    @model_validator(mode="after")
    def _one_source(self) -> "VenueSource":
        if (self.map is None) == (self.layout is None):
            raise ValueError("give either 'map' (a GeoJSON file) or 'layout'")
        return self


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
    carrying : str
        How the phone is carried.
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
        ``none``.
    route : tuple of RouteStop
        Stops in order, joined by the shortest way along the aisles.
    """

    name: Name
    phone: Name
    carrying: Literal["hand"] = "hand"
    kind: Literal["walk", "survey"] = "walk"
    split: Text = ""
    start_s: float = Field(default=0.0, ge=0, le=7 * 86400)
    speed_m_s: float = Field(default=1.0, ge=0.05, le=10)
    turn_rate_deg_s: float = Field(default=180.0, ge=1, le=3600)
    gait: Gait = Gait()
    marks: Literal["way-points", "none"] = "way-points"
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


class Record(Settings):
    """What goes into the recording besides the RSSI readings.

    Attributes
    ----------
    steps : bool
        Step events, and the true steps.
    packets : bool
        Fate and components of every packet, as truth.
    """

    steps: bool = True
    packets: bool = False


class Scenario(Settings):
    """Everything a simulation needs but the seed, which may be given here too.

    Attributes
    ----------
    title : str
        What the recording shows.
    license : str
        SPDX identifier of the recording's terms.
    seed : int or None
        Used unless the command line gives another.
    venue : VenueSource
        Where it happens.
    radio : Radio
        How signals travel there.
    beacon_events : tuple of BeaconEvent
        What happens to beacons on the way.
    phones : dict of str to PhoneProfile
        Phone profiles by name.
    record : Record
        What to write.
    walks : tuple of WalkPlan
        Who walks where, with which phone.
    """

    title: Name
    license: Text = "CC0-1.0"
    seed: int | None = Field(default=None, ge=0, lt=SEED_LIMIT)
    venue: VenueSource
    radio: Radio = Radio()
    beacon_events: tuple[BeaconEvent, ...] = ()
    phones: Annotated[dict[Name, PhoneProfile], AtLeast(1, "phone")]
    record: Record = Record()
    walks: Annotated[tuple[WalkPlan, ...], AtLeast(1, "walk")]
