"""A phone: how its radio scans, how it measures, and what its system tells an application."""

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from blesim.settings import Settings
from blesim.venue.beacons import CHANNELS

RSSI_RANGE_DBM = (-127, 20)


class Scanner(Settings):
    """A scanner that listens to one advertising channel at a time: 37, 38, 39, 37 and so on.

    Attributes
    ----------
    interval_ms, window_ms : float
        One channel is scanned for the window at the start of each interval. 4096/4096 is
        Android's low latency mode of versions 7 to 12 (AOSP). [ms]
    """

    interval_ms: float = Field(default=4096.0, ge=2.5, le=40960)
    window_ms: float = Field(default=4096.0, ge=2.5, le=40960)

    @model_validator(mode="after")
    def _window_fits(self) -> "Scanner":
        if self.window_ms > self.interval_ms:
            raise ValueError(
                f"window_ms {self.window_ms:g} is longer than interval_ms {self.interval_ms:g}"
            )
        return self

    @property
    def cycle_us(self) -> int:
        """How long it takes until the same channel comes again. [us]."""
        return len(CHANNELS) * round(self.interval_ms * 1000)

    def listens(
        self, since_start_us: NDArray[np.int64], duration_us: int
    ) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
        """Whether packets fall wholly into a scan window, and which channel is being scanned.

        Parameters
        ----------
        since_start_us : ndarray of int64, (n,)
            Starts of packets, counted from the start of a scan on channel 37. [us]
        duration_us : int
            Of a packet on air. [us]

        Returns
        -------
        in_window : ndarray of bool, (n,)
        channel : ndarray of int64, (n,)
            37, 38 or 39.
        """
        interval_us, window_us = round(self.interval_ms * 1000), round(self.window_ms * 1000)
        number, within_us = np.divmod(since_start_us, interval_us)
        return within_us + duration_us <= window_us, CHANNELS[0] + number % len(CHANNELS)


class Receiver(Settings):
    """How a phone's radio turns power into RSSI, and when it gets a packet at all.

    Attributes
    ----------
    offset_db : float
        What this phone reads above the standard; two of one maker differ by up to 11. [dB]
    channel_gain_db : tuple of three float
        Departure on channels 37, 38, 39. [dB]
    noise_db : float
        Spread of the measurement before rounding: 0.4 measured. [dB]
    sensitivity_dbm : float
        Power at which half of the packets that are not lost otherwise arrive. [dBm]
    edge_db : float
        Scale of the logistic edge. With 2.3 and a sensitivity of -95, reception is 0.88, 0.78,
        0.64 and 0.18 at -87, -91, -93 and -98.5 dBm, where 0.86, 0.79, 0.65 and 0.13 (below -98)
        were measured. [dB]
    random_loss : float
        Share of packets lost even when strong: 0.09 measured. [-]
    """

    offset_db: float = Field(default=0.0, ge=-30, le=30)
    channel_gain_db: tuple[float, float, float] = (0.0, 0.0, 0.0)
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
    height_m : float
        At which it is carried: about 1 m at the waist. [m]
    tells_channel : bool
        Whether the system tells applications the channel of a packet; Android and iOS never do.
    """

    scanner: Scanner = Scanner()
    receiver: Receiver = Receiver()
    height_m: float = Field(default=1.0, ge=0, le=3)
    tells_channel: bool = False
