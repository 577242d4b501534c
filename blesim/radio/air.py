"""The air between beacons and phones: from advertising events to readings."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim import columns
from blesim.columns import CHANNEL_NOT_TOLD
from blesim.errors import UsageError
from blesim.radio.advertising import PACKETS_PER_EVENT, Advertising, event_times_us
from blesim.radio.fading import Fading
from blesim.radio.path_loss import log_distance_loss_db
from blesim.radio.phone import Phone
from blesim.radio.shadowing import ShadowField, Shadowing
from blesim.rng import Draws, normals_of
from blesim.settings import Settings
from blesim.tables import Packets, Readings, Trajectory
from blesim.venue.beacons import CHANNELS
from blesim.venue.line_of_sight import LineOfSight
from blesim.venue.venue import Venue

_FATE = dict(columns.FATES)


class Propagation(Settings):
    """How signals travel in a venue; obstacles come from its floor plan.

    Attributes
    ----------
    path_loss_exponent : float
        On the line of sight. [-]
    advertising, shadowing, fading : Advertising, Shadowing, Fading
        See there.
    """

    path_loss_exponent: float = Field(default=2.0, gt=0, le=8)
    advertising: Advertising = Advertising()
    shadowing: Shadowing = Shadowing()
    fading: Fading = Fading()


@dataclass(frozen=True, slots=True, kw_only=True)
class Heard:
    """What one phone heard, and what became of every packet if that was asked for."""

    readings: Readings
    packets: Packets


@dataclass(frozen=True, slots=True, kw_only=True)
class Air:
    """All that phones have in common: when beacons send, what stands between, how signals fade.

    Build it with `over`, then ask `heard_by` for one phone after the other, in any order.
    """

    venue: Venue
    propagation: Propagation
    seed: int
    events_us: tuple[NDArray[np.int64], ...]
    fields: tuple[ShadowField, ...]
    lines: Mapping[int, LineOfSight]

    @classmethod
    def over(cls, venue: Venue, propagation: Propagation, seed: int, until_us: int) -> Self:
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
        """
        advertising, shadowing = propagation.advertising, propagation.shadowing
        beacons, obstacles = venue.beacons, venue.floor_plan.obstacles
        by_level = {
            level.level: LineOfSight.through([o for o in obstacles if o.level == level.level])
            for level in venue.floor_plan.levels
        }
        return cls(
            venue=venue,
            propagation=propagation,
            seed=seed,
            events_us=tuple(event_times_us(b, advertising, seed, until_us) for b in beacons),
            fields=tuple(ShadowField.draw(shadowing, seed, b.id) for b in beacons),
            lines=MappingProxyType(by_level),
        )

    def heard_by(
        self, phone: Phone, walker: str, trajectory: Trajectory, *, keep_packets: bool
    ) -> Heard:
        """What a phone hears along a trajectory.

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

        Returns
        -------
        Heard

        Raises
        ------
        UsageError
            If a beacon is on another level than the walk: one level is simulated at a time.
        """
        if not self.venue.beacons:
            return Heard(readings=Readings.empty(), packets=Packets.empty())
        self._refuse_other_levels(trajectory)
        start = Draws(seed=self.seed, purpose="scan start", walker=walker).uniforms(
            np.zeros(1, int)
        )
        scan_start_us = int(trajectory.time_us[0] - start[0, 0] * phone.scanner.cycle_us)
        sent = [
            self._sent(row, phone, trajectory, scan_start_us) for row in range(len(self.fields))
        ]
        if not keep_packets:
            sent = [packets.chosen(packets.fate == _FATE["received"]) for packets in sent]
        links = [
            self._link(row, packets, phone, walker, trajectory) for row, packets in enumerate(sent)
        ]
        together = _Link(*(np.concatenate(column) for column in zip(*links, strict=True)))
        together = together.chosen(np.lexsort((together.beacon, together.time_us)))
        duration_us = self.propagation.advertising.packet_duration_us
        return Heard(
            readings=_readings(together, phone, duration_us),
            packets=_packets(together) if keep_packets else Packets.empty(),
        )

    def _refuse_other_levels(self, trajectory: Trajectory) -> None:
        levels = {
            *np.unique(trajectory.level).tolist(),
            *np.unique(self.venue.beacon_level).tolist(),
        }
        if len(levels) > 1:
            raise UsageError(
                f"venue '{self.venue.name}': walk and beacons are on levels {sorted(levels)};"
                " one level is simulated at a time, leave out the others"
            )

    def _sent(self, row: int, phone: Phone, trajectory: Trajectory, scan_start_us: int) -> "_Sent":
        """Packets of one beacon while the phone is there, and whether the phone listened."""
        advertising = self.propagation.advertising
        duration_us, spacing_us = advertising.packet_duration_us, advertising.packet_spacing_us
        last_us = trajectory.time_us[-1] - duration_us - (PACKETS_PER_EVENT - 1) * spacing_us
        first, beyond = np.searchsorted(self.events_us[row], [trajectory.time_us[0], last_us])
        number = np.arange(PACKETS_PER_EVENT)
        time_us = (self.events_us[row][first:beyond, None] + number * spacing_us).reshape(-1)
        channel = np.tile(np.array(CHANNELS), beyond - first)
        in_window, scanned = phone.scanner.listens(time_us - scan_start_us, duration_us)
        fate = np.where(scanned == channel, _FATE["received"], _FATE["other_channel"])
        return _Sent(
            time_us=time_us,
            channel=channel,
            ordinal=np.arange(first * PACKETS_PER_EVENT, beyond * PACKETS_PER_EVENT),
            fate=np.where(in_window, fate, _FATE["out_of_window"]),
        )

    def _link(
        self, row: int, sent: "_Sent", phone: Phone, walker: str, trajectory: Trajectory
    ) -> "_Link":
        """Level of each packet at the phone, component by component, and what became of it."""
        beacon, propagation, receiver = self.venue.beacons[row], self.propagation, phone.receiver
        draws = Draws(seed=self.seed, purpose="packet", walker=walker, beacon=beacon.id)
        uniforms = draws.uniforms(sent.ordinal)
        deviates = normals_of(uniforms[:, :2])
        poses = trajectory.at(sent.time_us)
        here = np.stack([poses.x_m, poses.y_m, np.full(len(poses.x_m), phone.height_m)], axis=1)
        there = np.broadcast_to(self.venue.beacon_xyz_m[row], here.shape)
        distance_m = np.sqrt(np.sum((here - there) ** 2, axis=1))
        path_loss_db = log_distance_loss_db(distance_m, propagation.path_loss_exponent)
        obstacle_loss_db = self.lines[beacon.level].loss_db(there, here)
        shadowing_db = self.fields[row].at_db(poses.x_m, poses.y_m)
        fading_db = propagation.fading.of_db(deviates[:, 0])
        gains_db = np.add(beacon.channel_gain_db, receiver.channel_gain_db) + receiver.offset_db
        power_dbm = (
            beacon.measured_power_dbm
            + gains_db[sent.channel - CHANNELS[0]]
            - path_loss_db
            - obstacle_loss_db
            + shadowing_db
            + fading_db
        )
        return _Link(
            time_us=sent.time_us,
            beacon=np.full(len(sent.time_us), row),
            channel=sent.channel,
            fate=_fate(sent.fate, power_dbm, phone, uniforms[:, 2:]),
            distance_m=distance_m,
            path_loss_db=path_loss_db,
            obstacle_loss_db=obstacle_loss_db,
            shadowing_db=shadowing_db,
            fading_db=fading_db,
            power_dbm=power_dbm,
            rssi_dbm=receiver.rssi_dbm(power_dbm, deviates[:, 1]),
        )


class _Sent(NamedTuple):
    """Packets of one beacon, arrays (n,): when, where, the how-manieth, whether listened to."""

    time_us: NDArray[np.int64]
    channel: NDArray[np.int64]
    ordinal: NDArray[np.int64]
    fate: NDArray[np.int64]

    def chosen(self, rows: NDArray[np.bool_]) -> "_Sent":
        return _Sent(*(column[rows] for column in self))


class _Link(NamedTuple):
    """Packets at the phone, arrays (n,); see `columns.PACKETS`."""

    time_us: NDArray[Any]
    beacon: NDArray[Any]
    channel: NDArray[Any]
    fate: NDArray[Any]
    distance_m: NDArray[Any]
    path_loss_db: NDArray[Any]
    obstacle_loss_db: NDArray[Any]
    shadowing_db: NDArray[Any]
    fading_db: NDArray[Any]
    power_dbm: NDArray[Any]
    rssi_dbm: NDArray[Any]

    def chosen(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> "_Link":
        return _Link(*(column[rows] for column in self))


def _fate(
    listened: NDArray[np.int64],
    power_dbm: NDArray[np.float64],
    phone: Phone,
    uniforms: NDArray[np.float64],
) -> NDArray[np.int64]:
    """Fates of packets, (n,): the first reason in the order of the arguments counts."""
    receiver = phone.receiver
    lost = uniforms[:, 0] < receiver.random_loss
    weak = uniforms[:, 1] >= receiver.reception(power_dbm)
    heard = np.where(weak, _FATE["below_sensitivity"], _FATE["received"])
    heard = np.where(lost, _FATE["random_loss"], heard)
    return np.where(listened == _FATE["received"], heard, listened)


def _readings(link: _Link, phone: Phone, duration_us: int) -> Readings:
    """What the application gets: received packets, at the end of each."""
    got = link.chosen(link.fate == _FATE["received"])
    told = got.channel if phone.tells_channel else np.full(len(got.channel), CHANNEL_NOT_TOLD)
    return Readings(
        time_us=got.time_us + duration_us, beacon=got.beacon, rssi_dbm=got.rssi_dbm, channel=told
    )


def _packets(link: _Link) -> Packets:
    return Packets(
        time_us=link.time_us,
        beacon=link.beacon,
        channel=link.channel,
        fate=link.fate,
        distance_m=link.distance_m,
        path_loss_db=link.path_loss_db,
        obstacle_loss_db=link.obstacle_loss_db,
        shadowing_db=link.shadowing_db,
        fading_db=link.fading_db,
        body_loss_db=np.zeros(len(link.time_us)),
        power_dbm=link.power_dbm,
    )
