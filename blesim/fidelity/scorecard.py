"""The scorecard: each statistic of a real recording beside the same one of its simulated twin."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

_LOW, _HIGH = 0.05, 0.95
# The range of fewer units than this says nothing: that of one has no width.
_FEWEST_UNITS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Statistic:
    """One statistic over all units (links, receivers, points) of a recording.

    Attributes
    ----------
    name, unit : str
        What it is, and in what it is counted.
    values : ndarray of float64, (n,)
        One number a unit; NaN where the unit cannot tell.
    """

    name: str
    unit: str
    values: NDArray[np.float64]

    def __post_init__(self) -> None:
        values = np.asarray(self.values, dtype=np.float64)
        object.__setattr__(self, "values", values[np.isfinite(values)])

    def quantile(self, share: float) -> float:
        """Quantile over the units that can tell; NaN if none can."""
        return float(np.quantile(self.values, share)) if len(self.values) else np.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """A row of the scorecard.

    Attributes
    ----------
    statistic, unit : str
        What is compared.
    real, real_low, real_high : float
        Median, 5 % and 95 % over the real units.
    simulated : float
        Median over the simulated units.
    """

    statistic: str
    unit: str
    real: float
    real_low: float
    real_high: float
    simulated: float

    @property
    def inside(self) -> bool:
        """Whether the simulated value lies in the real range."""
        return self.real_low <= self.simulated <= self.real_high

    def cells(self) -> tuple[str, ...]:
        """The row as text: statistic, unit, four numbers, in or out."""
        numbers = (self.real, self.real_low, self.real_high, self.simulated)
        told = "in" if self.inside else "out"
        return (self.statistic, self.unit, *(f"{number:.2f}" for number in numbers), told)

    def as_dict(self) -> dict[str, Any]:
        """The row for a program; a number that does not exist is None."""
        numbers = {
            "real": self.real,
            "real_low": self.real_low,
            "real_high": self.real_high,
            "simulated": self.simulated,
        }
        told = {name: value if np.isfinite(value) else None for name, value in numbers.items()}
        return {"statistic": self.statistic, "unit": self.unit, **told, "inside": self.inside}


def scorecard(real: Iterable[Statistic], simulated: Iterable[Statistic]) -> tuple[Score, ...]:
    """Rows of the scorecard in the order of the real statistics.

    Parameters
    ----------
    real, simulated : iterable of Statistic
        Made by the same functions from the recording and from its twin. A statistic that fewer
        than four real units can tell is left out.
    """
    twins: Mapping[str, Statistic] = {statistic.name: statistic for statistic in simulated}
    return tuple(
        Score(
            statistic=each.name,
            unit=each.unit,
            real=each.quantile(0.5),
            real_low=each.quantile(_LOW),
            real_high=each.quantile(_HIGH),
            simulated=twins[each.name].quantile(0.5),
        )
        for each in real
        if len(each.values) >= _FEWEST_UNITS
    )


def inside_count(scores: Iterable[Score]) -> int:
    """How many rows lie inside."""
    return sum(score.inside for score in scores)
