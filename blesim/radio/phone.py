"""A phone: how its radio scans, how it measures, and what its system tells an application."""

from collections.abc import Mapping
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from blesim.radio.delivery import Delivery
from blesim.settings import Settings
from blesim.venue.beacons import CHANNELS

RSSI_RANGE_DBM = (-127, 20)

Mode = Literal[
    "android-2014-low-power",
    "android-2014-balanced",
    "android-2014-low-latency",
    "android-2016-low-power",
    "android-2016-balanced",
    "android-2016-low-latency",
    "android-2023-low-power",
    "android-2023-balanced",
    "android-2023-low-latency",
]
# Window and interval in ms, from the sources of Android (AOSP, ScanManager.java): versions 5 and 6,
# 7 to 12, and the current one.
SCAN_MODES: Mapping[Mode, tuple[float, float]] = {
    "android-2014-low-power": (500.0, 5000.0),
    "android-2014-balanced": (2000.0, 5000.0),
    "android-2014-low-latency": (5000.0, 5000.0),
    "android-2016-low-power": (512.0, 5120.0),
    "android-2016-balanced": (1024.0, 4096.0),
    "android-2016-low-latency": (4096.0, 4096.0),
    "android-2023-low-power": (140.0, 1400.0),
    "android-2023-balanced": (183.0, 730.0),
    "android-2023-low-latency": (100.0, 100.0),
}
Gain = Annotated[float, Field(ge=-30, le=30)]
_USUAL: Mode = "android-2016-low-latency"


class Scanner(Settings):
    """A scanner that listens to one advertising channel at a time: 37, 38, 39, 37 and so on.

    Without any setting it is Android's low latency mode of versions 7 to 12.

    Attributes
    ----------
    mode : str or None
        A named pair of window and interval, a key of `SCAN_MODES`; or else the numbers:
    interval_ms, window_ms : float or None
        One channel is scanned for the window at the start of each interval; without a window, for
        the whole interval. [ms]
    all_channels : bool
        Whether it hears all three channels at once, as a dedicated receiver with three radios does.
    """

    mode: Mode | None = None
    interval_ms: float | None = Field(default=None, ge=2.5, le=40960)
    window_ms: float | None = Field(default=None, ge=2.5, le=40960)
    all_channels: bool = False

    @model_validator(mode="after")
    def _one_timing(self) -> "Scanner":
        if self.mode is not None and (self.interval_ms, self.window_ms) != (None, None):
            raise ValueError("give either 'mode' or 'interval_ms' and 'window_ms'")
        if self.window_ms is not None and self.interval_ms is None:
            raise ValueError("give 'interval_ms' together with 'window_ms'")
        return self

    @model_validator(mode="after")
    def _window_fits(self) -> "Scanner":
        if self.window_us > self.interval_us:
            raise ValueError(
                f"window_ms {self.window_ms:g} is longer than interval_ms {self.interval_ms:g}"
            )
        return self

    @property
    def interval_us(self) -> int:
        """From the start of one scan to that of the next, on the next channel. [us]."""
        if self.interval_ms is not None:
            return round(self.interval_ms * 1000)
        return round(SCAN_MODES[self.mode or _USUAL][1] * 1000)

    @property
    def window_us(self) -> int:
        """How long each scan listens. [us]."""
        if self.window_ms is not None:
            return round(self.window_ms * 1000)
        if self.interval_ms is not None:
            return self.interval_us
        return round(SCAN_MODES[self.mode or _USUAL][0] * 1000)

    @property
    def cycle_us(self) -> int:
        """How long it takes until the same channel comes again. [us]."""
        return len(CHANNELS) * self.interval_us


class Receiver(Settings):
    """How a phone's radio turns power into RSSI, and when it gets a packet at all.

    Attributes
    ----------
    offset_db : float
        What this phone's scale reads above the standard; two of one maker differ by up to 11. The
        sensitivity counts on the same scale, as do the levels at which reception was measured. [dB]
    channel_gain_db : tuple of three float
        Departure on channels 37, 38, 39. [dB]
    noise_db : float
        Spread of the measurement before rounding: 0.4 measured. [dB]
    sensitivity_dbm : float
        Power at which half of the packets that are not lost otherwise arrive. [dBm]
    edge_db : float
        Scale of the logistic edge. With 2.3, a sensitivity of -95 and the random loss, reception is
        0.88, 0.78, 0.64 and 0.16 at -87, -91, -93 and -98.5 dBm, where 0.86, 0.79, 0.65 and 0.13
        (below -98) were measured. [dB]
    random_loss : float
        Share of packets lost even when strong: 0.09 measured. [-]
    """

    offset_db: float = Field(default=0.0, ge=-30, le=30)
    channel_gain_db: tuple[Gain, Gain, Gain] = (0.0, 0.0, 0.0)
    noise_db: float = Field(default=0.4, ge=0, le=10)
    sensitivity_dbm: float = Field(default=-95.0, ge=-120, le=-40)
    edge_db: float = Field(default=2.3, gt=0, le=20)
    random_loss: float = Field(default=0.09, ge=0, le=1)

    def reception(self, power_dbm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Probability that a packet of a power is strong enough, (n,): a logistic edge. [-]."""
        margin = (power_dbm - self.sensitivity_dbm) / self.edge_db
        # Beyond 60 edges the exponential says 0 or 1 to the last bit.
        return 1.0 / (1.0 + np.exp(-np.clip(margin, -60.0, 60.0)))

    def rssi_dbm(
        self, power_dbm: NDArray[np.float64], deviates: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """RSSI of packets, (n,): power plus noise, in whole dB within the range. [dBm]."""
        return np.clip(np.rint(power_dbm + self.noise_db * deviates), *RSSI_RANGE_DBM)


class Phone(Settings):
    """A phone profile.

    Attributes
    ----------
    scanner, receiver : Scanner, Receiver
        Its radio.
    delivery : Delivery
        What its system hands to the application.
    height_m : float
        At which it is carried: about 1 m at the waist. [m]
    held : bool
        Whether a person carries it, whose body shadows and sways; a tripod does neither.
    tells_channel : bool
        Whether the application learns the channel of a packet. Android and iOS never tell; some
        beacons put it into the payload.
    """

    scanner: Scanner = Scanner()
    receiver: Receiver = Receiver()
    delivery: Delivery = Delivery()
    height_m: float = Field(default=1.0, ge=0, le=3)
    held: bool = True
    tells_channel: bool = False
