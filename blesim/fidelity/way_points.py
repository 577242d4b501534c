"""Walks from way point to way point, with the headings the phone told on them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from blesim.fidelity.comparison import Panel, distribution
from blesim.fidelity.felt import FeltWalk, Numbers
from blesim.fidelity.scorecard import Statistic
from blesim.units import wrap_angle

# Slower from way point to way point, a walker stopped or took a detour.
_SLOWEST_M_S = 0.7
_SHORTEST_M = 3.0
# At the ends of a stretch people turn.
_TURN_S = 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trace:
    """A walk with its way points.

    Attributes
    ----------
    felt : FeltWalk
        What the sensors told.
    heading_s, heading_rad : ndarray of float64, (n,)
        Headings as the phone's system tells them. [s], [rad]
    mark_s : ndarray of float64, (k,)
        When the walker pressed each way point. [s]
    mark_m : ndarray of float64, (k, 2)
        Where they are. [m]
    """

    felt: FeltWalk
    heading_s: Numbers
    heading_rad: Numbers
    mark_s: Numbers
    mark_m: Numbers

    def rate_hz(self) -> float:
        """Sample rate of the sensors. [Hz]."""
        time_s = self.felt.time_s
        return float((len(time_s) - 1) / (time_s[-1] - time_s[0]))

    def directions_rad(self) -> Numbers:
        """Direction from each way point to the next, (k - 1,). [rad]."""
        x_m, y_m = np.diff(self.mark_m, axis=0).T
        return np.asarray(np.arctan2(y_m, x_m))

    def straight(self) -> list[int]:
        """Stretches between way points that were walked straight, by their first way point."""
        lengths_m = np.hypot(*np.diff(self.mark_m, axis=0).T)
        quick = lengths_m >= _SLOWEST_M_S * np.diff(self.mark_s)
        return [int(i) for i in np.flatnonzero(quick & (lengths_m >= _SHORTEST_M))]

    def heading_errors_rad(self, stretch: int, margin_s: float = 0.0) -> Numbers:
        """Told heading less the direction of a stretch, its ends left out, (m,). [rad]."""
        start_s, end_s = self.mark_s[stretch] + margin_s, self.mark_s[stretch + 1] - margin_s
        rows = (self.heading_s >= start_s) & (self.heading_s < end_s)
        return wrap_angle(self.heading_rad[rows] - self.directions_rad()[stretch])


def stretch_errors_deg(trace: Trace) -> Numbers:
    """Mean heading error of each straight stretch, the offset of the trace taken off. [degree]."""
    means = [_mean_angle(trace.heading_errors_rad(stretch)) for stretch in trace.straight()]
    if not means:
        return np.empty(0)
    return np.degrees(wrap_angle(np.array(means) - _mean_angle(np.array(means))))


def within_stretch_deg(trace: Trace) -> Numbers:
    """Deviation of the heading within each straight stretch, its ends left out. [degree]."""
    errors = [trace.heading_errors_rad(i, margin_s=_TURN_S) for i in trace.straight()]
    return np.array(
        [np.degrees(np.std(wrap_angle(e - _mean_angle(e)))) for e in errors if len(e) > 1]
    )


def _mean_angle(angles_rad: Numbers) -> float:
    return float(np.angle(np.sum(np.exp(1j * angles_rad))))


def heading_statistics(traces: Sequence[Trace]) -> Iterator[Statistic]:
    """How far the told heading is off, a number a straight stretch."""
    errors_deg = [stretch_errors_deg(trace) for trace in traces]
    changes_deg = [wrap_angle(np.radians(np.diff(each))) for each in errors_deg]
    within_deg = [within_stretch_deg(trace) for trace in traces]
    for name, values in (
        ("error of a stretch, absolute", [np.abs(each) for each in errors_deg]),
        ("change from stretch to stretch", [np.degrees(np.abs(each)) for each in changes_deg]),
        ("deviation within a stretch", within_deg),
    ):
        yield Statistic(name=f"heading: {name}", unit="degree", values=np.concatenate(values))


def heading_panel(real: Sequence[Trace], simulated: Sequence[Trace]) -> Panel:
    """Panel of the heading errors of the stretches."""
    sides = real, simulated
    return distribution(
        "heading error of a straight stretch",
        "told less true, offset of the walk removed [degree]",
        *(np.concatenate([stretch_errors_deg(trace) for trace in side]) for side in sides),
    )
