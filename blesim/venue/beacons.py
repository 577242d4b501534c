"""A beacon: who it says it is, where it is mounted and how it sends."""

from collections.abc import Mapping
from typing import Annotated, Literal
from uuid import UUID

from pydantic import AfterValidator, Field, ValidationInfo, field_validator

from blesim.settings import MAP_LIMIT_M, LevelNumber, MapCoordinate, Name, Settings

CHANNELS = (37, 38, 39)
INTERVAL_STEP_S = 0.000_625
_SHORTEST_INTERVAL_S = 0.02
_LONGEST_INTERVAL_S = 10.24

Payload = Literal["ibeacon", "eddystone-uid"]
# On air at 1 Mbit/s: 8 us a byte, 16 bytes besides the data (Bluetooth Core, Vol 6 Part B 2.1). An
# iBeacon has 30 bytes of data (Apple, Proximity Beacon Specification R1), an Eddystone-UID 31.
PACKET_DURATION_US: Mapping[Payload, int] = {"ibeacon": 368, "eddystone-uid": 376}


def _on_the_grid(interval_s: float) -> float:
    steps = interval_s / INTERVAL_STEP_S
    if abs(steps - round(steps)) > 1e-6:
        nearest = round(steps) * INTERVAL_STEP_S
        raise ValueError(f"not a multiple of 0.625 ms; the nearest is {nearest:.6f} s")
    return interval_s


_ChannelGain = Annotated[float, Field(ge=-30, le=30)]
MeasuredPower = Annotated[float, Field(ge=-127, le=0)]
AdvertisingInterval = Annotated[
    float, Field(ge=_SHORTEST_INTERVAL_S, le=_LONGEST_INTERVAL_S), AfterValidator(_on_the_grid)
]


class Beacon(Settings):
    """An iBeacon or Eddystone beacon on a map.

    Attributes
    ----------
    id : str
        Name on the map, such as the label on the shelf.
    uuid, major, minor : UUID, int, int
        Identity in the advertisement.
    x_m, y_m : float
        Position on its level. [m]
    z_m : float
        Height above the level's floor. [m]
    level : int
        Level it is mounted on.
    tx_power_dbm : float
        Transmit power setting. [dBm]
    measured_power_dbm : float
        RSSI at one metre, as the beacon announces it. [dBm]
    advertising_interval_s : float
        20 ms to 10.24 s in steps of 0.625 ms (Bluetooth Core, Vol 6 Part B 4.4.2.2). [s]
    channel_gain_db : tuple of three float
        Departure of channels 37, 38, 39 from the measured power: the hardware's own. [dB]
    payload : str
        ``ibeacon`` or ``eddystone-uid``: how long a packet is on air.
    packet_spacing_us : int or None
        From the start of one packet of an advertising event to the next, by chip; where not given,
        that of all beacons. [us]
    facing_deg : float or None
        Heading of the antenna's boresight, such as away from the wall it hangs on; not given for an
        antenna that sends alike to all sides. [degree]
    front_to_back_db : float
        Level straight ahead over that behind. [dB]
    """

    id: Name
    uuid: UUID
    major: int = Field(ge=0, le=65535)
    minor: int = Field(ge=0, le=65535)
    x_m: MapCoordinate
    y_m: MapCoordinate
    z_m: float = Field(ge=0, le=MAP_LIMIT_M)
    level: LevelNumber = 0
    tx_power_dbm: float = Field(ge=-40, le=20)
    measured_power_dbm: MeasuredPower
    advertising_interval_s: AdvertisingInterval
    channel_gain_db: tuple[_ChannelGain, _ChannelGain, _ChannelGain] = (0.0, 0.0, 0.0)
    payload: Payload = "ibeacon"
    packet_spacing_us: int | None = Field(default=None, ge=400, le=5000)
    facing_deg: float | None = Field(default=None, ge=-360, le=360)
    front_to_back_db: float = Field(default=0.0, ge=0, le=40)

    @field_validator("front_to_back_db")
    @classmethod
    def _faces_somewhere(cls, front_to_back_db: float, info: ValidationInfo) -> float:
        if front_to_back_db > 0 and info.data.get("facing_deg") is None:
            raise ValueError("give 'facing_deg' too, or nobody knows where the front is")
        return front_to_back_db

    @property
    def packet_duration_us(self) -> int:
        """How long one of its packets is on air. [us]."""
        return PACKET_DURATION_US[self.payload]
