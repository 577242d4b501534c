"""Updates at epochs: readings are collected, smoothed, and taken together at the end of each epoch.

Epochs follow each other from the first reading on. An epoch is over when the first reading of a
later one arrives; the state is then updated at the end of its epoch, and told as moved on to that
reading's time. So nothing has to be known of what happens later, and blocks may be cut anywhere.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from blesim.errors import UsageError
from blesim.estimators.base import make_track, part_of
from blesim.estimators.constant_velocity import Belief, moved
from blesim.ranging.smoothers import Smoothing, SmoothingKind
from blesim.recording import Observations
from blesim.tables import IntArray, Readings, Track
from blesim.units import MICROSECONDS_PER_SECOND, to_s, to_us

_LONGEST_S = 3600.0
_NOTHING = Track.empty()


@dataclass(frozen=True, slots=True, kw_only=True)
class EpochSettings:
    """Settings of the systems that update a constant-velocity state at epochs; all assumed.

    Parameters
    ----------
    epoch_s : float
        Length of an epoch. [s]
    every_reading : bool
        Tell the moved state after every reading too, not only after each epoch.
    silence_s : float
        After as long without a reading the state is given up and found anew. [s]
    velocity_change_m_s : float
        Standard deviation of the change of either velocity in a second: process noise. [m/s]
    start_speed_m_s : float
        Standard deviation of either velocity at the start. [m/s]
    smoothing : {"moving", "exponential", "averaged", "highest"}
        How the RSSI of a beacon is smoothed; see `blesim.ranging.smoothers.Smoothing`.
    last : int
        ``moving``: how many readings are averaged.
    rate : float
        ``exponential``, ``averaged``: weight of a new reading. [-]
    window_s : float
        A beacon not heard for as long is not heard at all. [s]

    Raises
    ------
    UsageError
        If a parameter is out of its range.
    """

    epoch_s: float = 1.0
    every_reading: bool = False
    silence_s: float = 10.0
    velocity_change_m_s: float = 0.5
    start_speed_m_s: float = 1.0
    smoothing: SmoothingKind = "moving"
    last: int = 5
    rate: float = 0.25
    window_s: float = 3.0

    def __post_init__(self) -> None:
        self.smoother_settings()
        for name in ("epoch_s", "silence_s"):
            if not 1e-3 <= getattr(self, name) <= _LONGEST_S:
                raise UsageError(f"{name} {getattr(self, name):g}: give 0.001 to {_LONGEST_S:g}")
        for name in ("velocity_change_m_s", "start_speed_m_s"):
            if not 1e-3 <= getattr(self, name) <= 100.0:
                raise UsageError(f"{name} {getattr(self, name):g}: give 0.001 to 100 m/s")

    def smoother_settings(self, *, by_channel: bool = False) -> Smoothing:
        """How RSSI is smoothed, the channels of a beacon together or apart."""
        return Smoothing(
            kind=self.smoothing,
            last=self.last,
            rate=self.rate,
            window_s=self.window_s,
            by_channel=by_channel,
        )

    def epoch_settings(self) -> "EpochSettings":
        """These settings alone, without those that a system adds."""
        return part_of(EpochSettings, self)


def refuse_bad_height(phone_height_m: float) -> None:
    """Raise `UsageError` if nobody carries a phone so far from the floor."""
    if not 0 <= phone_height_m <= 10:
        raise UsageError(f"phone_height_m {phone_height_m:g}: give 0 to 10 m above the floor")


class Measured(Protocol):
    """What a system makes of smoothed RSSI: it says where somebody is, and mends what was thought.

    `signal_dbm` is (beacons,), or (beacons, SLOTS) by channel, NaN where nothing is heard.
    """

    def found(self, signal_dbm: NDArray[np.float64]) -> Belief | None:
        """Belief at the start; none if what is heard tells no place."""
        ...

    def updated(self, last: Belief, predicted: Belief, signal_dbm: NDArray[np.float64]) -> Belief:
        """Belief after the measurements of an epoch.

        Parameters
        ----------
        last, predicted : Belief
            After the last update, and moved on to this one.
        signal_dbm : ndarray of float64
            [dBm]
        """
        ...


class EpochTracker:
    """Tracker of one phone: an estimate after each epoch.

    Parameters
    ----------
    settings : EpochSettings
        Lengths and noises.
    known : ndarray of bool, (beacons,)
        Beacons whose readings are taken; those of others are skipped.
    measured : Measured
        What a system makes of smoothed RSSI.
    by_channel : bool
        Whether the channels of a beacon are smoothed apart.
    """

    def __init__(
        self,
        settings: EpochSettings,
        known: NDArray[np.bool_],
        measured: Measured,
        *,
        by_channel: bool = False,
    ) -> None:
        self._settings = settings
        self._known = known
        self._measured = measured
        self._smoother = settings.smoother_settings(by_channel=by_channel).start(len(known))
        self._epoch_us = to_us(settings.epoch_s)
        self._silence_us = to_us(settings.silence_s)
        self._belief: Belief | None = None
        self._belief_us = 0
        self._begun = False
        self._end_us = 0
        self._heard_us = 0
        self._collected: list[Readings] = []

    @property
    def belief(self) -> Belief | None:
        """State after the last epoch; none before the first, and after a silence."""
        return self._belief

    def advance(self, block: Observations) -> Track:
        """Estimates after the epochs that the block ends, or after each of its readings."""
        told = [self._taken(part) for part in self._by_epoch(self._of_known(block.readings))]
        parts = [part for part in told if len(part)]
        # A live phone's blocks seldom tell anything, and then one estimate.
        return parts[0] if len(parts) == 1 else Track.concatenate(parts) if parts else _NOTHING

    def _of_known(self, readings: Readings) -> Readings:
        inside = (readings.beacon >= 0) & (readings.beacon < len(self._known))
        taken = inside & self._known[np.where(inside, readings.beacon, 0)]
        return readings if taken.all() else readings.rows(taken)

    def _by_epoch(self, readings: Readings) -> Iterator[Readings]:
        """Yield the readings of each epoch that has some."""
        if not len(readings):
            return
        if not self._begun:
            self._begun = True
            self._end_us = int(readings.time_us[0]) + self._epoch_us
        epoch = (readings.time_us - self._end_us) // self._epoch_us
        if epoch[0] == epoch[-1]:
            yield readings
            return
        ends = [*(np.flatnonzero(np.diff(epoch)) + 1).tolist(), len(readings)]
        first = 0
        for end in ends:
            yield readings.rows(slice(first, end))
            first = end

    def _taken(self, part: Readings) -> Track:
        """Estimates after readings of one epoch, the first of which may end the one before."""
        first_us = int(part.time_us[0])
        ended = first_us >= self._end_us
        if ended:
            self._close(first_us)
        self._collected.append(part)
        self._heard_us = int(part.time_us[-1])
        told = len(part) if self._settings.every_reading else int(ended)
        return self._told(part.time_us[:told])

    def _close(self, now_us: int) -> None:
        """Update at the end of the epoch that is over, and begin the one of now."""
        self._smooth()
        if now_us - self._heard_us >= self._silence_us:
            self._belief = None
        else:
            signal_dbm = self._smoother.at(self._end_us)
            self._belief = self._after(self._end_us, signal_dbm)
            self._belief_us = self._end_us
        self._end_us += ((now_us - self._end_us) // self._epoch_us + 1) * self._epoch_us

    def _smooth(self) -> None:
        """Smooth what was collected: all at once is faster than block by block."""
        parts = self._collected
        self._smoother.signals(parts[0] if len(parts) == 1 else Readings.concatenate(parts))
        self._collected = []

    def _after(self, end_us: int, signal_dbm: NDArray[np.float64]) -> Belief | None:
        last = self._belief
        if last is None:
            return self._measured.found(signal_dbm)
        time_s = (end_us - self._belief_us) / MICROSECONDS_PER_SECOND
        mean, covariance = moved(
            last.mean, last.covariance, time_s, self._settings.velocity_change_m_s
        )
        predicted = Belief(mean=mean, covariance=covariance, level=last.level)
        return self._measured.updated(last, predicted, signal_dbm)

    def _told(self, time_us: IntArray) -> Track:
        """Last state moved on to each time, (n,): its noise, on the velocity, adds nothing yet."""
        if self._belief is None or not len(time_us):
            return _NOTHING
        later_s = to_s(time_us - self._belief_us)
        x_m, y_m, vx_m_s, vy_m_s = self._belief.mean
        spread = self._belief.covariance

        def covariance_m2(a: int, b: int) -> NDArray[np.float64]:
            grown = spread[a, b + 2] + spread[a + 2, b]
            return np.asarray(spread[a, b] + later_s * (grown + later_s * spread[a + 2, b + 2]))

        return make_track(
            time_us=time_us,
            x_m=x_m + vx_m_s * later_s,
            y_m=y_m + vy_m_s * later_s,
            level=self._belief.level,
            variance_x_m2=covariance_m2(0, 0),
            variance_y_m2=covariance_m2(1, 1),
            covariance_xy_m2=covariance_m2(0, 1),
        )
