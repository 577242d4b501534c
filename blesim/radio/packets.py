"""Which packets a scanner listens to, and where the phone is when they come."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blesim import columns
from blesim.kernels import kernel
from blesim.radio.advertising import PACKETS_PER_EVENT
from blesim.radio.waves import cosine
from blesim.tables import FloatArray, IntArray, Trajectory
from blesim.venue.beacons import CHANNELS

_FATE = dict(columns.FATES)
RECEIVED = _FATE["received"]
OUT_OF_WINDOW = _FATE["out_of_window"]
OTHER_CHANNEL = _FATE["other_channel"]
WALKING = dict(columns.STATES)["walking"]


class Scan(NamedTuple):
    """A scanner at work: when its first interval began, and its times. [us]."""

    start_us: int
    interval_us: int
    window_us: int
    all_channels: bool


class Sent(NamedTuple):
    """Packets of one beacon, channel after channel, arrays (n,).

    ``first`` (4,) tells where each channel's packets begin and the last ones end. ``fate`` is that
    of a packet that meets no other harm than not being listened to.
    """

    time_us: NDArray[np.int64]
    channel: NDArray[np.int64]
    ordinal: NDArray[np.int64]
    fate: NDArray[np.int64]
    first: NDArray[np.int64]


def packets_sent(
    events_us: NDArray[np.int64],
    first_event: int,
    spacing_us: int,
    duration_us: int,
    between_us: tuple[int, int],
    scan: Scan,
    *,
    keep_all: bool,
) -> Sent:
    """Packets of one beacon that begin and end between two times.

    Parameters
    ----------
    events_us : ndarray of int64, (n,)
        Starts of advertising events, ascending. [us]
    first_event : int
        Ordinal of the first of them.
    spacing_us, duration_us : int
        From packet to packet of an event; on air. [us]
    between_us : tuple of int
        Start of the first, start after the last packet. [us]
    scan : Scan
        The phone's scanner.
    keep_all : bool
        Whether packets that nobody listened to are wanted too.

    Returns
    -------
    Sent
    """
    size = len(events_us) * PACKETS_PER_EVENT
    time, channel, ordinal, fate = (np.empty(size, np.int64) for _ in range(4))
    first = np.zeros(PACKETS_PER_EVENT + 1, np.int64)
    _fill_sent(
        events_us,
        first_event,
        spacing_us,
        duration_us,
        between_us[0],
        between_us[1],
        scan.start_us,
        scan.interval_us,
        scan.window_us,
        scan.all_channels,
        keep_all,
        time,
        channel,
        ordinal,
        fate,
        first,
    )
    size = first[-1]
    return Sent(time[:size], channel[:size], ordinal[:size], fate[:size], first)


@kernel
def _fill_sent(
    events_us: NDArray[np.int64],
    first_event: int,
    spacing_us: int,
    duration_us: int,
    begin_us: int,
    end_us: int,
    start_us: int,
    interval_us: int,
    window_us: int,
    all_channels: bool,
    keep_all: bool,
    time: NDArray[np.int64],
    channel: NDArray[np.int64],
    ordinal: NDArray[np.int64],
    fate: NDArray[np.int64],
    first: NDArray[np.int64],
) -> None:
    count = 0
    for number in range(len(CHANNELS)):
        for event in range(len(events_us)):
            time_us = events_us[event] + number * spacing_us
            if time_us < begin_us or time_us >= end_us:
                continue
            turn = (time_us - start_us) // interval_us
            within_us = time_us - start_us - turn * interval_us
            found = RECEIVED
            if within_us + duration_us > window_us:
                found = OUT_OF_WINDOW
            elif not all_channels and turn % len(CHANNELS) != number:
                found = OTHER_CHANNEL
            if found != RECEIVED and not keep_all:
                continue
            time[count], channel[count], fate[count] = time_us, CHANNELS[number], found
            ordinal[count] = (first_event + event) * len(CHANNELS) + number
            count += 1
        first[number + 1] = count


class Places(NamedTuple):
    """Where a phone is and which way its carrier looks, arrays (n,). [m], [m], [-], [-], [m]."""

    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]
    cos_heading: NDArray[np.float64]
    sin_heading: NDArray[np.float64]


def places(
    trajectory: Trajectory,
    time_us: NDArray[np.int64],
    sway_m: NDArray[np.float64],
    sway_step_us: int,
) -> Places:
    """Places of a phone at the times of packets; `Trajectory.at` in one pass, with sway.

    Parameters
    ----------
    trajectory : Trajectory
        The walk.
    time_us : ndarray of int64, (n,)
        Within the walk; ascending stretch by stretch, as the channels' packets are. [us]
    sway_m : ndarray of float64, (k, 2)
        Sway at steps of `sway_step_us` from the start of the walk, added wherever the carrier does
        not walk; empty for none. [m]
    sway_step_us : int
        [us]

    Returns
    -------
    Places
        The heading of a carrier who has none (NaN) counts as 0; see `Air`.
    """
    x, y, cos_heading, sin_heading = (np.empty(len(time_us)) for _ in range(4))
    turns = np.nan_to_num(trajectory.heading_rad / (2.0 * np.pi))
    _fill_places(
        time_us,
        trajectory.time_us,
        trajectory.x_m,
        trajectory.y_m,
        turns,
        trajectory.state,
        sway_m,
        sway_step_us,
        x,
        y,
        cos_heading,
        sin_heading,
    )
    return Places(x, y, cos_heading, sin_heading)


@kernel
def _fill_places(
    time_us: NDArray[np.int64],
    knot_us: IntArray,
    knot_x: FloatArray,
    knot_y: FloatArray,
    knot_turns: FloatArray,
    state: IntArray,
    sway: NDArray[np.float64],
    sway_step_us: int,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    cos_heading: NDArray[np.float64],
    sin_heading: NDArray[np.float64],
) -> None:
    knot = 0
    for row in range(len(time_us)):
        now = time_us[row]
        if row == 0 or now < knot_us[knot]:
            knot = max(np.searchsorted(knot_us, now, side="right") - 1, 0)
        while knot < len(knot_us) - 2 and knot_us[knot + 1] <= now:
            knot += 1
        following = min(knot + 1, len(knot_us) - 1)
        span = max(knot_us[following] - knot_us[knot], 1)
        share = (now - knot_us[knot]) / span
        x[row] = knot_x[knot] + share * (knot_x[following] - knot_x[knot])
        y[row] = knot_y[knot] + share * (knot_y[following] - knot_y[knot])
        turn = knot_turns[following] - knot_turns[knot]
        turns = knot_turns[knot] + share * (turn - np.floor(turn + 0.5))
        cos_heading[row], sin_heading[row] = cosine(turns), cosine(turns - 0.25)
        if state[knot] != WALKING and len(sway) > 1:
            place = (now - knot_us[0]) / sway_step_us
            step = min(int(place), len(sway) - 2)
            x[row] += sway[step, 0] + (place - step) * (sway[step + 1, 0] - sway[step, 0])
            y[row] += sway[step, 1] + (place - step) * (sway[step + 1, 1] - sway[step, 1])
