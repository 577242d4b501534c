"""When a beacon sends: advertising events on its own clock, three packets in each."""

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim.radio.life import Spell
from blesim.rng import Draws
from blesim.settings import Settings
from blesim.units import MICROSECONDS_PER_SECOND

LONGEST_DELAY_US = 10_000
PACKETS_PER_EVENT = 3


class Advertising(Settings):
    """What all beacons of a venue have in common.

    Attributes
    ----------
    clock_drift_ppm : float
        Largest departure of a beacon's clock from its setting, uniform either way; 50 ppm is the
        limit for an active clock in the Bluetooth Core specification. [ppm]
    packet_spacing_us : int
        From the start of one packet of an event to the next, for beacons that do not say; 400 to
        5000 by chip. [us]
    """

    clock_drift_ppm: float = Field(default=50.0, ge=0, le=500)
    packet_spacing_us: int = Field(default=1000, ge=400, le=5000)


def clock_name(beacon: str, boot: int) -> str:
    """What the clock of a beacon is called in the address of its draws; each boot is another."""
    # No name holds a control character, so none can be another beacon's later boot.
    return beacon if boot == 0 else f"{beacon}\x1f{boot}"


def event_times_us(
    spell: Spell, beacon: str, advertising: Advertising, seed: int, until_us: int
) -> NDArray[np.int64]:
    """Starts of a beacon's advertising events from when its clock was started.

    ``t_k = phase + k T (1 + drift) + sum of delays``, the delay before each event uniform from 0 to
    10 ms, the phase uniform over the interval T (Bluetooth Core, Vol 6 Part B 4.4.2.2).

    Parameters
    ----------
    spell : Spell
        The first spell of the clock: its start, interval and boot count.
    beacon : str
        Id of the beacon; with the boot it names the draws.
    advertising : Advertising
        Bound of the clock drift.
    seed : int
        Of the simulation.
    until_us : int
        End of the simulation. [us]

    Returns
    -------
    ndarray of int64, (n,)
        Ascending, just before `until_us` at the latest. [us]
    """
    interval_us = spell.interval_s * MICROSECONDS_PER_SECOND
    starts = Draws(seed=seed, purpose="advertising start", beacon=beacon)
    start = starts.uniforms(np.array([spell.boot]))
    drift = advertising.clock_drift_ppm * 1e-6 * (2.0 * start[0, 1] - 1.0)
    span_us = max(until_us - spell.start_us, 0)
    ordinals = np.arange(int(span_us / (interval_us * (1.0 + drift))) + 1)
    name = clock_name(beacon, spell.boot)
    delays = Draws(seed=seed, purpose="advertising delay", beacon=name).uniforms(ordinals)
    delay_us = np.floor(delays[:, 0] * (LONGEST_DELAY_US + 1)).astype(np.int64)
    regular_us = np.rint((start[0, 0] + ordinals * (1.0 + drift)) * interval_us).astype(np.int64)
    times_us: NDArray[np.int64] = spell.start_us + regular_us + np.cumsum(delay_us)
    return times_us[times_us < until_us]
