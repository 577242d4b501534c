"""Statistics of what a phone feels of its carrier's steps, a number a piece of a walk."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from blesim.fidelity.comparison import Panel, distribution
from blesim.fidelity.felt import RATE_HZ, Numbers, Piece
from blesim.fidelity.scorecard import Statistic

_Measure = Callable[[Piece], float]

# Order tracking: windows of so many steps, half of it apart, at so many points a step.
_WINDOW_STEPS = 8
_POINTS = 16
# Slower than the stride: how the phone is held.
_WANDER = butter(2, 0.3, fs=RATE_HZ, output="sos")
_EDGE_S = 1.0
_FEWEST_PAIRS = 8
# Somebody who walks never holds a phone so still for half a second.
_QUIET_M_S2 = 0.25
QUIET_S = 0.5


def gait_statistics(label: str, pieces: Sequence[Piece]) -> Iterator[Statistic]:
    """The statistics of steps that are compared, whatever the way of carrying.

    Parameters
    ----------
    label : str
        Way of carrying; begins the names.
    pieces : sequence of Piece
        Real or simulated.
    """
    measures: tuple[tuple[str, str, _Measure], ...] = (
        ("step interval, variation", "1", interval_variation),
        ("step interval, left to right", "1", alternation),
        ("peak to peak", "m/s2", peak_to_peak_m_s2),
        ("height of a peak", "m/s2", peak_m_s2),
        ("peak to peak, variation", "1", peak_to_peak_variation),
        ("correlation of consecutive peaks", "1", partial(peak_correlation, lag=1)),
        ("correlation of every other peak", "1", partial(peak_correlation, lag=2)),
        ("power at the stride frequency", "1", partial(norm_share, order=0.5)),
        ("power at the step frequency", "1", partial(norm_share, order=1.0)),
        ("power at its double", "1", partial(norm_share, order=2.0)),
        ("power of all axes at the stride frequency", "1", partial(axes_share, order=0.5)),
        ("power of all axes at the step frequency", "1", partial(axes_share, order=1.0)),
        ("slow wander of the attitude", "degree", wander_deg),
    )
    for name, unit, measure in measures:
        yield Statistic(
            name=f"{label}: {name}", unit=unit, values=np.array([measure(p) for p in pieces])
        )


def attitude_statistics(label: str, walks: Sequence[Piece]) -> Iterator[Statistic]:
    """Mean direction of gravity's reaction in the phone's frame: a number a whole walk.

    Parameters
    ----------
    label : str
        Way of carrying; begins the names.
    walks : sequence of Piece
        Whole walks: how somebody holds a phone does not change from piece to piece.
    """
    axes = (("across the phone", 0), ("along the phone", 1), ("out of the screen", 2))
    for name, axis in axes:
        values = np.array([gravity_share(walk, axis) for walk in walks])
        yield Statistic(name=f"{label}: gravity {name}", unit="1", values=values)


def quiet_statistic(label: str, signals_m_s2: Sequence[Numbers]) -> Statistic:
    """Deviations of the acceleration over half seconds in which nobody moved.

    Parameters
    ----------
    label : str
        Way of carrying.
    signals_m_s2 : sequence of ndarray of float64
        Norm of the acceleration of each walk. [m/s^2]
    """
    deviations_m_s2 = [half_second_deviations_m_s2(signal) for signal in signals_m_s2]
    values = np.concatenate(deviations_m_s2) if deviations_m_s2 else np.empty(0)
    return Statistic(
        name=f"{label}: quiet, deviation of the norm",
        unit="m/s2",
        values=values[values < _QUIET_M_S2],
    )


def quiet(signal_m_s2: Numbers) -> NDArray[np.bool_]:
    """Whether nobody moved, for each whole half second of a walk, (m,)."""
    return np.asarray(half_second_deviations_m_s2(signal_m_s2) < _QUIET_M_S2)


def half_second_deviations_m_s2(signal_m_s2: Numbers) -> Numbers:
    """Standard deviation over each whole half second, (m,). [m/s^2]."""
    samples = round(QUIET_S * RATE_HZ)
    whole = len(signal_m_s2) // samples
    return np.asarray(signal_m_s2[: whole * samples].reshape(whole, samples).std(axis=1))


def interval_variation(piece: Piece) -> float:
    """Coefficient of variation of the step interval. [-]."""
    intervals_s = piece.intervals_s()
    return float(np.nanstd(intervals_s) / np.nanmean(intervals_s))


def alternation(piece: Piece) -> float:
    """Mean interval of every other step from that of the others, over the mean of all. [-]."""
    intervals_s = piece.intervals_s()
    of_feet = [np.nanmean(intervals_s[foot::2]) for foot in (0, 1)]
    return float(abs(of_feet[0] - of_feet[1]) / np.nanmean(intervals_s))


def peak_to_peak_m_s2(piece: Piece) -> float:
    """Median over the steps of the peak less the lowest sample after it. [m/s^2]."""
    return float(np.median(_spans_m_s2(piece)))


def peak_m_s2(piece: Piece) -> float:
    """Median over the steps of the highest sample. [m/s^2]."""
    return float(np.median(piece.peaks_m_s2()[piece.walked]))


def peak_to_peak_variation(piece: Piece) -> float:
    """Coefficient of variation of the peak less the lowest sample after it. [-]."""
    spans_m_s2 = _spans_m_s2(piece)
    return float(spans_m_s2.std() / spans_m_s2.mean())


def _spans_m_s2(piece: Piece) -> Numbers:
    return piece.spans_m_s2()[piece.walked]


def peak_correlation(piece: Piece, lag: int) -> float:
    """Correlation of the heights of peaks some steps apart; NaN for too few. [-]."""
    heights_m_s2 = np.where(piece.walked, piece.peaks_m_s2(), np.nan)
    pairs = np.stack([heights_m_s2[:-lag], heights_m_s2[lag:]])
    pairs = pairs[:, np.isfinite(pairs).all(axis=0)]
    return float(np.corrcoef(pairs)[0, 1]) if pairs.shape[1] >= _FEWEST_PAIRS else np.nan


def norm_share(piece: Piece, order: float) -> float:
    """Share of the norm's power at a multiple of the step frequency. [-]."""
    return order_share(piece, piece.signal_m_s2[:, None], order)


def axes_share(piece: Piece, order: float) -> float:
    """Share of the power of all three axes at a multiple of the step frequency. [-]."""
    return order_share(piece, piece.felt.acceleration_m_s2, order)


def order_share(piece: Piece, samples: Numbers, order: float) -> float:
    """Share of power at a multiple of the step frequency, followed from step to step.

    Time is stretched such that steps are even; the power at the order and an eighth to either side
    is taken of windows of eight steps.

    Parameters
    ----------
    piece : Piece
        Whose steps.
    samples : ndarray of float64, (n, m)
        Signals whose powers are added.
    order : float
        Multiple of the step frequency. [-]

    Returns
    -------
    float
        Median over the windows; NaN without one. [-]
    """
    found = []
    for first in range(0, len(piece.step) - _WINDOW_STEPS, _WINDOW_STEPS // 2):
        if piece.walked[first : first + _WINDOW_STEPS].all():
            power = _order_power(piece, samples, first)
            middle = round(order * _WINDOW_STEPS)
            found.append(power[middle - 1 : middle + 2].sum() / power[1:].sum())
    return float(np.median(found)) if found else np.nan


def _order_power(piece: Piece, samples: Numbers, first: int) -> Numbers:
    """Power spectrum over eight steps made even, added over the signals, (65,)."""
    steps = np.arange(_WINDOW_STEPS * _POINTS) / _POINTS
    times_s = piece.steps_s[first : first + _WINDOW_STEPS + 1]
    even_s = np.interp(steps, np.arange(_WINDOW_STEPS + 1), times_s)
    even = np.stack([np.interp(even_s, piece.felt.time_s, signal) for signal in samples.T])
    power: Numbers = (np.abs(np.fft.rfft(even, axis=1)) ** 2).sum(axis=0)
    return power


def gravity_share(piece: Piece, axis: int) -> float:
    """Component of the mean direction of gravity's reaction along an axis of the phone. [-]."""
    mean = _directions(piece).mean(axis=0)
    return float(mean[axis] / np.linalg.norm(mean))


def wander_deg(piece: Piece) -> float:
    """Root mean square angle of gravity in the phone's frame about its mean. [degree]."""
    directions = _directions(piece)
    mean = directions.mean(axis=0)
    cosine = directions @ (mean / np.linalg.norm(mean))
    angle_deg = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return float(np.sqrt(np.mean(angle_deg**2)))


def _directions(piece: Piece) -> Numbers:
    """Unit vectors of the low-passed specific force; the ends, where filters swing, left out."""
    edge = round(_EDGE_S * RATE_HZ)
    slow = sosfiltfilt(_WANDER, piece.felt.acceleration_m_s2, axis=0)[edge:-edge]
    return np.asarray(slow / np.linalg.norm(slow, axis=1, keepdims=True))


def gait_panels(label: str, real: Sequence[Piece], simulated: Sequence[Piece]) -> list[Panel]:
    """Panels of the picture: intervals, heights and the mean course of a step."""
    sides = real, simulated
    return [
        distribution(
            f"{label}: step interval",
            "interval over its mean [-]",
            *(np.concatenate([_relative_intervals(p) for p in side]) for side in sides),
        ),
        distribution(
            f"{label}: peak to peak",
            "highest less lowest of a step [m/s2]",
            *(np.concatenate([_spans_m_s2(p) for p in side]) for side in sides),
        ),
        Panel(
            title=f"{label}: the mean step",
            x_label="share of the step [-]",
            y_label="|a| - g [m/s2]",
            kind="curve",
            real=_mean_step(real),
            simulated=_mean_step(simulated),
        ),
    ]


def _relative_intervals(piece: Piece) -> Numbers:
    intervals_s = piece.intervals_s()
    return intervals_s / np.nanmean(intervals_s)


def _mean_step(pieces: Sequence[Piece]) -> Numbers:
    """Share of the step and mean signal, (2, 24), from peak to peak."""
    share = np.arange(24) / 24
    courses = [
        np.interp(start_s + share * (end_s - start_s), piece.felt.time_s, piece.signal_m_s2)
        for piece in pieces
        for start_s, end_s, walked in zip(
            piece.steps_s[:-1], piece.steps_s[1:], piece.walked, strict=True
        )
        if walked
    ]
    return np.array([share, np.mean(courses, axis=0)])
