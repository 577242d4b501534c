"""A recording and its twin, compared: the scorecard, and what the picture of it shows."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from blesim.errors import UsageError
from blesim.fidelity.links import median_over
from blesim.fidelity.scorecard import Score

Numbers = NDArray[np.float64]
UnitT = TypeVar("UnitT")
# A twin that hears a smaller share of the readings has nothing to compare.
_HEARD = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """One plot: the same curve from the recording and from its twin.

    Attributes
    ----------
    title, x_label, y_label : str
        What it shows; labels with their units.
    kind : str
        ``distribution``: samples, drawn as share below a value; ``curve``: pairs of x and y.
    real, simulated : ndarray of float64
        Samples (n,) of a distribution, or rows x, y of a curve (2, n).
    """

    title: str
    x_label: str
    y_label: str
    kind: Literal["distribution", "curve"]
    real: Numbers
    simulated: Numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """What `blesim fidelity` tells of one data set.

    Attributes
    ----------
    title : str
        Which part of which recording is compared, simulated with what.
    scores : tuple of Score
        The scorecard.
    panels : tuple of Panel
        For the picture.
    """

    title: str
    scores: tuple[Score, ...]
    panels: tuple[Panel, ...]


def refuse_silent(real: int, simulated: int) -> None:
    """Raise `UsageError` if the twin hears next to nothing of what was recorded.

    Parameters
    ----------
    real, simulated : int
        Numbers of readings.
    """
    if simulated < _HEARD * real:
        raise UsageError(
            f"the twin has {simulated} readings where {real} were recorded: too few to compare;"
            " look at the powers and losses of the radio"
        )


def correlation_panel(
    title: str,
    unit: str,
    lags_s: Numbers,
    correlations: Callable[[Sequence[UnitT], float], Sequence[float]],
    real: Sequence[UnitT],
    simulated: Sequence[UnitT],
) -> Panel:
    """A panel of the median autocorrelation over the units of each side, lag by lag.

    Parameters
    ----------
    title, unit : str
        What it shows; what a unit is.
    lags_s : ndarray of float64, (n,)
        [s]
    correlations : callable
        Autocorrelations of all units of a side at a lag [s].
    real, simulated : sequence
        Units of both sides.
    """
    curves = [
        [median_over(correlations(side, lag)) for lag in lags_s.tolist()]
        for side in (real, simulated)
    ]
    return Panel(
        title=title,
        x_label="lag [s]",
        y_label=f"autocorrelation, median {unit} [-]",
        kind="curve",
        real=np.array([lags_s, curves[0]]),
        simulated=np.array([lags_s, curves[1]]),
    )


def distribution(
    title: str, x_label: str, real: Sequence[float] | Numbers, simulated: Sequence[float] | Numbers
) -> Panel:
    """A panel of two distributions; what is not finite is left out."""
    samples = [np.asarray(side, dtype=np.float64) for side in (real, simulated)]
    return Panel(
        title=title,
        x_label=x_label,
        y_label="share below [-]",
        kind="distribution",
        real=samples[0][np.isfinite(samples[0])],
        simulated=samples[1][np.isfinite(samples[1])],
    )
