"""The air between beacons and phones: from advertising events to readings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from blesim import columns
from blesim.columns import CHANNEL_NOT_TOLD
from blesim.radio.collisions import collided
from blesim.radio.delivery import deliver
from blesim.radio.life import Spell, simulate_life
from blesim.radio.link import Budget
from blesim.radio.medium import Medium
from blesim.radio.packets import RECEIVED, Scan
from blesim.radio.passage import Passage
from blesim.radio.phone import Phone
from blesim.radio.propagation import Propagation
from blesim.rng import normals_of
from blesim.tables import Carrying, Packets, Readings, Trajectory
from blesim.venue.venue import Venue

_FATE = dict(columns.FATES)


@dataclass(frozen=True, slots=True, kw_only=True)
class Heard:
    """What one phone heard, and what became of every packet if that was asked for."""

    readings: Readings
    packets: Packets


@dataclass(frozen=True, slots=True, kw_only=True)
class Air:
    """The air of a venue: build it with `over`, then ask for one phone after the other.

    What one phone hears depends neither on the other phones nor on the order of asking.
    """

    medium: Medium

    @classmethod
    def over(
        cls,
        venue: Venue,
        propagation: Propagation,
        seed: int,
        until_us: int,
        *,
        spells: Sequence[Spell] | None = None,
        crowd: Mapping[str, Trajectory] = MappingProxyType({}),
    ) -> Self:
        """The air of a venue until a time.

        Parameters
        ----------
        venue : Venue
            As built.
        propagation : Propagation
            How signals travel there.
        seed : int
            Of the simulation.
        until_us : int
            End of the simulation. [us]
        spells : sequence of Spell, optional
            Lives of the beacons from `simulate_life`; without them nothing happens to a beacon.
        crowd : mapping of str to Trajectory
            Everybody who is there, by name.
        """
        if spells is None:
            spells = simulate_life(venue.beacons, (), until_us).spells
        return cls(medium=Medium.over(venue, propagation, seed, until_us, spells, crowd))

    def heard_by(
        self,
        phone: Phone,
        walker: str,
        trajectory: Trajectory,
        *,
        keep_packets: bool,
        carrying: Carrying | None = None,
    ) -> Heard:
        """What a phone hears along a trajectory, which stays on one level.

        A body is in the way only of a phone that is held, by a carrier whose heading is known.

        Parameters
        ----------
        phone : Phone
            Its profile.
        walker : str
            Who carries it; names the draws.
        trajectory : Trajectory
            Where it is carried.
        keep_packets : bool
            Whether to tell the fate and the components of every packet as well.
        carrying : Carrying, optional
            From when on the phone is carried how; without it, or for a phone that is not held, as
            its profile says.

        Returns
        -------
        Heard
        """
        passage = Passage(
            medium=self.medium,
            phone=phone,
            walker=walker,
            trajectory=trajectory,
            keep=keep_packets,
            carrying=carrying,
        )
        scan, sway = passage.scan(), passage.sway()
        readings, packets = [], []
        for begin_us, end_us in passage.blocks():
            block = _Block.of(passage, scan, sway, begin_us, end_us)
            if block is not None:
                readings.append(block.readings())
                packets += [block.packets()] if keep_packets else []
        announced_dbm = np.array([b.measured_power_dbm for b in self.medium.venue.beacons])
        got = Readings.concatenate(readings)
        return Heard(
            readings=deliver(got, phone.delivery, announced_dbm, *passage.span_us),
            packets=Packets.concatenate(packets),
        )


class _Block(NamedTuple):
    """Packets of one stretch of time at a phone, arrays (n,), beacon after beacon.

    ``order`` puts those that belong to the stretch in order of time.
    """

    passage: Passage
    time_us: NDArray[np.int64]
    row: NDArray[np.int64]
    channel: NDArray[np.int64]
    fate: NDArray[np.int64]
    distance_m: NDArray[np.float64]
    power_dbm: NDArray[np.float64]
    rssi_dbm: NDArray[np.float64]
    budget: Budget
    order: NDArray[np.intp]

    @classmethod
    def of(
        cls, passage: Passage, scan: Scan, sway: NDArray[np.float64], begin_us: int, end_us: int
    ) -> "_Block | None":
        """What reaches the phone between two times and what becomes of it; nothing is None."""
        medium = passage.medium
        # A packet just before or after can still collide with the first or last.
        margin_us = int(medium.duration_us.max(initial=0))
        around_us = (begin_us - margin_us, end_us + margin_us)
        sent = [passage.sent_by(sender, scan, *around_us) for sender in medium.senders]
        row = np.repeat(np.arange(len(sent)), [len(each.time_us) for each in sent])
        if not len(row):
            return None
        time_us, channel, listened = (
            np.concatenate([each[column] for each in sent]) for column in (0, 1, 3)
        )
        uniforms = passage.uniforms(sent)
        deviates = normals_of(uniforms[:, :2])
        geometry = passage.geometry(time_us, row, sway)
        budget = passage.budget(sent, begin_us, geometry, row, deviates[:, 0])
        power_dbm = budget.power_dbm(medium.power_dbm[row])
        order = np.argsort(time_us, kind="stable")
        block = cls(
            passage=passage,
            time_us=time_us,
            row=row,
            channel=channel,
            fate=listened,
            distance_m=geometry.distance_m,
            power_dbm=power_dbm,
            rssi_dbm=passage.phone.receiver.rssi_dbm(power_dbm, deviates[:, 1]),
            budget=budget,
            order=order,
        )
        inside = (time_us[order] >= begin_us) & (time_us[order] < end_us)
        return block._replace(fate=block.fates(uniforms[:, 2:]), order=order[inside])

    def fates(self, uniforms: NDArray[np.float64]) -> NDArray[np.int64]:
        """What becomes of the packets: the first of the reasons to lose one counts."""
        receiver, propagation = self.passage.phone.receiver, self.passage.medium.propagation
        kept = (1.0 - receiver.random_loss) * (1.0 - propagation.traffic_loss)
        weak = uniforms[:, 1] >= receiver.reception(self.power_dbm)
        fate = np.where(weak, _FATE["below_sensitivity"], RECEIVED)
        fate = np.where(uniforms[:, 0] >= kept, _FATE["random_loss"], fate)
        fate = np.where(self.collisions(), _FATE["collision"], fate)
        return np.where(self.fate == RECEIVED, fate, self.fate)

    def collisions(self) -> NDArray[np.bool_]:
        """Which of the packets listened to another beacon's packet destroys."""
        propagation = self.passage.medium.propagation
        lost = np.zeros(len(self.time_us), bool)
        if propagation.collisions.model == "capture":
            listened = self.order[self.fate[self.order] == RECEIVED]
            lost[listened] = collided(
                self.time_us[listened],
                self.passage.medium.duration_us[self.row[listened]],
                self.channel[listened],
                self.power_dbm[listened],
                propagation.collisions.capture_db,
            )
        return lost

    def readings(self) -> Readings:
        """What the application gets: received packets, at the end of each."""
        got = self.order[self.fate[self.order] == RECEIVED]
        told = self.passage.phone.tells_channel
        medium, sender = self.passage.medium, self.row[got]
        return Readings(
            time_us=self.time_us[got] + medium.duration_us[sender],
            beacon=medium.beacon[sender],
            rssi_dbm=self.rssi_dbm[got].astype(np.int64),
            channel=self.channel[got] if told else np.full(len(got), CHANNEL_NOT_TOLD),
        )

    def packets(self) -> Packets:
        """What became of every packet."""
        budget = self.budget
        return Packets(
            time_us=self.time_us[self.order],
            beacon=self.passage.medium.beacon[self.row[self.order]],
            channel=self.channel[self.order],
            fate=self.fate[self.order],
            distance_m=self.distance_m[self.order],
            path_loss_db=budget.path_loss_db[self.order],
            obstacle_loss_db=budget.obstacle_loss_db[self.order],
            shadowing_db=budget.shadowing_db[self.order],
            fading_db=budget.fading_db[self.order],
            body_loss_db=budget.body_loss_db[self.order],
            power_dbm=self.power_dbm[self.order],
        )
