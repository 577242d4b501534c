"""What of which phones goes into the recording."""

from pydantic import Field

from blesim.settings import Name, Settings, Text


class Record(Settings):
    """What goes into the recording of a phone besides the RSSI readings.

    Attributes
    ----------
    steps : bool
        Step events, and the true steps.
    imu : bool
        Samples of accelerometer, gyroscope and magnetometer, and the true steps.
    headings, pressures : bool
        The system's own heading; the barometer.
    packets : bool
        Fate and components of every packet, as truth.
    """

    steps: bool = True
    imu: bool = False
    headings: bool = False
    pressures: bool = False
    packets: bool = False


class ShopperPhones(Record):
    """Phones of some shoppers of the trading day, who are drawn by lot.

    Attributes
    ----------
    phone : str
        A name of the scenario's phones.
    count : int
        How many shoppers; those of another entry are others.
    split : str
        Part of a benchmark their walks belong to.
    """

    phone: Name
    count: int = Field(ge=1, le=200_000)
    split: Text = ""
