"""Length of each step from its features: models and their fit on walks of known length.

References
----------
.. [1] PDR with map-compensated heading, Eq 6 to 8 and table 2; digest "map-heading-ekf".
.. [2] J. W. Kim, H. J. Jang, D.-H. Hwang and C. Park, A step, stride and heading determination for
   the pedestrian navigation system, 2004, DOI 10.5081/jgps.3.1.273.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from blesim.columns import LONGEST_STEP_M
from blesim.errors import DataError, UsageError
from blesim.pdr.features import StepFeatures

# Sums over walks are known to about 1 %; behind it coefficients would be made of these errors.
_WORST_CONDITION = 1e3


@dataclass(frozen=True, slots=True, kw_only=True)
class StepLengthModel(ABC):
    """A step length that is a sum of terms, each a feature of the step times a coefficient.

    The coefficients are the model's fields, and belong to a person and a way of carrying: fit them.

    Raises
    ------
    UsageError
        If a coefficient is not a number.
    """

    def __post_init__(self) -> None:
        if not np.all(np.isfinite(self.coefficients)):
            raise UsageError(f"{self}: every coefficient must be a number")

    @property
    def coefficients(self) -> tuple[float, ...]:
        """Coefficients in the order of the terms."""
        return tuple(getattr(self, field.name) for field in fields(self))

    @abstractmethod
    def terms(self, features: StepFeatures) -> tuple[NDArray[np.float64], ...]:
        """What the coefficients are multiplied with: one array (n,) for each."""

    def length_m(self, features: StepFeatures) -> NDArray[np.float64]:
        """Length of n steps, (n,), held within 0 and the longest a recording may tell. [m]."""
        # Added one by one: a matrix product may depend on the number of steps in its last bits.
        total = np.zeros(len(features))
        for coefficient, term in zip(self.coefficients, self.terms(features), strict=True):
            total = total + coefficient * term
        return np.clip(total, 0.0, LONGEST_STEP_M)


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedLength(StepLengthModel):
    """The same length for every step.

    Attributes
    ----------
    step_m : float
        Recorded phones in hand: 0.55 to 0.70. [m]
    """

    step_m: float = 0.6

    def terms(self, features: StepFeatures) -> tuple[NDArray[np.float64], ...]:
        """One, (n,)."""
        return (np.ones(len(features)),)


@dataclass(frozen=True, slots=True, kw_only=True)
class FrequencyVariance(StepLengthModel):
    """``A + B f + C var``, Eq 6 of [1]_: step frequency, acceleration variance.

    The coefficients of the paper are lost; these fit six recorded walks through a mall of
    27 to 97 m, phone in hand, ridge 1e-3.

    Attributes
    ----------
    base_m : float
        A. [m]
    per_hz_m : float
        B. [m s]
    per_m2_s4_m : float
        C. [s^4/m]
    """

    base_m: float = 0.10
    per_hz_m: float = 0.226
    per_m2_s4_m: float = 0.0076

    def terms(self, features: StepFeatures) -> tuple[NDArray[np.float64], ...]:
        """One, frequency and variance, (n,) each."""
        return np.ones(len(features)), features.frequency_hz, features.variance_m2_s4


@dataclass(frozen=True, slots=True, kw_only=True)
class PeriodPeak(StepLengthModel):
    """``A + B p + C s_max``, Eq 7 of [1]_: step period, smoothed peak; the one adopted there.

    Of the paper's coefficients only C = 0.068 is left, which says nothing without the others and
    its smoothing; these fit the same walks as those of `FrequencyVariance`.

    Attributes
    ----------
    base_m : float
        A. [m]
    per_s_m : float
        B. [m/s]
    per_m_s2_m : float
        C. [s^2]
    """

    base_m: float = 0.73
    per_s_m: float = -0.56
    per_m_s2_m: float = 0.039

    def terms(self, features: StepFeatures) -> tuple[NDArray[np.float64], ...]:
        """One, period and smoothed peak, (n,) each."""
        return np.ones(len(features)), features.period_s, features.smoothed_peak_m_s2


@dataclass(frozen=True, slots=True, kw_only=True)
class Weinberg(StepLengthModel):
    """``K (a_max - a_min)^(1/4)``, Eq 8 of [1]_, after H. Weinberg, AN-602, 2002.

    Attributes
    ----------
    k : float
        K of [1]_; 0.36 to 0.43 on recordings, 0.31 to 0.37 where the extremes are those of the
        plain signal. [m^(3/4) s^(1/2)]
    """

    k: float = 0.425

    def terms(self, features: StepFeatures) -> tuple[NDArray[np.float64], ...]:
        """Fourth root of the range of the acceleration, (n,)."""
        range_m_s2 = np.maximum(features.highest_m_s2 - features.lowest_m_s2, 0.0)
        return (np.sqrt(np.sqrt(range_m_s2)),)


@dataclass(frozen=True, slots=True, kw_only=True)
class Kim(StepLengthModel):
    """``K (mean |a|)^(1/3)`` of [2]_, gravity taken off the acceleration.

    Attributes
    ----------
    k : float
        0.40 to 0.46 on the walks of `FrequencyVariance`. [m^(2/3) s^(2/3)]
    """

    k: float = 0.46

    def terms(self, features: StepFeatures) -> tuple[NDArray[np.float64], ...]:
        """Cube root of the mean size of the acceleration, (n,)."""
        return (np.cbrt(features.mean_absolute_m_s2),)


Model = TypeVar("Model", bound=StepLengthModel)


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownWalk:
    """The steps of a walk whose length was measured.

    Attributes
    ----------
    features : StepFeatures
        Of all its steps.
    distance_m : float
        Length of the way. [m]

    Raises
    ------
    DataError
        If it has no step, or no length.
    """

    features: StepFeatures
    distance_m: float

    def __post_init__(self) -> None:
        if not len(self.features):
            raise DataError("a walk of known length has no step; leave it out")
        if not 0 < self.distance_m < np.inf:
            raise DataError(f"a walk is {self.distance_m:g} m long; give a length above 0")


def fit_step_length(model: Model, walks: Sequence[KnownWalk], *, ridge: float = 0.0) -> Model:
    """Copy of a model whose coefficients make the steps of each walk add up to its length.

    With the sums ``T_wj`` of term j over the steps of walk w, lengths d, the model's coefficients
    c0 and column sizes ``s_j = |T_.j|``:

    ``min_c  sum_w (d_w - sum_j T_wj c_j)^2 + ridge sum_j (s_j (c_j - c0_j))^2``

    Parameters
    ----------
    model : StepLengthModel
        Left as it is.
    walks : sequence of KnownWalk
        At least as many as coefficients, walked at different paces, unless there is a ridge.
    ridge : float
        Pull towards the model's own coefficients; 0, the least squares of [1]_, refuses what the
        walks cannot tell; 1e-3 is enough to fit with few walks. [-]

    Raises
    ------
    DataError
        If the walks do not determine the coefficients.
    UsageError
        If the ridge is negative.
    """
    if not 0 <= ridge < np.inf:
        raise UsageError(f"ridge {ridge:g}: give 0 or more")
    if not walks:
        raise DataError("no walk of known length to fit step lengths on; record a survey")
    known = np.array(model.coefficients)
    sums = np.array([[float(t.sum()) for t in model.terms(walk.features)] for walk in walks])
    sizes = np.linalg.norm(sums, axis=0)
    scaled = sums / np.where(sizes > 0, sizes, 1.0)
    if ridge == 0:
        _refuse_ill_posed(model, scaled)
    missing_m = np.array([walk.distance_m for walk in walks]) - sums @ known
    rows = np.vstack([scaled, np.sqrt(ridge) * np.eye(len(known))])
    change = np.linalg.lstsq(rows, np.append(missing_m, np.zeros(len(known))), rcond=None)[0]
    found = known + change / np.where(sizes > 0, sizes, 1.0)
    changes: dict[str, Any] = {
        field.name: float(value) for field, value in zip(fields(model), found, strict=True)
    }
    return replace(model, **changes)


def _refuse_ill_posed(model: StepLengthModel, scaled: NDArray[np.float64]) -> None:
    walks, coefficients = scaled.shape
    enough = walks >= coefficients
    if not enough or np.linalg.cond(scaled) > _WORST_CONDITION:
        raise DataError(
            f"{walks} walks of known length do not determine the {coefficients} coefficients of"
            f" {type(model).__name__}; walk at several paces, or fit with a ridge"
        )
