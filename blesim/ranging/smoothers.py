"""Smoothed RSSI of each beacon, or of each beacon and channel: several ways, one shape.

- ``moving``: mean of the last n readings, Eq 1 of the PDR and fingerprint paper [1]_
- ``exponential``: ``S <- rate r + (1 - rate) S``, beginning at the first reading
- ``averaged``, ``highest``: over a window of time, as in `blesim.ranging.smoothing`

References
----------
.. [1] PDR and four-direction fingerprints in a Kalman filter, about 2019; digest
   "pdr-fingerprint".
"""

from dataclasses import dataclass, replace
from typing import Any, Literal, Protocol, get_args

import numpy as np
from numpy.typing import NDArray

from blesim.errors import DataError, UsageError
from blesim.kernels import kernel
from blesim.ranging.channels import SLOTS, channel_slot
from blesim.ranging.smoothing import LONGEST_WINDOW_S, SignalWindow, refuse_bad_window
from blesim.tables import Readings
from blesim.units import to_us

SmoothingKind = Literal["moving", "exponential", "averaged", "highest"]
_MOST_KEPT = 10_000
# Rows smoothed at a time where only the reading's own value is wanted of every row.
_CHUNK = 4096


@dataclass(frozen=True, slots=True, kw_only=True)
class Smoothing:
    """How RSSI is smoothed.

    Attributes
    ----------
    kind : {"moving", "exponential", "averaged", "highest"}
        Which value is formed.
    last : int
        ``moving``: how many readings.
    rate : float
        ``exponential``, ``averaged``: weight of a new reading, over 0 to 1. [-]
    window_s : float
        ``averaged``, ``highest``: length of the window. ``moving``, ``exponential``: a beacon not
        heard for as long is forgotten, and begins anew. [s]
    by_channel : bool
        Smooth the channels of a beacon apart from each other.

    Raises
    ------
    UsageError
        If a value is out of its range.
    """

    kind: SmoothingKind = "moving"
    last: int = 10
    rate: float = 0.25
    window_s: float = 3.0
    by_channel: bool = False

    def __post_init__(self) -> None:
        if self.kind not in get_args(SmoothingKind):
            raise UsageError(f"kind '{self.kind}': use one of {', '.join(get_args(SmoothingKind))}")
        if not 1 <= self.last <= _MOST_KEPT:
            raise UsageError(f"last {self.last}: give 1 to {_MOST_KEPT} readings")
        refuse_bad_window("highest", self.window_s, self.rate)

    def start(self, beacons: int) -> "Smoother":
        """Smoother of one phone in a venue of so many beacons."""
        slots = SLOTS if self.by_channel else 1
        keys = beacons * slots
        if self.kind == "averaged" or self.kind == "highest":
            window = SignalWindow(
                beacons=keys, signal=self.kind, window_s=self.window_s, rate=self.rate
            )
            return Smoother(window, beacons, slots)
        last = self.last if self.kind == "moving" else 0
        recent = RecentReadings(keys=keys, last=last, rate=self.rate, forget_s=self.window_s)
        return Smoother(recent, beacons, slots)


class Signals(Protocol):
    """The live signal values of so many keys; the ``beacon`` of a reading is its key."""

    def signals(self, readings: Readings) -> NDArray[np.float64]:
        """Value of every key after each reading of the next block, (n, keys). [dBm]."""
        ...

    def at(self, now_us: int) -> NDArray[np.float64]:
        """Value of every key at a moment after the blocks so far, (keys,). [dBm]."""
        ...


class Smoother:
    """The live smoothed RSSI of one phone: fed with readings block by block, in order of time.

    How the readings are cut into blocks never changes a result. Values are NaN where a beacon, or
    a channel of it, was not heard for the window. All three methods raise `DataError` where time
    goes back behind what was fed before.
    """

    def __init__(self, values: Signals, beacons: int, slots: int) -> None:
        self._values = values
        self._slots = slots
        self._shape = (beacons,) if slots == 1 else (beacons, slots)

    def signals(self, readings: Readings) -> NDArray[np.float64]:
        """Values of every beacon after each reading of the next block. [dBm].

        Returns
        -------
        ndarray of float64, (n, beacons) or (n, beacons, SLOTS)
            Channels, where they are smoothed apart, after `blesim.ranging.channels`.
        """
        return self._values.signals(self._keyed(readings)).reshape(-1, *self._shape)

    def smoothed(self, readings: Readings) -> NDArray[np.float64]:
        """Value of each reading's own beacon (and channel) right after it, (n,). [dBm]."""
        smoothed = np.empty(len(readings))
        for first in range(0, len(readings), _CHUNK):
            rows = slice(first, first + _CHUNK)
            part = self._keyed(readings.rows(rows))
            smoothed[rows] = self._values.signals(part)[np.arange(len(part)), part.beacon]
        return smoothed

    def at(self, now_us: int) -> NDArray[np.float64]:
        """Values of every beacon at a moment not before the last reading. [dBm].

        Returns
        -------
        ndarray of float64, (beacons,) or (beacons, SLOTS)
        """
        return self._values.at(now_us).reshape(self._shape)

    def _keyed(self, readings: Readings) -> Readings:
        if self._slots == 1:
            return readings
        keys = readings.beacon.astype(np.int64) * self._slots + channel_slot(readings.channel)
        return replace(readings, beacon=keys)


class RecentReadings:
    """The live mean of the last readings of each key, or their exponential average.

    Parameters
    ----------
    keys : int
        How many are told apart; the ``beacon`` of a reading is its key.
    last : int
        How many readings of a key are averaged; 0 for the exponential average of all.
    rate : float
        Weight of a new reading in the exponential average. [-]
    forget_s : float
        A key without a reading for as long begins anew. [s]
    """

    def __init__(
        self, *, keys: int, last: int, rate: float = 1.0, forget_s: float = LONGEST_WINDOW_S
    ) -> None:
        self._rate = rate
        self._forget_us = to_us(forget_s)
        self._now_us = np.iinfo(np.int64).min
        self._kept_dbm = np.zeros((keys, last))
        self._count = np.zeros(keys, np.int64)
        self._value = np.full(keys, np.nan)
        self._heard_us = np.zeros(keys, np.int64)

    def signals(self, readings: Readings) -> NDArray[np.float64]:
        """Value of every key after each reading of the next block, (n, keys). [dBm].

        Raises
        ------
        DataError
            If the block begins before the end of the last one.
        """
        signals = np.empty((len(readings), len(self._value)))
        if not len(readings):
            return signals
        if readings.time_us[0] < self._now_us:
            raise DataError("readings go back behind the last block; feed them in order of time")
        _advance(
            readings.time_us,
            readings.beacon,
            readings.rssi_dbm,
            self._forget_us,
            self._rate,
            self._kept_dbm,
            self._count,
            self._value,
            self._heard_us,
            signals,
        )
        self._now_us = int(readings.time_us[-1])
        return signals

    def at(self, now_us: int) -> NDArray[np.float64]:
        """Value of every key at a moment after the blocks so far, (keys,). [dBm].

        Raises
        ------
        DataError
            If the moment lies before the end of the last block.
        """
        if now_us < self._now_us:
            raise DataError(f"{now_us} us lies before the last reading; ask in order of time")
        return np.where(now_us - self._heard_us < self._forget_us, self._value, np.nan)


@kernel
def _advance(
    time_us: NDArray[Any],
    key: NDArray[Any],
    rssi_dbm: NDArray[Any],
    forget_us: int,
    rate: float,
    kept_dbm: NDArray[np.float64],
    count: NDArray[np.int64],
    value: NDArray[np.float64],
    heard_us: NDArray[np.int64],
    signals: NDArray[np.float64],
) -> None:
    """Carry the state over readings and fill the signals (n, keys) (kernel).

    The mean is summed anew from its readings, so that no rounding piles up.
    """
    last = kept_dbm.shape[1]
    for row in range(len(time_us)):
        k, reading = key[row], float(rssi_dbm[row])
        if time_us[row] - heard_us[k] >= forget_us:
            count[k] = 0
        if last > 0:
            kept_dbm[k, count[k] % last] = reading
            count[k] += 1
            value[k] = kept_dbm[k, : min(count[k], last)].mean()
        else:
            value[k] = rate * reading + (1.0 - rate) * value[k] if count[k] > 0 else reading
            count[k] += 1
        heard_us[k] = time_us[row]
        for other in range(len(value)):
            heard = time_us[row] - heard_us[other] < forget_us
            signals[row, other] = value[other] if heard else np.nan
