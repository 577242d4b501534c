"""Signal value of each beacon over a sliding window of its latest readings.

After a reading at time t, the window of a beacon holds its readings with ``time > t - window``: a
reading exactly one window old has left it, the latest is always in it. Over the readings r_1 (the
oldest) to r_k of the window the signal value is, after [1]_:

- ``averaged``, Eq 3: ``S = r_1``, then ``S <- rate r_i + (1 - rate) S`` for i = 2 to k
- ``highest``, Eq 4: ``S = max r_i``

References
----------
.. [1] The aisle-graph particle filter in a wholesale store, 2016;
   digest "aisle-graph-particle-filter".
"""

from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from blesim.errors import DataError, UsageError
from blesim.kernels import kernel
from blesim.tables import Readings
from blesim.units import to_us

SignalKind = Literal["highest", "averaged"]
# No walk lasts longer: the valid range of times in a recording.
LONGEST_WINDOW_S = 366 * 24 * 3600


class SignalWindow:
    """The live window of one phone: fed with readings block by block, in order of time.

    How the readings are cut into blocks never changes a result.

    Parameters
    ----------
    beacons : int
        Number of beacons of the venue.
    signal : {"highest", "averaged"}
        Which signal value is formed.
    window_s : float
        Length of the window, from a microsecond to `LONGEST_WINDOW_S`. [s]
    rate : float
        Weight of a new reading in the average, over 0 to 1; not used by ``highest``. [-]

    Raises
    ------
    UsageError
        If a parameter is out of its range.
    """

    def __init__(self, *, beacons: int, signal: SignalKind, window_s: float, rate: float) -> None:
        refuse_bad_window(signal, window_s, rate)
        self._beacons = beacons
        self._averaged = signal == "averaged"
        self._window_us = to_us(window_s)
        self._rate = rate
        self._time_us = np.empty(0, np.int64)
        self._beacon = np.empty(0, np.int32)
        self._rssi_dbm = np.empty(0, np.int8)

    def signals(self, readings: Readings) -> NDArray[np.float64]:
        """Signal value of every beacon after each reading of the next block.

        Parameters
        ----------
        readings : Readings
            The n readings that follow those of the blocks before.

        Returns
        -------
        ndarray of float64, (n, beacons)
            NaN for a beacon without a reading in the window. [dBm]

        Raises
        ------
        DataError
            If the block begins before the end of the last one.
        """
        signals = np.empty((len(readings), self._beacons))
        self._advance(readings, signals, np.empty(0, np.int64))
        return signals

    def at(self, now_us: int) -> NDArray[np.float64]:
        """Signal value of every beacon at a moment after the blocks so far, (beacons,).

        NaN for a beacon without a reading in the window. [dBm]

        Raises
        ------
        DataError
            If the moment lies before the end of the last block.
        """
        if len(self._time_us) and now_us < self._time_us[-1]:
            raise DataError(f"{now_us} us lies before the last reading; ask in order of time")
        first = int(np.searchsorted(self._time_us, now_us - self._window_us, side="right"))
        value = np.empty(self._beacons)
        beacon, rssi_dbm = self._beacon[first:], self._rssi_dbm[first:]
        _fill_value(beacon, rssi_dbm, self._averaged, self._rate, value)
        return value

    def strongest(self, readings: Readings) -> NDArray[np.int64]:
        """Beacon with the highest signal value after each reading of the next block.

        Of several with the same value, the one that was heard most recently.

        Parameters
        ----------
        readings : Readings
            The n readings that follow those of the blocks before.

        Returns
        -------
        ndarray of int64, (n,)
            Rows of the venue's beacons.

        Raises
        ------
        DataError
            If the block begins before the end of the last one.
        """
        strongest = np.empty(len(readings), np.int64)
        self._advance(readings, np.empty((0, self._beacons)), strongest)
        return strongest

    def _advance(
        self, readings: Readings, signals: NDArray[np.float64], strongest: NDArray[np.int64]
    ) -> None:
        if not len(readings):
            return
        kept = len(self._time_us)
        if kept and readings.time_us[0] < self._time_us[-1]:
            raise DataError("readings go back behind the last block; feed them in order of time")
        time_us = np.concatenate([self._time_us, readings.time_us])
        beacon = np.concatenate([self._beacon, readings.beacon])
        rssi_dbm = np.concatenate([self._rssi_dbm, readings.rssi_dbm])
        first = _fill(
            time_us,
            beacon,
            rssi_dbm,
            kept,
            self._window_us,
            self._averaged,
            self._rate,
            np.empty(self._beacons),
            signals,
            strongest,
        )
        self._time_us, self._beacon = time_us[first:].copy(), beacon[first:].copy()
        self._rssi_dbm = rssi_dbm[first:].copy()


def refuse_bad_window(signal: str, window_s: float, rate: float) -> None:
    """Raise `UsageError` if the parameters of a window are out of their ranges."""
    if signal not in get_args(SignalKind):
        raise UsageError(f"signal '{signal}': use one of {', '.join(get_args(SignalKind))}")
    if not 1e-6 <= window_s <= LONGEST_WINDOW_S:
        raise UsageError(f"window_s {window_s:g}: give 1e-6 to {LONGEST_WINDOW_S} seconds")
    if not 0 < rate <= 1:
        raise UsageError(f"rate {rate:g}: give a number above 0, up to 1")


@kernel
def _fill(
    time_us: NDArray[np.int64],
    beacon: NDArray[Any],
    rssi_dbm: NDArray[Any],
    kept: int,
    window_us: int,
    averaged: bool,
    rate: float,
    value: NDArray[np.float64],
    signals: NDArray[np.float64],
    strongest: NDArray[np.int64],
) -> int:
    """Fill the signals (n, beacons) and the strongest (n,); an empty array is left out (kernel).

    Returns the first row that is still in the window at the end. Each window is walked through
    from its oldest reading on: nothing is carried along that blocks could change.
    """
    first = 0
    for row in range(kept, len(time_us)):
        while time_us[first] <= time_us[row] - window_us:
            first += 1
        _fill_value(beacon[first : row + 1], rssi_dbm[first : row + 1], averaged, rate, value)
        if len(signals):
            signals[row - kept] = value
        if len(strongest):
            strongest[row - kept] = _latest_of_strongest(beacon, first, row, value)
    return first


@kernel
def _fill_value(
    beacon: NDArray[Any],
    rssi_dbm: NDArray[Any],
    averaged: bool,
    rate: float,
    value: NDArray[np.float64],
) -> None:
    """Fill the signal values (beacons,) of the readings of a window, oldest first (kernel)."""
    value[:] = np.nan
    for i in range(len(beacon)):
        b, reading = beacon[i], float(rssi_dbm[i])
        if np.isnan(value[b]):
            value[b] = reading
        elif averaged:
            value[b] = rate * reading + (1.0 - rate) * value[b]
        else:
            value[b] = max(value[b], reading)


@kernel
def _latest_of_strongest(
    beacon: NDArray[Any], first: int, last: int, value: NDArray[np.float64]
) -> int:
    """Beacon of the highest value; walking back in time, only a higher value wins (kernel)."""
    best = beacon[last]
    for i in range(last - 1, first - 1, -1):
        if value[beacon[i]] > value[best]:
            best = beacon[i]
    return int(best)
