"""What a scenario file may say: the model behind the YAML and behind `blesim schema`."""

from typing import Annotated

from pydantic import ConfigDict, Field, model_validator

from blesim.imu.magnetics import Magnetics
from blesim.radio.beacon_events import BeaconEvent
from blesim.rng import SEED_LIMIT
from blesim.scenario.at_least import AtLeast
from blesim.scenario.presets import PhoneProfile, Radio
from blesim.scenario.recorded import Record, ShopperPhones
from blesim.scenario.shop_day import ShopDay
from blesim.scenario.survey_plan import SurveyPlan
from blesim.scenario.venue_source import VenueSource
from blesim.scenario.walk_plan import WalkPlan
from blesim.settings import Name, Settings, Text

# One of these at least: somebody is to be recorded.
_RECORDED = ("walks", "surveys", "shopper_phones")


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
    magnetics : Magnetics
        The magnetic field in the venue.
    record : Record
        What to write of the walks and surveys.
    walks : tuple of WalkPlan
        Who walks where, with which phone.
    surveys : tuple of SurveyPlan
        Spots at which somebody stands to survey.
    trading_day : ShopDay or None
        Shoppers and staff, who are there at the same time.
    shopper_phones : tuple of ShopperPhones
        Whose phones of theirs are recorded.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "anyOf": [
                {"required": [key], "properties": {key: {"minItems": 1}}} for key in _RECORDED
            ]
        }
    )

    title: Name
    license: Text = "CC0-1.0"
    seed: int | None = Field(default=None, ge=0, lt=SEED_LIMIT)
    venue: VenueSource
    radio: Radio = Radio()
    magnetics: Magnetics = Magnetics()
    beacon_events: tuple[BeaconEvent, ...] = ()
    phones: Annotated[dict[Name, PhoneProfile], AtLeast(1, "phone")]
    record: Record = Record()
    walks: tuple[WalkPlan, ...] = ()
    surveys: tuple[SurveyPlan, ...] = ()
    trading_day: ShopDay | None = None
    shopper_phones: tuple[ShopperPhones, ...] = ()

    @model_validator(mode="after")
    def _somebody_is_recorded(self) -> "Scenario":
        if not any(getattr(self, key) for key in _RECORDED):
            raise ValueError("nobody is recorded; give 'walks', 'surveys' or 'shopper_phones'")
        if self.shopper_phones and self.trading_day is None:
            raise ValueError("shopper_phones: there are no shoppers; give a 'trading_day'")
        return self
