"""Where the venue comes from."""

from typing import Literal

from pydantic import Field, model_validator

from blesim.settings import Settings, Text

LayoutName = Literal[
    "wholesale-section",
    "wholesale-store",
    "room-two-pairs",
    "campus-corridor",
    "campus-corridor-15",
    "campus-corridor-10",
    "campus-corridor-keys",
    "office-dense",
    "office-sparse",
    "h-floor",
]


class VenueSource(Settings):
    """Where the venue comes from: a map beside the scenario, or a layout that blesim builds.

    Attributes
    ----------
    map : str or None
        GeoJSON file, relative to the scenario.
    layout : str or None
        A store of `blesim.venue.layouts`, or a site of `blesim.venue.sites`. The corridor comes
        with 20 beacons, 15 or 10, or with 5 at key points.
    survey_error_m : float
        Spread of the error, east and north each, with which beacon positions were written down;
        estimators get these, the radio the true ones. [m]
    """

    map: Text | None = None
    layout: LayoutName | None = None
    survey_error_m: float = Field(default=0.0, ge=0, le=20)

    @model_validator(mode="after")
    def _one_source(self) -> "VenueSource":
        if (self.map is None) == (self.layout is None):
            raise ValueError("give either 'map' (a GeoJSON file) or 'layout'")
        return self
