"""How sure a difference between two methods is: by readings, as published, and by runs.

Successive readings of a run share a place, a shadow and an estimate, so that their errors are not
independent: a test that counts each is far too sure. Runs are independent, and on each both methods
had the same readings.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import stats

from blesim.reruns.base import Numbers

CONFIDENCE = 0.99


class Difference(NamedTuple):
    """Mean error of a method less that of another: t, difference, half its interval. [-], [m]."""

    t: float
    difference_m: float
    half_m: float


def welch(errors_m: Numbers, others_m: Numbers) -> Difference:
    """Welch's test of two samples of unequal variance, every reading counting by itself.

    ``t = (m_1 - m_2) / sqrt(s_1^2 / n_1 + s_2^2 / n_2)``, degrees of freedom after Satterthwaite.

    Parameters
    ----------
    errors_m, others_m : ndarray of float64, (n,) and (m,)
        At least two each. [m]
    """
    parts = [float(np.var(each, ddof=1)) / len(each) for each in (errors_m, others_m)]
    lost = [
        part**2 / (len(each) - 1) for part, each in zip(parts, (errors_m, others_m), strict=True)
    ]
    difference_m = float(np.mean(errors_m) - np.mean(others_m))
    return _tested(difference_m, float(np.sqrt(sum(parts))), sum(parts) ** 2 / sum(lost))


def clustered(errors_m: Sequence[Numbers], others_m: Sequence[Numbers]) -> Difference:
    """Student's test of the paired differences of runs, every run counting by itself.

    Parameters
    ----------
    errors_m, others_m : sequence of ndarray of float64
        Of each run, the same readings in both. [m]
    """
    pairs = zip(errors_m, others_m, strict=True)
    differences_m = [float(np.mean(errors - others)) for errors, others in pairs]
    count = len(differences_m)
    error_m = float(np.std(differences_m, ddof=1) / np.sqrt(count))
    return _tested(float(np.mean(differences_m)), error_m, count - 1)


def _tested(difference_m: float, standard_error_m: float, freedom: float) -> Difference:
    quantile = float(stats.t.ppf(0.5 + CONFIDENCE / 2, freedom))
    return Difference(
        t=difference_m / standard_error_m,
        difference_m=difference_m,
        half_m=quantile * standard_error_m,
    )
