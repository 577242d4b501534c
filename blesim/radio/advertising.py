"""When a beacon sends: advertising events on its own clock, three packets in each."""

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim.kernels import kernel
from blesim.radio.life import Spell
from blesim.rng import Draws, philox, uniform
from blesim.settings import Settings
from blesim.units import MICROSECONDS_PER_SECOND

LONGEST_DELAY_US = 10_000
PACKETS_PER_EVENT = 3
# Events from one remembered event to the next: what lies between is drawn again when asked for.
STRETCH = 128


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


class _Beat(NamedTuple):
    """Start of a clock, its phase in intervals, 1 + drift, its interval. [us], [-], [-], [us]."""

    start_us: int
    phase: float
    rate: float
    interval_us: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Clock:
    """Advertising events of a beacon from one boot to the next, worked out when asked for.

    ``t_k = phase + k T (1 + drift) + sum of delays``, the delay before each event uniform from 0 to
    10 ms, the phase uniform over the interval T (Bluetooth Core, Vol 6 Part B 4.4.2.2). Only every
    128th time is kept, so that a week of a store's beacons takes little memory.

    Attributes
    ----------
    name : str
        Of the draws of the clock and of its packets.
    beat : _Beat
        What is regular about it.
    address : ndarray of uint64, (4,)
        Of the draws of its delays; see `Draws.address`.
    kept_us : ndarray of int64, (n,)
        Times of events 0, 128, 256 and so on. [us]
    """

    name: str
    beat: _Beat
    address: NDArray[np.uint64]
    kept_us: NDArray[np.int64]

    @classmethod
    def of(
        cls, spell: Spell, beacon: str, advertising: Advertising, seed: int, until_us: int
    ) -> Self:
        """The clock that starts with a spell.

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
            Up to when it may be asked. [us]
        """
        name = clock_name(beacon, spell.boot)
        starts = Draws(seed=seed, purpose="advertising start", beacon=beacon)
        start = starts.uniforms(np.array([spell.boot]))[0]
        drift = advertising.clock_drift_ppm * 1e-6 * (2.0 * float(start[1]) - 1.0)
        interval_us = spell.interval_s * MICROSECONDS_PER_SECOND
        beat = _Beat(spell.start_us, float(start[0]), 1.0 + drift, interval_us)
        address = Draws(seed=seed, purpose="advertising delay", beacon=name).address()
        span_us = max(until_us - spell.start_us, 0)
        stretches = int(span_us / (interval_us * beat.rate)) // STRETCH + 1
        kept_us = _kept(address, *beat, stretches)
        return cls(name=name, beat=beat, address=address, kept_us=kept_us)

    def events_between(self, begin_us: int, end_us: int) -> tuple[NDArray[np.int64], int]:
        """Starts of advertising events in a stretch of time.

        Parameters
        ----------
        begin_us, end_us : int
            From the first until just before the second. [us]

        Returns
        -------
        ndarray of int64, (n,)
            Ascending. [us]
        int
            How many events the clock gave before them.
        """
        times_us, first = _events(self.address, *self.beat, self.kept_us, begin_us, end_us)
        return times_us, int(first)


@kernel
def _delay_us(address: NDArray[np.uint64], event: int) -> int:
    """Delay before an event (kernel). [us]."""
    words = philox(address, np.uint64(event))
    return int(np.floor(uniform(words[0]) * (LONGEST_DELAY_US + 1)))


@kernel
def _regular_us(start_us: int, phase: float, rate: float, interval_us: float, event: int) -> int:
    """Time of an event without delays (kernel). [us]."""
    return start_us + int(np.rint((phase + event * rate) * interval_us))


@kernel
def _kept(
    address: NDArray[np.uint64],
    start_us: int,
    phase: float,
    rate: float,
    interval_us: float,
    stretches: int,
) -> NDArray[np.int64]:
    out = np.empty(stretches, np.int64)
    delays_us = 0
    for event in range((stretches - 1) * STRETCH + 1):
        delays_us += _delay_us(address, event)
        if event % STRETCH == 0:
            regular_us = _regular_us(start_us, phase, rate, interval_us, event)
            out[event // STRETCH] = regular_us + delays_us
    return out


@kernel
def _events(
    address: NDArray[np.uint64],
    start_us: int,
    phase: float,
    rate: float,
    interval_us: float,
    kept_us: NDArray[np.int64],
    begin_us: int,
    end_us: int,
) -> tuple[NDArray[np.int64], int]:
    kept = max(int(np.searchsorted(kept_us, begin_us, side="right")) - 1, 0)
    event, time_us = kept * STRETCH, kept_us[kept]
    delays_us = time_us - _regular_us(start_us, phase, rate, interval_us, event)
    while time_us < begin_us:
        event += 1
        delays_us += _delay_us(address, event)
        time_us = _regular_us(start_us, phase, rate, interval_us, event) + delays_us
    first, count = event, 0
    # The shortest gap is an interval of the clock, less the rounding of both its ends.
    out = np.empty(int(max(end_us - begin_us, 0) / (interval_us * rate - 1.0)) + 2, np.int64)
    while time_us < end_us:
        out[count] = time_us
        count += 1
        event += 1
        delays_us += _delay_us(address, event)
        time_us = _regular_us(start_us, phase, rate, interval_us, event) + delays_us
    return out[:count], first
