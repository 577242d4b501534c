"""Which packets a scanner listens to."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blesim import columns
from blesim.kernels import kernel
from blesim.radio.advertising import PACKETS_PER_EVENT
from blesim.venue.beacons import CHANNELS

_FATE = dict(columns.FATES)
RECEIVED = _FATE["received"]
OUT_OF_WINDOW = _FATE["out_of_window"]
OTHER_CHANNEL = _FATE["other_channel"]


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
        opens_us, turn = start_us, 0
        for event in range(len(events_us)):
            time_us = events_us[event] + number * spacing_us
            if time_us < begin_us or time_us >= end_us:
                continue
            within_us = time_us - opens_us
            # Most packets come in the same interval as the one before: divisions are slow.
            if within_us < 0 or within_us >= interval_us:
                turns = within_us // interval_us
                turn = (turn + turns) % len(CHANNELS)
                opens_us += turns * interval_us
                within_us -= turns * interval_us
            found = RECEIVED
            if within_us + duration_us > window_us:
                found = OUT_OF_WINDOW
            elif not all_channels and turn != number:
                found = OTHER_CHANNEL
            if found != RECEIVED and not keep_all:
                continue
            time[count], channel[count], fate[count] = time_us, CHANNELS[number], found
            ordinal[count] = (first_event + event) * len(CHANNELS) + number
            count += 1
        first[number + 1] = count
