"""Simulated beside published: means with their intervals, ratios, orderings with significance."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from blesim.reruns.base import Change, Expected, Experiment, Key, Numbers

CONFIDENCE = 0.95
# A figure agrees if neither is more than so many times the other.
FACTOR = 1.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """A number of a paper beside ours.

    Attributes
    ----------
    paper : str
    key : Key
    simulated, low, high : float
        Mean over the seeds, and its 95 % confidence interval.
    published : float or None
        As printed; none for a number that the paper does not give.
    compared : bool
        Whether their ratio says something.
    """

    paper: str
    key: Key
    simulated: float
    low: float
    high: float
    published: float | None
    compared: bool

    @property
    def ratio(self) -> float | None:
        """Simulated over published; none where there is no such number."""
        if not self.published or not np.isfinite(self.simulated):
            return None
        return self.simulated / self.published

    @property
    def agrees(self) -> bool | None:
        """Whether both are within a factor of 1.5 of each other; none if that says nothing."""
        ratio = self.ratio
        if ratio is None or not self.compared:
            return None
        return bool(1.0 / FACTOR <= ratio <= FACTOR)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ordering:
    """A published ordering beside ours: better less worse, negative where it holds.

    Attributes
    ----------
    paper : str
    better, worse : Key
    condition : str
    published_difference : float or None
        None where the ordering is published in words alone.
    simulated_difference, low, high : float
        Mean over the seeds of the difference, and its 95 % confidence interval; both numbers of a
        difference are of the same seed.
    p_value : float
        Two-sided, of Student's t test of the paired differences.
    strong : bool
    """

    paper: str
    better: Key
    worse: Key
    condition: str
    published_difference: float | None
    simulated_difference: float
    low: float
    high: float
    p_value: float
    strong: bool

    @property
    def held(self) -> bool:
        """Whether ours has the published sign; where there is no number, better is less."""
        published = -1.0 if self.published_difference is None else self.published_difference
        return bool(self.simulated_difference * published > 0)


@dataclass(frozen=True, slots=True, kw_only=True)
class ChangedFigure:
    """A number with one thing otherwise, beside what it is without.

    Attributes
    ----------
    key : Key
    simulated, low, high : float
        Mean over the seeds, and its 95 % confidence interval.
    difference, difference_low, difference_high : float
        To the experiment as it is, seed by seed.
    """

    key: Key
    simulated: float
    low: float
    high: float
    difference: float
    difference_low: float
    difference_high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Changed:
    """What a change did to the numbers it shows."""

    change: Change
    figures: tuple[ChangedFigure, ...]


def changed_of(
    change: Change, numbers: Mapping[Key, Numbers], otherwise: Mapping[Key, Numbers]
) -> Changed:
    """What a change did.

    Parameters
    ----------
    change : Change
        Which.
    numbers, otherwise : mapping of Key to ndarray of float64, (seeds,)
        What the same seeds gave without and with it.
    """
    figures = []
    for key in change.shown:
        mean, low, high = interval(otherwise[key])
        difference, difference_low, difference_high = interval(otherwise[key] - numbers[key])
        figures.append(
            ChangedFigure(
                key=key,
                simulated=mean,
                low=low,
                high=high,
                difference=difference,
                difference_low=difference_low,
                difference_high=difference_high,
            )
        )
    return Changed(change=change, figures=tuple(figures))


def figures_of(experiment: Experiment, numbers: Mapping[Key, Numbers]) -> tuple[Figure, ...]:
    """Every number of an experiment beside the published one, in the order of the paper.

    Parameters
    ----------
    experiment : Experiment
        Whose.
    numbers : mapping of Key to ndarray of float64, (seeds,)
        What the seeds gave.
    """
    printed = {each.key: each for each in experiment.published}
    keys = [*printed, *(key for key in numbers if key not in printed)]
    found = []
    for key in keys:
        mean, low, high = interval(numbers[key])
        published = printed.get(key)
        found.append(
            Figure(
                paper=experiment.paper,
                key=key,
                simulated=mean,
                low=low,
                high=high,
                published=None if published is None else published.value,
                compared=published is not None and published.compared,
            )
        )
    return tuple(found)


def orderings_of(experiment: Experiment, numbers: Mapping[Key, Numbers]) -> tuple[Ordering, ...]:
    """Every published ordering beside ours."""
    printed = {each.key: each.value for each in experiment.published}
    return tuple(
        _ordering(experiment.paper, expected, printed, numbers) for expected in experiment.expected
    )


def _ordering(
    paper: str,
    expected: Expected,
    printed: Mapping[Key, float],
    numbers: Mapping[Key, Numbers],
) -> Ordering:
    difference = numbers[expected.better] - numbers[expected.worse]
    mean, low, high = interval(difference)
    return Ordering(
        paper=paper,
        better=expected.better,
        worse=expected.worse,
        condition=expected.condition,
        published_difference=_difference(printed.get(expected.better), printed.get(expected.worse)),
        simulated_difference=mean,
        low=low,
        high=high,
        p_value=_p_value(difference),
        strong=expected.strong,
    )


def _difference(better: float | None, worse: float | None) -> float | None:
    return None if better is None or worse is None else better - worse


def interval(values: Numbers) -> tuple[float, float, float]:
    """Mean of independent values and its 95 % confidence interval (Student's t).

    With one value there is no interval: both ends are NaN.
    """
    mean = float(np.mean(values))
    if len(values) < 2:
        return mean, np.nan, np.nan
    quantile = float(stats.t.ppf(0.5 + CONFIDENCE / 2, len(values) - 1))
    half = quantile * float(np.std(values, ddof=1)) / np.sqrt(len(values))
    return mean, float(mean - half), float(mean + half)


def _p_value(difference: Numbers) -> float:
    # Differences that are equal but for rounding have no spread to test with.
    if len(difference) < 2 or np.ptp(difference) <= 1e-9 * np.max(np.abs(difference)):
        return float("nan")
    return float(stats.ttest_1samp(difference, 0.0).pvalue)


def stacked(trials: Sequence[Mapping[Key, float]]) -> dict[Key, Numbers]:
    """Numbers of several seeds by key, (seeds,); a number that is missing in a seed is NaN."""
    keys = dict.fromkeys(key for numbers in trials for key in numbers)
    return {key: np.array([numbers.get(key, np.nan) for numbers in trials]) for key in keys}
