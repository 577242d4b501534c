"""What all phones of a simulation have in common: senders, obstacles, fields, the crowd."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import Self

import numpy as np
from numpy.typing import NDArray

from blesim.radio.advertising import LONGEST_DELAY_US, PACKETS_PER_EVENT, Clock
from blesim.radio.crowd import Crowd
from blesim.radio.fading import MultipathField
from blesim.radio.life import Spell
from blesim.radio.propagation import Propagation
from blesim.radio.shadowing import ShadowField
from blesim.radio.stock import stock_levels
from blesim.tables import Trajectory
from blesim.units import to_us
from blesim.venue.beacons import CHANNELS, Beacon
from blesim.venue.floor_plan import Obstacle
from blesim.venue.line_of_sight import LineOfSight
from blesim.venue.venue import Venue


@dataclass(frozen=True, slots=True, kw_only=True)
class Sender:
    """A beacon on the air while nothing about it changes: its events, and the fields it makes.

    Attributes
    ----------
    beacon : Beacon
        As built.
    spell : Spell
        Where and how strong it is, and for how long.
    clock : Clock
        When it sends; names the draws of its packets.
    shadow : ShadowField
    multipath : tuple of MultipathField
        One a channel, or none.
    """

    beacon: Beacon
    spell: Spell
    clock: Clock
    shadow: ShadowField
    multipath: tuple[MultipathField, ...]

    def events_between(self, begin_us: int, end_us: int) -> tuple[NDArray[np.int64], int]:
        """Advertising events of the spell in a stretch of time; see `Clock.events_between`."""
        spell = self.spell
        return self.clock.events_between(max(begin_us, spell.start_us), min(end_us, spell.end_us))

    @property
    def events_per_us(self) -> float:
        """How many events it gives on average while the spell lasts. [1/us]."""
        return 1.0 / (to_us(self.spell.interval_s) + LONGEST_DELAY_US / 2)


def senders_of(
    beacons: Sequence[Beacon],
    spells: Sequence[Spell],
    propagation: Propagation,
    seed: int,
    until_us: int,
) -> tuple[Sender, ...]:
    """Senders of all spells, in their order; spells of one boot share a clock."""
    senders: list[Sender] = []
    for (row, _), group in groupby(spells, lambda spell: (spell.beacon, spell.boot)):
        beacon, run = beacons[row], list(group)
        clock = Clock.of(run[0], beacon.id, propagation.advertising, seed, until_us)
        for spell in run:
            place = _place_name(beacon, spell)
            senders.append(
                Sender(
                    beacon=beacon,
                    spell=spell,
                    clock=clock,
                    shadow=ShadowField.draw(propagation.shadowing, seed, place),
                    multipath=_multipath(propagation, seed, place),
                )
            )
    return tuple(senders)


def _place_name(beacon: Beacon, spell: Spell) -> str:
    """What the fields of a beacon are called; where somebody has moved it, they are others."""
    built = (beacon.x_m, beacon.y_m, beacon.z_m, beacon.level)
    here = (spell.x_m, spell.y_m, spell.z_m, spell.level)
    return beacon.id if here == built else f"{beacon.id}\x1f{here}"


def _multipath(propagation: Propagation, seed: int, place: str) -> tuple[MultipathField, ...]:
    fading = propagation.fading
    channels = CHANNELS if fading.model == "rician" else ()
    return tuple(MultipathField.draw(fading, seed, place, channel) for channel in channels)


def _crowds(walkers: Mapping[str, Trajectory]) -> Mapping[int, Crowd]:
    """Who is on each level; a walker stays on one."""
    level = {name: int(trajectory.level[0]) for name, trajectory in walkers.items()}
    return {
        each: Crowd.of({name: walkers[name] for name in walkers if level[name] == each})
        for each in sorted(set(level.values()))
    }


@dataclass(frozen=True, kw_only=True)
class Medium:
    """The venue as signals see it, for one seed.

    Attributes
    ----------
    venue : Venue
        As built.
    propagation : Propagation
        How signals travel there.
    seed : int
        Of the simulation.
    senders : tuple of Sender
        In the order of beacons and time.
    crowds : mapping of int to Crowd
        Everybody who is there, level by level.
    until_us : int
        End of the simulation. [us]
    """

    venue: Venue
    propagation: Propagation
    seed: int
    senders: tuple[Sender, ...]
    crowds: Mapping[int, Crowd]
    until_us: int

    @classmethod
    def over(
        cls,
        venue: Venue,
        propagation: Propagation,
        seed: int,
        until_us: int,
        spells: Sequence[Spell],
        crowd: Mapping[str, Trajectory],
    ) -> Self:
        """The medium of a venue until a time; see `Air.over`."""
        return cls(
            venue=venue,
            propagation=propagation,
            seed=seed,
            senders=senders_of(venue.beacons, spells, propagation, seed, until_us),
            crowds=_crowds(crowd),
            until_us=until_us,
        )

    @cached_property
    def lines(self) -> Mapping[int, LineOfSight]:
        """Obstacles of each level."""
        levels = (level.level for level in self.venue.floor_plan.levels)
        return {level: LineOfSight.through(self._obstacles(level)) for level in levels}

    def _obstacles(self, level: int) -> tuple[Obstacle, ...]:
        return tuple(each for each in self.venue.floor_plan.obstacles if each.level == level)

    @cached_property
    def packets_per_us(self) -> float:
        """How many packets all senders together send, on average. [1/us]."""
        events = sum((s.spell.end_us - s.spell.start_us) * s.events_per_us for s in self.senders)
        return events * PACKETS_PER_EVENT / max(self.until_us, 1)

    @cached_property
    def beacon(self) -> NDArray[np.int64]:
        """Row of each sender's beacon, (number of senders,)."""
        return np.array([sender.spell.beacon for sender in self.senders], np.int64)

    @cached_property
    def xyz_m(self) -> NDArray[np.float64]:
        """Place of each sender, its height above its own floor, (number of senders, 3). [m]."""
        rows = [(s.spell.x_m, s.spell.y_m, s.spell.z_m) for s in self.senders]
        return np.array(rows, np.float64).reshape(-1, 3)

    @cached_property
    def level(self) -> NDArray[np.int64]:
        """Level of each sender, (number of senders,)."""
        return np.array([sender.spell.level for sender in self.senders], np.int64)

    @cached_property
    def power_dbm(self) -> NDArray[np.float64]:
        """Power of each sender at one metre, (number of senders,). [dBm]."""
        return np.array([s.beacon.measured_power_dbm + s.spell.power_db for s in self.senders])

    @cached_property
    def headroom_db(self) -> NDArray[np.float64]:
        """Transmit power less measured power of each sender, (number of senders,). [dB]."""
        pairs = ((s.beacon.tx_power_dbm, s.beacon.measured_power_dbm) for s in self.senders)
        return np.array([sent - measured for sent, measured in pairs])

    @cached_property
    def channel_gain_db(self) -> NDArray[np.float64]:
        """Of each sender on each channel, (number of senders, 3). [dB]."""
        return np.array([s.beacon.channel_gain_db for s in self.senders]).reshape(-1, 3)

    @cached_property
    def antenna(self) -> NDArray[np.float64]:
        """Direction of the boresight and front-to-back ratio, (number of senders, 3). [-], [dB]."""
        facing_rad = np.radians([s.beacon.facing_deg or 0.0 for s in self.senders])
        ratio_db = np.array([s.beacon.front_to_back_db for s in self.senders])
        return np.stack([np.cos(facing_rad), np.sin(facing_rad), ratio_db], axis=1)

    @cached_property
    def duration_us(self) -> NDArray[np.int64]:
        """How long each sender's packets are on air, (number of senders,). [us]."""
        return np.array([s.beacon.packet_duration_us for s in self.senders], np.int64)

    def spacing_us(self, sender: Sender) -> int:
        """From the start of one packet of an event to the next. [us]."""
        return sender.beacon.packet_spacing_us or self.propagation.advertising.packet_spacing_us

    def obstacle_loss_db(
        self,
        level: int,
        time_us: int,
        sender_m: NDArray[np.float64],
        phone_m: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Loss of links through the obstacles of a level, filled as at a time, (n,). [dB]."""
        stock = self.propagation.stock
        spell = max(time_us, 0) // stock.hold_us
        levels = stock_levels(stock, self._obstacles(level), self.seed, spell)
        return self.lines[level].loss_db(sender_m, phone_m, levels, stock.bay_m)
