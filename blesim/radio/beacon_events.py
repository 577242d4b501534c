"""What may happen to a beacon in its life."""

from collections.abc import Iterator, Sequence
from typing import Annotated, Literal

from pydantic import Field

from blesim.settings import MAP_LIMIT_M, LevelNumber, MapCoordinate, Name, Settings
from blesim.venue.beacons import AdvertisingInterval, Beacon, MeasuredPower

_LONGEST_S = 366 * 86400.0


class _Happening(Settings):
    """What all events have in common: when, and to which beacon.

    Attributes
    ----------
    at_s : float
        From the start of the simulation. [s]
    beacon : str
        Its id.
    """

    at_s: float = Field(ge=0, le=_LONGEST_S)
    beacon: Name


class Dies(_Happening):
    """The beacon is silent from now on, unless it is replaced."""

    event: Literal["dies"] = "dies"


class Reboots(_Happening):
    """The beacon is silent for `off_s` [s], then sends again with its clock started anew."""

    event: Literal["reboots"] = "reboots"
    off_s: float = Field(default=1.0, ge=0, le=_LONGEST_S)


class Moves(_Happening):
    """Somebody mounts the beacon elsewhere; what is not given stays as it is.

    Attributes
    ----------
    x_m, y_m : float
        New position on its level. [m]
    z_m : float or None
        New height above the level's floor. [m]
    level : int or None
        New level.
    """

    event: Literal["moves"] = "moves"
    x_m: MapCoordinate
    y_m: MapCoordinate
    z_m: float | None = Field(default=None, ge=0, le=MAP_LIMIT_M)
    level: LevelNumber | None = None


class Replaced(_Happening):
    """Other hardware takes the beacon's place and identity: a fresh battery and a new clock.

    Attributes
    ----------
    measured_power_dbm : float or None
        What it really sends, as RSSI at one metre; where not given, what the old one sent when its
        battery was fresh. [dBm]
    advertising_interval_s : float or None
        Where not given, that of the old one. [s]
    """

    event: Literal["replaced"] = "replaced"
    measured_power_dbm: MeasuredPower | None = None
    advertising_interval_s: AdvertisingInterval | None = None


class Sags(_Happening):
    """The battery gives way: the power falls in equal steps.

    Attributes
    ----------
    power_db : float
        Change of the power once it is over. [dB]
    duration_s : float
        From the event until the last step; 0 for a single step at once. [s]
    steps : int
        How many.
    """

    event: Literal["sags"] = "sags"
    power_db: float = Field(ge=-40, lt=0)
    duration_s: float = Field(default=0.0, ge=0, le=_LONGEST_S)
    steps: int = Field(default=10, ge=1, le=1000)


BeaconEvent = Annotated[Dies | Reboots | Moves | Replaced | Sags, Field(discriminator="event")]


def impossible_events(
    beacons: Sequence[Beacon], events: Sequence[BeaconEvent]
) -> Iterator[tuple[int, str]]:
    """Numbers of the events that cannot happen, and why: no such beacon, or it is dead."""
    known = {beacon.id for beacon in beacons}
    dead_s: dict[str, float] = {}
    for number in in_order(events):
        event = events[number]
        if event.beacon not in known:
            yield number, f"there is no beacon '{event.beacon}'"
        elif isinstance(event, Replaced):
            dead_s.pop(event.beacon, None)
        elif event.beacon in dead_s:
            died = f"beacon '{event.beacon}' died at {dead_s[event.beacon]:g} s"
            yield number, f"{died}; from then on it can only be replaced"
        elif isinstance(event, Dies):
            dead_s[event.beacon] = event.at_s


def in_order(events: Sequence[BeaconEvent]) -> list[int]:
    """Numbers of the events in the order in which they happen."""
    return sorted(range(len(events)), key=lambda number: events[number].at_s)
