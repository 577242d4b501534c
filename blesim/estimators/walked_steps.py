"""Steps of a walk with their lengths, headings and turns: the front end of dead reckoning.

They come from the phone's IMU, or from the step events and headings of its system. A step has the
time at which it was told, and is known as soon as the events up to that time are: however a walk is
cut into blocks, its steps are the same to the last bit.
"""

import math
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from blesim.estimators.base import Need
from blesim.pdr.attitude import Leveller, Levelling
from blesim.pdr.double_threshold import DoubleThreshold, DoubleThresholdDetector
from blesim.pdr.features import StepFeatureReader, StepFeatures, StepFelt
from blesim.pdr.heading import (
    Complementary,
    ComplementaryFilter,
    HeldHeadings,
    StepHeadings,
    compass_heading_rad,
)
from blesim.pdr.multi_threshold import MultiThreshold, MultiThresholdDetector
from blesim.pdr.step_length import PeriodPeak, StepLengthModel
from blesim.pdr.steps import StepDetector, step_signal_m_s2
from blesim.pdr.turns import TurnDetector, Turning
from blesim.pdr.windows import NEVER_US
from blesim.recording import Observations
from blesim.tables import Steps
from blesim.units import wrap_angle

StepSource = Literal["imu", "system"]
SystemHeading = Literal["step", "stream"]
_PEAK_AND_VALLEY = MultiThreshold()
_BY_PERIOD_AND_PEAK = PeriodPeak()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WalkedSteps:
    """Steps whose heading is known, in order of time; arrays (n,).

    Attributes
    ----------
    time_us : ndarray of int64
        When the step was told. [us]
    length_m : ndarray of float64
        [m]
    heading_rad : ndarray of float64
        From the map's x axis counter-clockwise. [rad]
    turning : ndarray of bool
        Whether the walker turned since the step before.
    """

    time_us: NDArray[np.int64]
    length_m: NDArray[np.float64]
    heading_rad: NDArray[np.float64]
    turning: NDArray[np.bool_]

    def __len__(self) -> int:
        """Count the steps."""
        return len(self.time_us)


def step_need(source: StepSource) -> Need:
    """What a source of steps asks of a walk."""
    return Need.IMU if source == "imu" else Need.STEPS


class StepWatch(Protocol):
    """The live steps of one phone."""

    def advance(self, block: Observations) -> WalkedSteps:
        """Steps told in the next block; those without a heading are left out."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class StepReading:
    """How steps are read.

    Attributes
    ----------
    source : {"imu", "system"}
        IMU samples, or the step events of the phone's system.
    detector : MultiThreshold or DoubleThreshold
        ``imu``: the first hears the norm of the acceleration, the second its vertical part.
    length : StepLengthModel
        ``imu``: tells the lengths.
    compass_weight : float
        ``imu``: share of the compass in the complementary filter; 1 is the compass alone. [-]
    step_m : float or None
        ``system``: length of every step; none for what the step events tell. [m]
    heading : {"step", "stream"}
        ``system``: heading of the step event, or the latest of the stream of headings (that of the
        event before the first).
    turning_rad : float
        Angle beyond which a step turns: of the gyroscope, or between the headings of two steps as
        long as there is no IMU. [rad]
    offset_rad : float
        Added to headings: from the compass's frame into the map's. [rad]
    """

    source: StepSource = "imu"
    detector: MultiThreshold | DoubleThreshold = _PEAK_AND_VALLEY
    length: StepLengthModel = _BY_PERIOD_AND_PEAK
    compass_weight: float = 0.02
    step_m: float | None = None
    heading: SystemHeading = "step"
    turning_rad: float = math.radians(15.0)
    offset_rad: float = 0.0

    def start(self, heading_rad: float | None = None) -> StepWatch:
        """Steps of one walk.

        Parameters
        ----------
        heading_rad : float, optional
            First heading; asked for where the compass has no weight. [rad]

        Raises
        ------
        UsageError
            If the gyroscope alone is asked for without a first heading.
        """
        return SensedSteps(self, heading_rad) if self.source == "imu" else ToldSteps(self)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FeltSteps:
    """All that the IMU tells of n steps; headings may be NaN.

    Attributes
    ----------
    time_us, heading_rad, turning : ndarray, (n,)
        As of `WalkedSteps`. [us], [rad]
    features : StepFeatures
        From which a model tells the lengths.
    """

    time_us: NDArray[np.int64]
    heading_rad: NDArray[np.float64]
    turning: NDArray[np.bool_]
    features: StepFeatures


class SensedSteps:
    """The live steps in the IMU samples of one phone.

    The heading of a step is the circular mean over its gait cycle of the compass and the gyroscope
    in the complementary filter.

    Parameters
    ----------
    how : StepReading
        How steps are read.
    heading_rad : float or None
        First heading, if the compass has no weight. [rad]
    """

    def __init__(self, how: StepReading, heading_rad: float | None = None) -> None:
        self._how = how
        self._leveller = Leveller(Levelling())
        self._detector = _detector(how)
        self._vertical = isinstance(how.detector, DoubleThreshold)
        first_rad = heading_rad if how.compass_weight == 0 else None
        self._filter = ComplementaryFilter(Complementary(weight=how.compass_weight), first_rad)
        self._features = StepFeatureReader(StepFelt())
        self._headings = StepHeadings()
        self._turns = TurnDetector(Turning(band_rad=how.turning_rad))

    def felt(self, block: Observations) -> FeltSteps:
        """Steps told in the next block, with their features."""
        level = self._leveller.advance(block.imu)
        time_us, signal = level.time_us, step_signal_m_s2(block.imu)
        found = self._detector.advance(time_us, level.vertical_m_s2 if self._vertical else signal)
        compass = compass_heading_rad(level.azimuth_rad, self._how.offset_rad)
        heading = self._filter.advance(time_us, level.turn_rate_rad_s, compass)
        return FeltSteps(
            time_us=found.told_us,
            features=self._features.advance(time_us, signal, found.time_us, found.told_us),
            heading_rad=self._headings.advance(time_us, heading, found.told_us),
            turning=self._turns.advance(time_us, level.turn_rate_rad_s, found.told_us).turning,
        )

    def advance(self, block: Observations) -> WalkedSteps:
        """Steps told in the next block; see `StepWatch`."""
        if not len(block.imu):
            return _no_steps()
        felt = self.felt(block)
        length_m = self._how.length.length_m(felt.features)
        return _with_heading(felt.time_us, length_m, felt.heading_rad, felt.turning)


def _detector(how: StepReading) -> StepDetector:
    if isinstance(how.detector, DoubleThreshold):
        return DoubleThresholdDetector(how.detector)
    return MultiThresholdDetector(how.detector)


class ToldSteps:
    """The live step events of one phone's system.

    Parameters
    ----------
    how : StepReading
        How steps are read.
    """

    def __init__(self, how: StepReading) -> None:
        self._how = how
        self._held = HeldHeadings()
        self._leveller = Leveller(Levelling())
        self._turns = TurnDetector(Turning(band_rad=how.turning_rad))
        self._first_imu_us = -NEVER_US
        self._last_rad = np.nan

    def advance(self, block: Observations) -> WalkedSteps:
        """Steps told in the next block; see `StepWatch`."""
        steps = block.steps
        time_us = steps.time_us.astype(np.int64)
        held_rad = self._held.advance(block.headings.time_us, block.headings.heading_rad, time_us)
        told_rad = steps.heading_rad
        if self._how.heading == "stream":
            told_rad = np.where(np.isnan(held_rad), told_rad, held_rad)
        heading_rad = wrap_angle(told_rad + self._how.offset_rad)
        turning = self._turning(block, time_us, heading_rad)
        return _with_heading(time_us, self._lengths_m(steps), heading_rad, turning)

    def _lengths_m(self, steps: Steps) -> NDArray[np.float64]:
        if self._how.step_m is not None:
            return np.full(len(steps), self._how.step_m)
        return steps.length_m.astype(np.float64)

    def _turning(
        self, block: Observations, time_us: NDArray[np.int64], heading_rad: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        level = self._leveller.advance(block.imu)
        if len(level):
            self._first_imu_us = min(self._first_imu_us, int(level.time_us[0]))
        felt = self._turns.advance(level.time_us, level.turn_rate_rad_s, time_us)
        before_rad = np.concatenate([[self._last_rad], heading_rad])[:-1]
        self._last_rad = float(heading_rad[-1]) if len(heading_rad) else self._last_rad
        # The first step has none before it: no comparison with NaN is true.
        seen = np.abs(wrap_angle(heading_rad - before_rad)) > self._how.turning_rad
        turning: NDArray[np.bool_] = np.where(time_us >= self._first_imu_us, felt.turning, seen)
        return turning


def _with_heading(
    time_us: NDArray[np.int64],
    length_m: NDArray[np.float64],
    heading_rad: NDArray[np.float64],
    turning: NDArray[np.bool_],
) -> WalkedSteps:
    known = ~np.isnan(heading_rad)
    return WalkedSteps(
        time_us=time_us[known],
        length_m=length_m[known],
        heading_rad=heading_rad[known],
        turning=turning[known],
    )


def _no_steps() -> WalkedSteps:
    return WalkedSteps(
        time_us=np.empty(0, np.int64),
        length_m=np.empty(0),
        heading_rad=np.empty(0),
        turning=np.empty(0, bool),
    )
