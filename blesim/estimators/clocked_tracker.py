"""The tracker of particle filters that have a clock of their own; see `kept_likelihoods`."""

from dataclasses import fields
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from blesim.estimators.floors import Floors
from blesim.estimators.heard import known_readings, moments_track, strongest
from blesim.estimators.kept_likelihoods import KeptCloud, KeptLikelihoods
from blesim.estimators.run import span_us
from blesim.estimators.walked_steps import StepWatch, WalkedSteps
from blesim.ranging.smoothing import SignalWindow
from blesim.recording import Observations
from blesim.tables import Readings, Track
from blesim.units import to_us

Array = NDArray[np.float64]
_NEVER_US = -(2**60)


class Sense(Protocol):
    """What tells particles how likely they are."""

    def feed(self, readings: Readings) -> None:
        """Take the next readings."""
        ...

    def increments(self, now_us: int, level: int, x_m: Array, y_m: Array) -> Array:
        """dw_b of particles (n,) on a level at a moment [us] after the readings so far, (n,)."""
        ...


class ClockedTracker:
    """Tracker with its own clock: an estimate at each multiple of t_s, which holds until the next.

    The estimate of a moment is made of what came before it. Nothing comes out before the first
    reading, and while neither a step nor any beacon in the window was there. The level is that of
    the strongest beacon in the window; on another one the cloud begins anew.

    Parameters
    ----------
    settings : KeptLikelihoods
        Of the cloud.
    floors : Floors
        Of the venue.
    watch : StepWatch
        Tells the steps.
    sense : Sense
        Tells the likelihoods.
    rng : numpy.random.Generator
        The only source of randomness.
    """

    def __init__(
        self,
        settings: KeptLikelihoods,
        floors: Floors,
        watch: StepWatch,
        sense: Sense,
        rng: np.random.Generator,
    ) -> None:
        self._settings, self._floors = settings, floors
        self._watch, self._sense, self._rng = watch, sense, rng
        beacons = len(floors.beacon_level)
        self._known = np.isin(floors.beacon_level, list(floors.motion))
        self._window = SignalWindow(
            beacons=beacons, signal="highest", window_s=settings.window_s, rate=1.0
        )
        self._tick_us = to_us(settings.interval_s)
        self._window_us = to_us(settings.window_s)
        self._next_us: int | None = None
        self._heard_us, self._walked = _NEVER_US, False
        self._cloud: KeptCloud | None = None
        self._level = 0

    def advance(self, block: Observations) -> Track:
        """Estimates at the multiples of t_s that the block reaches."""
        readings = known_readings(block.readings, self._known)
        steps = walked(self._watch, block)
        _, end_us = span_us(block)
        rows: list[tuple[float, ...]] = []
        while self._begin(readings, steps):
            now_us = self._next_us if self._next_us is not None else end_us
            readings, steps = self._take(readings, steps, now_us)
            if now_us > end_us:
                break
            rows += self._tick(now_us)
        return _track(rows)

    def _begin(self, readings: Readings, steps: WalkedSteps) -> bool:
        """Whether the clock runs; it is started by what comes first."""
        first_us = [int(table.time_us[0]) for table in (readings, steps) if len(table)]
        if self._next_us is None and first_us:
            self._next_us = (min(first_us) // self._tick_us + 1) * self._tick_us
        return self._next_us is not None

    def _take(
        self, readings: Readings, steps: WalkedSteps, until_us: int
    ) -> tuple[Readings, WalkedSteps]:
        """Take what came before a moment; what is left over comes out."""
        heard = int(np.searchsorted(readings.time_us, until_us))
        if heard:
            now = readings.rows(slice(heard))
            self._window.signals(now)
            self._sense.feed(now)
            self._heard_us = int(now.time_us[-1])
        gone = int(np.searchsorted(steps.time_us, until_us))
        for heading_rad in steps.heading_rad[:gone].tolist():
            self._walked = True
            if self._cloud is not None:
                self._cloud.move(heading_rad)
        left = {each.name: getattr(steps, each.name)[gone:] for each in fields(steps)}
        return readings.rows(slice(heard, None)), WalkedSteps(**left)

    def _tick(self, now_us: int) -> list[tuple[float, ...]]:
        """Rows of the estimate at a moment: one or none."""
        heard = now_us - self._heard_us < self._window_us
        if not heard and not self._walked:
            self._next_us = None
            return []
        self._next_us, self._walked = now_us + self._tick_us, False
        if heard:
            self._enter(int(self._floors.beacon_level[strongest(self._window.at(now_us))]))
        cloud = self._cloud
        if cloud is None:
            return []
        cloud.add(self._sense.increments(now_us, self._level, cloud.x_m, cloud.y_m))
        row = (now_us, self._level, *cloud.moments())
        cloud.resample()
        return [row]

    def _enter(self, level: int) -> None:
        """Begin anew on another level."""
        if self._cloud is None or level != self._level:
            floors = self._floors
            self._level = level
            self._cloud = KeptCloud(self._settings, floors.motion[level], floors.walls, self._rng)


def walked(watch: StepWatch, block: Observations) -> WalkedSteps:
    """Steps told in the next block; a live phone's blocks are mostly single readings."""
    if len(block.steps) or len(block.imu) or len(block.headings):
        return watch.advance(block)
    nothing = np.empty(0)
    return WalkedSteps(
        time_us=np.empty(0, np.int64),
        length_m=nothing,
        heading_rad=nothing,
        turning=np.empty(0, np.bool_),
    )


def _track(rows: list[tuple[float, ...]]) -> Track:
    """Track of rows of time, level, mean and covariance."""
    if not rows:
        return Track.empty()
    time_us, level, *moments = zip(*rows, strict=True)
    return moments_track(np.array(time_us), np.array(level), np.stack(moments, axis=1))
