"""The figures of an error table: mean, spread, percentiles and rates of one track or of many."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from blesim.metrics.position_error import PositionErrors


@dataclass(frozen=True, slots=True, kw_only=True)
class ErrorSummary:
    """Figures over n matched readings; none where there is nothing to form them of.

    Attributes
    ----------
    n, unmatched : int
        Readings with and without an estimate.
    mean_m, std_m, rmse_m : float or None
        Mean, population standard deviation and root mean square: rmse^2 = mean^2 + std^2. [m]
    median_m, p75_m, p90_m, max_m : float or None
        Percentiles, interpolated linearly between the order statistics. [m]
    ce50_m, ce95_m : float or None
        Circular error: radius around the truth that holds 50 and 95 % of the estimates. [m]
    wrong_level, wrong_aisle : float or None
        Share of readings on a wrong level and in a wrong aisle; none for the aisle unless the true
        place on the aisle graph is known at every reading. [-]
    graph_mean_m : float or None
        Mean distance along the aisles; none unless it is known and finite at every reading. [m]
    """

    n: int
    unmatched: int
    mean_m: float | None
    std_m: float | None
    rmse_m: float | None
    median_m: float | None
    p75_m: float | None
    p90_m: float | None
    ce50_m: float | None
    ce95_m: float | None
    max_m: float | None
    wrong_level: float | None
    wrong_aisle: float | None
    graph_mean_m: float | None


def summarise(errors: PositionErrors) -> ErrorSummary:
    """Figures of the errors of one track, or of several pooled."""
    error_m = errors.error_m
    return ErrorSummary(
        n=len(errors),
        unmatched=errors.unmatched,
        mean_m=_figure(np.mean, error_m),
        std_m=_figure(np.std, error_m),
        rmse_m=_figure(lambda values: np.sqrt(np.mean(values**2)), error_m),
        median_m=_percentile(error_m, 50),
        p75_m=_percentile(error_m, 75),
        p90_m=_percentile(error_m, 90),
        ce50_m=_percentile(error_m, 50),
        ce95_m=_percentile(error_m, 95),
        max_m=_figure(np.max, error_m),
        wrong_level=_figure(np.mean, errors.wrong_level),
        wrong_aisle=_figure(np.mean, errors.wrong_aisle),
        graph_mean_m=_figure(np.mean, errors.graph_m),
    )


def _figure(
    function: Callable[[NDArray[np.float64]], np.floating], values: NDArray[np.float64]
) -> float | None:
    """Result of a function, none where a value is missing: a part must not stand for the whole."""
    if not len(values) or not np.all(np.isfinite(values)):
        return None
    return float(function(values))


def _percentile(values: NDArray[np.float64], percent: float) -> float | None:
    return _figure(lambda finite: np.percentile(finite, percent), values)
