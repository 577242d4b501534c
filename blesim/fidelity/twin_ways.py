"""Trajectories for twins: straight on at some pace, or from way point to way point with stops."""

import numpy as np
from numpy.typing import NDArray

from blesim.columns import NO_EDGE, STATES
from blesim.fidelity.felt import Numbers
from blesim.tables import Trajectory
from blesim.units import MICROSECONDS_PER_SECOND, to_us, wrap_angle
from blesim.walkers.gait import Gait

_STATE = dict(STATES)
# Assumed: people turn on the way, beginning so long before a way point and ending so long after.
_HALF_TURN_S = 0.5
# But never for more of a stretch than this.
_LARGEST_SHARE = 0.4


def speed_at_m_s(rate_hz: float, gait: Gait) -> float:
    """Speed at which a gait has a step rate: ``f = v / (a + b v)``. [m/s]."""
    return rate_hz * gait.length_at_rest_m / (1.0 - rate_hz * gait.length_per_speed_s)


def straight_on(speed_m_s: float, duration_s: float) -> Trajectory:
    """Trajectory of somebody who walks straight on along the x axis."""
    pair = np.ones(2)
    return Trajectory(
        time_us=np.array([0, to_us(duration_s)]),
        x_m=np.array([0.0, speed_m_s * duration_s]),
        y_m=0.0 * pair,
        level=np.zeros(2, np.int16),
        heading_rad=0.0 * pair,
        speed_m_s=speed_m_s * pair,
        edge=np.full(2, NO_EDGE, np.int32),
        offset_m=np.nan * pair,
        edge_speed_m_s=np.nan * pair,
        state=np.full(2, _STATE["walking"], np.uint8),
    )


def way_walked(mark_s: Numbers, mark_m: Numbers, stood_s: Numbers, duration_s: float) -> Trajectory:
    """Trajectory straight from way point to way point, evenly but for the stops.

    Parameters
    ----------
    mark_s, mark_m : ndarray of float64, (k,) and (k, 2)
        When and where each way point was passed; at least two. [s], [m]
    stood_s : ndarray of float64, (m, 2)
        Beginning and end of each stop, in order. [s]
    duration_s : float
        Of the walk; after the last way point the walker stands. [s]

    Returns
    -------
    Trajectory
        From time 0.
    """
    turn_s, turn_rad = _turns(mark_s, mark_m)
    knots_s = np.concatenate([[0.0], mark_s, stood_s.ravel(), turn_s, [duration_s]])
    time_us = np.unique(np.round(knots_s * MICROSECONDS_PER_SECOND).astype(np.int64))
    time_us = time_us[(time_us >= 0) & (time_us <= round(duration_s * MICROSECONDS_PER_SECOND))]
    time_s = time_us / MICROSECONDS_PER_SECOND
    place_m = _places_m(time_s, mark_s, mark_m, stood_s)
    speed_m_s = np.hypot(*np.diff(place_m, axis=0).T) / np.diff(time_s)
    # Whole microseconds leave a hair's breadth of way in a stop.
    speed_m_s = np.append(np.where(speed_m_s > 1e-3, speed_m_s, 0.0), 0.0)
    nowhere = np.full(len(time_us), np.nan)
    return Trajectory(
        time_us=time_us,
        x_m=place_m[:, 0],
        y_m=place_m[:, 1],
        level=np.zeros(len(time_us), np.int16),
        heading_rad=wrap_angle(np.interp(time_s, turn_s, turn_rad)),
        speed_m_s=speed_m_s,
        edge=np.full(len(time_us), NO_EDGE, np.int32),
        offset_m=nowhere,
        edge_speed_m_s=nowhere,
        state=np.where(speed_m_s > 0, _STATE["walking"], _STATE["standing"]),
    )


def _turns(mark_s: Numbers, mark_m: Numbers) -> tuple[Numbers, Numbers]:
    """Times and headings, unwrapped, between which the walker turns evenly."""
    x_m, y_m = np.diff(mark_m, axis=0).T
    along_rad = np.unwrap(np.arctan2(y_m, x_m))
    margin_s = np.minimum(_HALF_TURN_S, _LARGEST_SHARE * np.diff(mark_s))
    ends_s = np.stack([mark_s[:-1] + margin_s, mark_s[1:] - margin_s], axis=1)
    return ends_s.ravel(), np.repeat(along_rad, 2)


def _places_m(time_s: Numbers, mark_s: Numbers, mark_m: Numbers, stood_s: Numbers) -> Numbers:
    """Where the walker is, (n, 2). [m]."""
    marks_moving_s, moving_s = (_moving_s(t, stood_s) for t in (mark_s, time_s))
    axes = [np.interp(moving_s, marks_moving_s, axis) for axis in mark_m.T]
    return np.stack(axes, axis=1)


def _moving_s(time_s: Numbers, stood_s: Numbers) -> Numbers:
    """Time less the stops up to it, (n,). [s]."""
    past_s = np.clip(time_s[:, None] - stood_s[:, 0], 0.0, stood_s[:, 1] - stood_s[:, 0])
    return np.asarray(time_s - past_s.sum(axis=1))


def stops_s(still: NDArray[np.bool_], step_s: float) -> Numbers:
    """Beginning and end of each stop, (m, 2), of whether each stretch of time was still. [s].

    Examples
    --------
    >>> stops_s(np.array([False, True, True, False, True]), 0.5).tolist()
    [[0.5, 1.5], [2.0, 2.5]]
    """
    edges = np.diff(np.concatenate([[0], still.astype(np.int8), [0]]))
    bounds = np.stack([np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)], axis=1)
    return np.asarray(bounds * step_s, dtype=np.float64)
