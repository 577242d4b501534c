"""Particles that keep their likelihood: what comes in every t_s seconds is added to it.

The particle filter of the proximity paper [1]_, which its algorithms A, B, C and its own share:

1. Start: particles uniform over the enterable area, ``w_i = 0``.
2. At each step every particle goes 65 cm +- 10 cm towards the heading +- 15 degrees.
3. ``w_i <- max(w_i + dw_i, 0)`` (Eq 1), ``dw_i = dw_b + dw_f`` (Eq 4); dw_f is a penalty for a
   particle that would enter an un-enterable area, and is put just before it (Eq 9).
4. Estimate: mean of the places weighted by w (Eq 2, 3).
5. Stratified resampling; a copy keeps the likelihood of its parent.

References
----------
.. [1] Particle filter on beacon proximity and a floor map; digest "proximity-particle-filter".
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from blesim.columns import LONGEST_STEP_M
from blesim.estimators.base import Need
from blesim.estimators.refusals import refuse_other, refuse_outside
from blesim.estimators.surveyed_steps import learned_steps
from blesim.estimators.walked_steps import (
    StepReading,
    StepSource,
    SystemHeading,
    step_need,
)
from blesim.filters.particles import weighted_moments
from blesim.filters.plan_motion import PlanMotion
from blesim.filters.resampling import stratified
from blesim.recording import Recording
from blesim.venue.venue import Venue

Array = NDArray[np.float64]
Spread = Literal["uniform", "gaussian"]
# Added to the variances: particles that all sit in one place are not certain.
_FLOOR_M2 = 0.01
_NEVER_US = -(2**60)


@dataclass(frozen=True, slots=True, kw_only=True)
class KeptLikelihoods:
    """Settings that the particle filters of the proximity paper share.

    Parameters
    ----------
    use_map : bool
        Whether walls count. Without the map particles begin anywhere in the level's bounds and walk
        through walls.
    particles : int
        How many; 500 in the paper.
    interval_s : float
        The clock t_s; 0.5 in the paper. [s]
    step_m, step_spread_m : float
        Length of a step and its spread, 0.65 and 0.10 in the paper. [m]
    heading_spread_deg : float
        Spread of the heading, 15 in the paper. [degree]
    spread : {"uniform", "gaussian"}
        Whether these spreads are half the width of a uniform distribution, as assumed, or standard
        deviations; the paper writes +-.
    penalty : float
        dw_f; the paper prints -0.5 in Eq 9 and says -5 was chosen, -1 being too small and -10 too
        large. [-]
    source : {"system", "imu"}
        Step events of the phone's system with their headings, or detection from the peaks and
        valleys of the acceleration with the compass, as in the paper. What a survey teaches of the
        offset of the headings is taken off.
    system_heading : {"step", "stream"}
        Heading of the step event, or the latest of the system's headings.
    window_s : float
        A beacon not heard for as long is Unknown; assumed. [s]
    phone_height_m : float
        Above the floor; 1.0 in the paper. [m]

    Raises
    ------
    UsageError
        If a parameter is out of its range.
    """

    use_map: bool = True
    particles: int = 500
    interval_s: float = 0.5
    step_m: float = 0.65
    step_spread_m: float = 0.10
    heading_spread_deg: float = 15.0
    spread: Spread = "uniform"
    penalty: float = -5.0
    source: StepSource = "system"
    system_heading: SystemHeading = "step"
    window_s: float = 3.0
    phone_height_m: float = 1.0

    def __post_init__(self) -> None:
        refuse_other("source", self.source, ("system", "imu"))
        refuse_other("system_heading", self.system_heading, ("step", "stream"))
        refuse_other("spread", self.spread, ("uniform", "gaussian"))
        refuse_outside(
            particles=(self.particles, 1, 1_000_000),
            interval_s=(self.interval_s, 0.01, 60),
            step_m=(self.step_m, 0, LONGEST_STEP_M),
            step_spread_m=(self.step_spread_m, 0, LONGEST_STEP_M),
            heading_spread_deg=(self.heading_spread_deg, 0, 180),
            penalty=(self.penalty, -1e6, 0),
            window_s=(self.window_s, 0.01, 3600),
            phone_height_m=(self.phone_height_m, 0, 10),
        )

    @property
    def needs(self) -> frozenset[Need]:
        """Where the steps come from."""
        return frozenset({step_need(self.source)})

    def steps(self, venue: Venue, surveys: Sequence[Recording]) -> StepReading:
        """How steps are read, with the offset of the headings if a survey tells it."""
        how = StepReading(source=self.source, heading=self.system_heading, compass_weight=1.0)
        return learned_steps(how, venue, surveys, None, lengths=False)


class KeptCloud:
    """The particles of one phone on one level.

    Parameters
    ----------
    settings : KeptLikelihoods
        Number and motion of the particles.
    motion : PlanMotion
        Where they begin.
    walls : bool
        Whether they may not leave it.
    rng : numpy.random.Generator
        The only source of randomness.
    """

    def __init__(
        self, settings: KeptLikelihoods, motion: PlanMotion, walls: bool, rng: np.random.Generator
    ) -> None:
        self._settings = settings
        self._motion = motion
        self._walls = walls
        self._rng = rng
        self.x_m, self.y_m = motion.uniform_places(settings.particles, rng)
        self.likelihood = np.zeros(settings.particles)
        self._entered = np.zeros(settings.particles, np.bool_)

    def move(self, heading_rad: float) -> None:
        """Move all particles by one step. [rad]."""
        settings = self._settings
        length_m = settings.step_m + settings.step_spread_m * self._noise()
        heading = heading_rad + math.radians(settings.heading_spread_deg) * self._noise()
        x_m = self.x_m + length_m * np.cos(heading)
        y_m = self.y_m + length_m * np.sin(heading)
        if not self._walls:
            self.x_m, self.y_m = x_m, y_m
            return
        self.x_m, self.y_m, entered = self._motion.stopped(self.x_m, self.y_m, x_m, y_m)
        self._entered |= entered

    def _noise(self) -> Array:
        if self._settings.spread == "gaussian":
            return self._rng.standard_normal(self._settings.particles)
        return self._rng.uniform(-1.0, 1.0, self._settings.particles)

    def add(self, increments: Array) -> None:
        """Add dw_b, (n,), and the penalty of those that met a wall since the last time: Eq 1, 4."""
        change = increments + np.where(self._entered, self._settings.penalty, 0.0)
        self.likelihood = np.maximum(self.likelihood + change, 0.0)
        self._entered[:] = False

    def moments(self) -> tuple[float, float, float, float, float]:
        """Mean of Eq 2 and 3, x and y [m], and the covariance about it, xx, yy and xy [m2].

        All count the same where all likelihoods are zero. 0.1 m squared is added to the variances.
        """
        return weighted_moments(self.x_m, self.y_m, self.likelihood, _FLOOR_M2)

    def resample(self) -> None:
        """Let particles live on by their likelihood; copies keep that of their parent."""
        count = self._settings.particles
        rows = stratified(self.likelihood, self._rng.random(count), count)
        self.x_m, self.y_m = self.x_m[rows], self.y_m[rows]
        self.likelihood = self.likelihood[rows]
