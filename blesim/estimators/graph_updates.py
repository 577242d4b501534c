"""The updates of the aisle-graph particle filter: one kernel for all events of a block."""

import numpy as np
from numpy.typing import NDArray

from blesim.filters.exponentials import fill_logarithms
from blesim.filters.graph_lines import fill_xy, nearest_place
from blesim.filters.graph_motion import advance_on_graph
from blesim.filters.graph_steps import step_on_graph
from blesim.filters.particles import normalised, weighted_moments
from blesim.filters.resampling import (
    effective_sample_size,
    multinomial,
    residual,
    stratified,
    systematic,
)
from blesim.kernels import kernel
from blesim.rng import normal_quantile, philox, uniform

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

# What stands in the place of a beacon: a step, or a reading that says nothing of the place.
STEP = -1
UNTOLD = -2
# Rows of the clock.
LAST_US, UPDATES = 0, 1
NEVER_US = -1
# After a longer silence particles walk on for this long; they are anywhere by then.
_LONGEST_S = 600.0
# Off the centre line of the aisle a walker may be half a metre: assumed. [m2]
OFF_CENTRE_M2 = 0.25
# Closer than this no range is told, as in `blesim.ranging.path_loss_fit`. [m2]
_NEAREST_M2 = 0.01
# Row of the scheme in `blesim.filters.resampling.Scheme`.
_SYSTEMATIC = 2
# Purposes of draws, the fourth word of their counter.
_RESAMPLING, _VELOCITY, _LENGTH, _HEADING = 0, 1, 2, 3
_WORDS = 4


@kernel
def follow_events(
    time_us: Rows,
    beacon: Rows,
    first_value: Array,
    second_value: Array,
    edge: Rows,
    offset_m: Array,
    velocity_m_s: Array,
    log_weights: Array,
    weights: Array,
    clock: Rows,
    keys: NDArray[np.uint64],
    length_m: Array,
    ends: Rows,
    one_way: NDArray[np.bool_],
    first: Rows,
    door: Rows,
    start_x_m: Array,
    start_y_m: Array,
    along_x: Array,
    along_y: Array,
    edge_level: Rows,
    edge_branch: Rows,
    beacon_xyz_m: Array,
    beacon_branch: Rows,
    level_dbm: Array,
    phone_height_m: float,
    exponents: Array,
    spreads_db: Array,
    turn_back: bool,
    by_steps: bool,
    motion: Array,
    scheme: int,
    resample_below: float,
    after_update: bool,
    level: int,
    moments: Array,
    on_edge: Rows,
    on_offset_m: Array,
) -> None:
    """Take the particles through steps and readings, and tell where they are (kernel).

    Parameters
    ----------
    time_us, beacon, first_value, second_value : ndarray of int64, int64, float64, float64, (m,)
        Events: of a reading its beacon and RSSI, of a step `STEP`, its length and heading. [us],
        [-], [dBm] or [m], [rad]
    edge, offset_m, velocity_m_s, log_weights, weights : ndarray of int64 and float64, (n,)
        The particles; changed. [m], [m/s], [-], [-]
    clock : ndarray of int64, (2,)
        Time of the last reading, number of events so far; changed.
    keys : ndarray of uint64, (2, 2)
        Of the draws at nodes and of all others; see `blesim.filters.graph_motion.motion_key`.
    length_m, ends, one_way, first, door
        See `blesim.filters.graph_motion.GraphArrays`.
    start_x_m, start_y_m, along_x, along_y, edge_level, edge_branch
        See `blesim.filters.graph_lines.GraphLines`.
    beacon_xyz_m, beacon_branch, level_dbm : ndarray, (b, 3), (b,) and (b,)
        Of the beacons; RSSI expected at one metre. [m], [-], [dBm]
    phone_height_m : float
        [m]
    exponents, spreads_db : ndarray of float64, (2,)
        Of links within a branch, and of others. [-], [dB]
    turn_back, by_steps, after_update : bool
        See `blesim.estimators.graph_particle_filter.GraphParticleFilter`.
    motion : ndarray of float64, (5,)
        Velocity spread and limit, wander, relative spread of step lengths, spread of headings.
        [m/s], [m/s], [m/sqrt(s)], [-], [rad]
    scheme : int
        Row of `blesim.filters.resampling.Scheme`.
    resample_below : float
        Share of the particles under which the effective sample size is too small; 1 always
        resamples. [-]
    level : int
        Level the particles are on.
    moments, on_edge, on_offset_m : ndarray, (r, 5), (r,) and (r,)
        Filled for each of the r readings: as of `weighted_moments`, and the nearest place on the
        graph.
    """
    count = len(edge)
    x_m, y_m, drawn = np.empty(count), np.empty(count), np.empty(count)
    row = 0
    for k in range(len(time_us)):
        update = clock[UPDATES]
        clock[UPDATES] += 1
        if beacon[k] == STEP:
            way_m, heading_rad = _steps(
                first_value[k], second_value[k], motion[3], motion[4], count, keys[1], update
            )
            step_on_graph(
                edge, offset_m, way_m, heading_rad,
                length_m, ends, one_way, first, door, along_x, along_y,
            )  # fmt: skip
            continue
        duration_s = _since_s(time_us[k], clock)
        if by_steps:
            _fill_uniforms(keys[1], update, _VELOCITY, drawn)
            _fill_wander(drawn, motion[2], duration_s, velocity_m_s)
        if duration_s > 0.0:
            advance_on_graph(
                edge, offset_m, velocity_m_s, duration_s,
                length_m, ends, one_way, first, door, turn_back, keys[0], update,
            )  # fmt: skip
        fill_xy(edge, offset_m, start_x_m, start_y_m, along_x, along_y, x_m, y_m)
        if not after_update:
            moments[row] = weighted_moments(x_m, y_m, weights, OFF_CENTRE_M2)
        if beacon[k] != UNTOLD:
            b = beacon[k]
            _weigh(
                first_value[k], x_m, y_m, edge, edge_branch, beacon_xyz_m[b], beacon_branch[b],
                level_dbm[b], phone_height_m, exponents, spreads_db, log_weights,
            )  # fmt: skip
            weights[:] = normalised(log_weights)
        if after_update:
            moments[row] = weighted_moments(x_m, y_m, weights, OFF_CENTRE_M2)
        if beacon[k] != UNTOLD and _too_uneven(weights, resample_below):
            # One number is enough for the systematic scheme.
            wanted = 1 if scheme == _SYSTEMATIC else count
            _fill_uniforms(keys[1], update, _RESAMPLING, drawn[:wanted])
            lives = _living(scheme, weights, drawn)
            _copy(lives, edge, offset_m, velocity_m_s)
            log_weights[:] = 0.0
            weights[:] = 1.0 / count
        if not by_steps:
            _perturb(keys[1], update, motion[0], motion[1], velocity_m_s)
        on_edge[row], on_offset_m[row] = nearest_place(
            moments[row, 0], moments[row, 1], level,
            start_x_m, start_y_m, along_x, along_y, length_m, edge_level,
        )  # fmt: skip
        row += 1


@kernel
def _since_s(now_us: int, clock: Rows) -> float:
    """Time since the last reading, which this one becomes (kernel). [s]."""
    last_us = clock[LAST_US]
    clock[LAST_US] = now_us
    return 0.0 if last_us == NEVER_US else min((now_us - last_us) * 1e-6, _LONGEST_S)


@kernel
def _fill_uniforms(key: NDArray[np.uint64], update: int, purpose: int, out: Array) -> None:
    """Fill the uniform numbers of one purpose in one update (kernel). [-]."""
    address = np.array([key[0], key[1], np.uint64(update), np.uint64(purpose)])
    whole = len(out) - len(out) % _WORDS
    # Written out: a loop over the words takes half as long again.
    for i in range(0, whole, _WORDS):
        a, b, c, d = philox(address, np.uint64(i // _WORDS))
        out[i], out[i + 1], out[i + 2], out[i + 3] = uniform(a), uniform(b), uniform(c), uniform(d)
    for i in range(whole, len(out)):
        out[i] = uniform(philox(address, np.uint64(i // _WORDS))[i - whole])


@kernel
def _steps(
    length_m: float,
    heading_rad: float,
    length_spread: float,
    heading_spread_rad: float,
    count: int,
    key: NDArray[np.uint64],
    update: int,
) -> tuple[Array, Array]:
    """Length and heading of each particle's step, (count,) (kernel). [m], [rad]."""
    ways_m, headings_rad = np.empty(count), np.empty(count)
    _fill_uniforms(key, update, _LENGTH, ways_m)
    _fill_uniforms(key, update, _HEADING, headings_rad)
    for i in range(count):
        ways_m[i] = max(length_m * (1.0 + length_spread * normal_quantile(ways_m[i])), 0.0)
        headings_rad[i] = heading_rad + heading_spread_rad * normal_quantile(headings_rad[i])
    return ways_m, headings_rad


@kernel
def _fill_wander(uniforms: Array, wander: float, duration_s: float, velocity_m_s: Array) -> None:
    """Fill velocities that lead ``N(0, wander^2 t)`` away in a time t (kernel). [m/s]."""
    for i in range(len(uniforms)):
        if duration_s > 0.0:
            velocity_m_s[i] = wander * normal_quantile(uniforms[i]) / np.sqrt(duration_s)


@kernel
def _perturb(
    key: NDArray[np.uint64], update: int, spread_m_s: float, limit_m_s: float, velocity_m_s: Array
) -> None:
    """Change velocities by U(-spread, spread) within the limit (kernel).

    Drawing is a good part of an update, and 65536 values are fine enough for a velocity: a word
    gives four of them.
    """
    address = np.array([key[0], key[1], np.uint64(update), np.uint64(_VELOCITY)])
    words = np.empty(_WORDS, np.uint64)
    for first in range(0, len(velocity_m_s), 4 * _WORDS):
        words[0], words[1], words[2], words[3] = philox(address, np.uint64(first // (4 * _WORDS)))
        for i in range(min(4 * _WORDS, len(velocity_m_s) - first)):
            part = (words[i // 4] >> np.uint64(16 * (i % 4))) & np.uint64(0xFFFF)
            share = (float(part) + 0.5) * 2.0**-16
            changed_m_s = velocity_m_s[first + i] + spread_m_s * (2.0 * share - 1.0)
            velocity_m_s[first + i] = min(max(changed_m_s, -limit_m_s), limit_m_s)


@kernel
def _weigh(
    rssi_dbm: float,
    x_m: Array,
    y_m: Array,
    edge: Rows,
    edge_branch: Rows,
    beacon_m: Array,
    branch: int,
    level_dbm: float,
    phone_height_m: float,
    exponents: Array,
    spreads_db: Array,
    log_weights: Array,
) -> None:
    """Add the log-likelihood of a reading, Eq 8 with Eq 1 and the range in space (kernel).

    Both kinds of links are looked up in pairs: particles change from one to the other too often
    for a branch.
    """
    up_m2 = (beacon_m[2] - phone_height_m) ** 2
    # (RSSI - s_0 + 10 n log10 d) / sigma = above + fall ln(d^2).
    above, fall, width = np.empty(2), np.empty(2), np.empty(2)
    for kind in range(2):
        above[kind] = (rssi_dbm - level_dbm) / spreads_db[kind]
        fall[kind] = 5.0 * exponents[kind] / np.log(10.0) / spreads_db[kind]
        width[kind] = -np.log(spreads_db[kind])
    logs = np.empty(len(x_m))
    for i in range(len(x_m)):
        east_m, north_m = x_m[i] - beacon_m[0], y_m[i] - beacon_m[1]
        logs[i] = max(east_m * east_m + north_m * north_m + up_m2, _NEAREST_M2)
    fill_logarithms(logs, logs)
    for i in range(len(x_m)):
        kind = int(edge_branch[edge[i]] != branch)
        off = above[kind] + fall[kind] * logs[i]
        log_weights[i] += width[kind] - 0.5 * off * off


@kernel
def _too_uneven(weights: Array, resample_below: float) -> bool:
    """Whether the particles are to be resampled (kernel)."""
    if resample_below >= 1.0:
        return True
    return effective_sample_size(weights) < resample_below * len(weights)


@kernel
def _living(scheme: int, weights: Array, uniforms: Array) -> Rows:
    """Particles that live on, (n,) (kernel)."""
    if scheme == 0:
        return multinomial(weights, uniforms, len(weights))
    if scheme == 1:
        return stratified(weights, uniforms, len(weights))
    if scheme == _SYSTEMATIC:
        return systematic(weights, uniforms, len(weights))
    return residual(weights, uniforms, len(weights))


@kernel
def _copy(lives: Rows, edge: Rows, offset_m: Array, velocity_m_s: Array) -> None:
    """Replace the particles by copies of those that live on (kernel)."""
    old_edge, old_offset_m, old_m_s = edge.copy(), offset_m.copy(), velocity_m_s.copy()
    for i in range(len(lives)):
        edge[i] = old_edge[lives[i]]
        offset_m[i] = old_offset_m[lives[i]]
        velocity_m_s[i] = old_m_s[lives[i]]
