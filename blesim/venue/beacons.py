"""A beacon: who it says it is, where it is mounted and how it sends."""

from uuid import UUID

from pydantic import Field, field_validator

from blesim.settings import Settings

CHANNELS = (37, 38, 39)
INTERVAL_STEP_S = 0.000_625
_SHORTEST_INTERVAL_S = 0.02
_LONGEST_INTERVAL_S = 10.24


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
    """

    id: str = Field(min_length=1)
    uuid: UUID
    major: int = Field(ge=0, le=65535)
    minor: int = Field(ge=0, le=65535)
    x_m: float
    y_m: float
    z_m: float = Field(ge=0)
    level: int = 0
    tx_power_dbm: float = Field(ge=-40, le=20)
    measured_power_dbm: float = Field(ge=-127, le=0)
    advertising_interval_s: float = Field(ge=_SHORTEST_INTERVAL_S, le=_LONGEST_INTERVAL_S)
    channel_gain_db: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @field_validator("advertising_interval_s")
    @classmethod
    def _on_the_grid(cls, interval_s: float) -> float:
        steps = interval_s / INTERVAL_STEP_S
        if abs(steps - round(steps)) > 1e-6:
            nearest = round(steps) * INTERVAL_STEP_S
            raise ValueError(f"not a multiple of 0.625 ms; the nearest is {nearest:.6f} s")
        return interval_s
