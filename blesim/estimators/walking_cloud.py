"""Particles that walk with the steps of a phone and are weighed by its readings."""

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from blesim.estimators.refusals import refuse_other, refuse_outside
from blesim.filters.particles import normalised, weighted_moments
from blesim.filters.plan_motion import PlanMotion
from blesim.filters.resampling import effective_sample_size, systematic
from blesim.kernels import kernel

Array = NDArray[np.float64]
Walls = Literal["kill", "stop", "ignore"]
# Added to the variances: particles that all sit in one place are not certain.
_FLOOR_M2 = 0.01
_NEAREST_M = 0.1
# Places tried for each particle when the cloud begins.
_TRIED = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class CloudSettings:
    """How the particles of one phone walk and weigh.

    Parameters
    ----------
    particles : int
        How many; assumed.
    length_share : float
        Standard deviation of a step's length as a share of it; assumed. [-]
    heading_spread_deg : float
        Standard deviation of each step's heading by itself: 5.8 within straight stretches of
        recorded walks. [degree]
    heading_bias_deg : float
        Standard deviation of the error that headings of steps in a row share, of which every
        particle has its own: 11 to 14 from stretch to stretch of recorded walks. [degree]
    bias_steps : float
        After how many steps it is 1 / e correlated; assumed. [-]
    walls : {"kill", "stop", "ignore"}
        A particle that meets a wall gets no weight, stops before it, or walks through. Stopped ones
        lag behind where headings are off. Where all meet a wall at once, they stop.
    trust : float
        Exponent of a reading's likelihood, for readings that are not independent: those of one
        beacon within a metre share their shadowing; assumed. [-]
    outlier : float
        Departures beyond count the same; assumed. [-]
    resample_below : float
        Share of the particles; 1 for after every reading. [-]
    roughening_m : float
        Standard deviation of what copies are moved apart by; assumed. [m]
    phone_height_m : float
        Above the floor; assumed. [m]

    Raises
    ------
    UsageError
        If a parameter is out of its range.
    """

    particles: int = 500
    length_share: float = 0.15
    heading_spread_deg: float = 6.0
    heading_bias_deg: float = 12.0
    bias_steps: float = 20.0
    walls: Walls = "kill"
    trust: float = 0.3
    outlier: float = 3.0
    resample_below: float = 0.5
    roughening_m: float = 0.2
    phone_height_m: float = 1.1

    def __post_init__(self) -> None:
        refuse_other("walls", self.walls, get_args(Walls))
        refuse_outside(
            particles=(self.particles, 1, 1_000_000),
            length_share=(self.length_share, 0, 1),
            heading_spread_deg=(self.heading_spread_deg, 0, 180),
            heading_bias_deg=(self.heading_bias_deg, 0, 180),
            bias_steps=(self.bias_steps, 0.1, 1e6),
            trust=(self.trust, 0.001, 1),
            outlier=(self.outlier, 0.1, 100),
            resample_below=(self.resample_below, 0, 1),
            roughening_m=(self.roughening_m, 0, 100),
        )


class WalkingCloud:
    """The particles of one phone on one level.

    Parameters
    ----------
    settings : CloudSettings
        Of the filter.
    motion : PlanMotion
        Where one may walk.
    rng : numpy.random.Generator
        The only source of randomness.
    """

    def __init__(
        self, settings: CloudSettings, motion: PlanMotion, rng: np.random.Generator
    ) -> None:
        self._settings, self._motion, self._rng = settings, motion, rng
        # More than enough places, of which the first reading lets the likely ones live on.
        self._x_m, self._y_m = motion.uniform_places(_TRIED * settings.particles, rng)
        self._log_weight = np.zeros(len(self._x_m))
        # Error that a particle's headings share, in standard deviations.
        self._bias = rng.standard_normal(len(self._x_m))

    def walk(self, length_m: float, heading_rad: float) -> None:
        """Move all particles by one step. [m], [rad]."""
        settings, count = self._settings, len(self._x_m)
        noise = self._rng.standard_normal((3, count))
        lengths_m = length_m * (1.0 + settings.length_share * noise[0])
        kept = math.exp(-1.0 / settings.bias_steps)
        self._bias = kept * self._bias + math.sqrt(1.0 - kept * kept) * noise[1]
        shared_rad = math.radians(settings.heading_bias_deg) * self._bias
        headings = heading_rad + shared_rad + math.radians(settings.heading_spread_deg) * noise[2]
        self._go(lengths_m * np.cos(headings), lengths_m * np.sin(headings), settings.walls)

    def hear(
        self, beacon_m: Array, curve: Array, rssi_dbm: float
    ) -> tuple[float, float, float, float, float]:
        """Mean and covariance after a reading of a beacon at (3,) with its curve. [m], [m2]."""
        settings = self._settings
        _weigh(
            self._x_m,
            self._y_m,
            self._log_weight,
            beacon_m,
            curve,
            rssi_dbm,
            settings.phone_height_m,
            settings.trust,
            settings.outlier,
        )
        weight = normalised(self._log_weight)
        moments = weighted_moments(self._x_m, self._y_m, weight, _FLOOR_M2)
        begins = len(weight) > settings.particles
        if begins or effective_sample_size(weight) < settings.resample_below * len(weight):
            self._resample(weight)
        return moments

    def moments(self) -> tuple[float, float, float, float, float]:
        """Mean and covariance as they are. [m], [m2]."""
        weight = normalised(self._log_weight)
        return weighted_moments(self._x_m, self._y_m, weight, _FLOOR_M2)

    def _resample(self, weight: Array) -> None:
        count = self._settings.particles
        rows = systematic(weight, self._rng.random(1), count)
        self._x_m, self._y_m, self._bias = self._x_m[rows], self._y_m[rows], self._bias[rows]
        self._log_weight = np.zeros(count)
        apart_m = self._settings.roughening_m * self._rng.standard_normal((2, count))
        self._go(apart_m[0], apart_m[1], "ignore" if self._settings.walls == "ignore" else "stop")

    def _go(self, right_m: Array, up_m: Array, walls: Walls) -> None:
        x_m, y_m = self._x_m + right_m, self._y_m + up_m
        if walls == "ignore":
            self._x_m, self._y_m = x_m, y_m
            return
        self._x_m, self._y_m, met = self._motion.stopped(self._x_m, self._y_m, x_m, y_m)
        # Where all met a wall, the step was wrong, not they.
        if walls == "kill" and not np.all(met | np.isneginf(self._log_weight)):
            self._log_weight[met] = -np.inf


@kernel
def _weigh(
    x_m: Array,
    y_m: Array,
    log_weight: Array,
    beacon_m: Array,
    curve: Array,
    rssi_dbm: float,
    height_m: float,
    trust: float,
    outlier: float,
) -> None:
    """Add the log likelihood of a reading to the weights, (n,), in place (kernel)."""
    up_m = beacon_m[2] - height_m
    # log10(d) = log10(d^2) / 2.
    slope, nearest = 5.0 * curve[1], _NEAREST_M * _NEAREST_M
    for i in range(len(x_m)):
        right, ahead = x_m[i] - beacon_m[0], y_m[i] - beacon_m[1]
        square = max(right * right + ahead * ahead + up_m * up_m, nearest)
        expected_dbm = curve[0] - slope * math.log10(square)
        departure = min(abs(rssi_dbm - expected_dbm) / curve[2], outlier)
        log_weight[i] -= 0.5 * trust * departure * departure
