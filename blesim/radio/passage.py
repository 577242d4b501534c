"""A phone on its way through the medium: which packets reach it, when, where and how strong."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from blesim.radio.advertising import PACKETS_PER_EVENT
from blesim.radio.carrying import Carried, WaysOfCarrying
from blesim.radio.link import (
    Budget,
    Geometry,
    antenna_gain_db,
    carrier_loss_db,
    geometry_of,
    path_loss_db,
)
from blesim.radio.medium import Medium, Sender
from blesim.radio.packets import Scan, Sent, packets_sent
from blesim.radio.people import SWAY_STEP_US, sway_m
from blesim.radio.phone import Phone
from blesim.radio.places import places
from blesim.rng import Draws
from blesim.tables import Carrying, Trajectory
from blesim.venue.beacons import CHANNELS

# Packets that are worked on at a time: it bounds the memory, and changes no number.
BLOCK_PACKETS = 300_000
# Time that is worked on at once, where few packets are sent: it bounds the places of a crowd.
LONGEST_BLOCK_US = 1_800_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Passage:
    """A phone carried along a trajectory.

    Attributes
    ----------
    medium : Medium
        What it is carried through.
    phone : Phone
        Its profile.
    walker : str
        Who carries it; names the draws.
    trajectory : Trajectory
        Where, on one level.
    keep : bool
        Whether packets that nobody listened to are wanted too.
    carrying : Carrying or None
        From when on it is carried how; in the hand throughout without it.
    """

    medium: Medium
    phone: Phone
    walker: str
    trajectory: Trajectory
    keep: bool
    carrying: Carrying | None = None

    @property
    def level(self) -> int:
        """Level of the walk."""
        return int(self.trajectory.level[0])

    @property
    def span_us(self) -> tuple[int, int]:
        """Start and end of the walk. [us]."""
        return int(self.trajectory.time_us[0]), int(self.trajectory.time_us[-1])

    def scan(self) -> Scan:
        """The phone's scanner; the walk begins anywhere in its cycle."""
        scanner = self.phone.scanner
        draws = Draws(seed=self.medium.seed, purpose="scan start", walker=self.walker)
        cycles = draws.uniforms(np.zeros(1, int))[0, 0]
        start_us = int(self.span_us[0] - cycles * scanner.cycle_us)
        return Scan(start_us, scanner.interval_us, scanner.window_us, scanner.all_channels)

    def sway(self) -> NDArray[np.float64]:
        """How the carrier sways, (n, 2); empty for a phone that nobody holds. [m]."""
        people = self.medium.propagation.people
        if not self.phone.held or people.sway_m == 0:
            return np.empty((0, 2))
        sway = sway_m(people, self.medium.seed, self.walker, *self.span_us)
        carried, steps = self.carried(), np.arange(len(sway))
        sways = carried.sways[carried.ways_at(self.span_us[0] + steps * SWAY_STEP_US)]
        return np.where(sways[:, np.newaxis], sway, 0.0)

    def carried(self) -> Carried:
        """How the phone is carried; on a tripod nothing but its own height counts."""
        if not self.phone.held:
            return WaysOfCarrying().carried(None, self.phone.height_m)
        ways = self.medium.propagation.people.carrying
        carried = ways.carried(self.carrying, self.phone.height_m)
        if self._heads():
            return carried
        return carried._replace(ahead_m=np.zeros_like(carried.ahead_m))

    def _heads(self) -> bool:
        """Whether it is known which way the carrier looks."""
        return not np.any(np.isnan(self.trajectory.heading_rad))

    def blocks(self) -> Iterator[tuple[int, int]]:
        """Stretches of time with few enough packets, in which shelves stay as they are. [us]."""
        hold_us = self.medium.propagation.stock.hold_us
        longest_us = int(BLOCK_PACKETS / max(self.medium.packets_per_us, 1e-6))
        longest_us = min(longest_us, LONGEST_BLOCK_US)
        begin_us, last_us = self.span_us
        while begin_us < last_us:
            end_us = min(begin_us + longest_us, (begin_us // hold_us + 1) * hold_us, last_us)
            yield begin_us, end_us
            begin_us = end_us

    def sent_by(self, sender: Sender, scan: Scan, begin_us: int, end_us: int) -> Sent:
        """Packets of a sender that begin between two times and end before the walk does."""
        duration_us, spacing_us = sender.beacon.packet_duration_us, self.medium.spacing_us(sender)
        end_us = min(end_us, self.span_us[1] - duration_us)
        earliest_us = begin_us - PACKETS_PER_EVENT * spacing_us
        events_us, first = sender.events_between(earliest_us, end_us)
        return packets_sent(
            events_us,
            first,
            spacing_us,
            duration_us,
            (max(begin_us, self.span_us[0]), end_us),
            scan,
            keep_all=self.keep,
        )

    def uniforms(self, sent: list[Sent]) -> NDArray[np.float64]:
        """Four numbers for each packet, (n, 4): fading, noise, random loss, sensitivity edge."""
        parts = [
            Draws(
                seed=self.medium.seed,
                purpose="packet",
                walker=self.walker,
                beacon=sender.clock.name,
            ).uniforms(packets.ordinal)
            for sender, packets in zip(self.medium.senders, sent, strict=True)
        ]
        return np.concatenate(parts)

    def geometry(
        self, time_us: NDArray[np.int64], row: NDArray[np.int64], sway: NDArray[np.float64]
    ) -> Geometry:
        """Links of packets that senders of given rows sent at given times."""
        carried = self.carried()
        floors = self.medium.level - self.level
        beacon_m = self.medium.xyz_m.copy()
        beacon_m[:, 2] += floors * self.medium.propagation.level_height_m
        here = places(self.trajectory, time_us, sway, SWAY_STEP_US)
        way = carried.ways_at(time_us)
        links = geometry_of(beacon_m, row, here, carried, way, np.abs(floors))
        in_the_way = self.phone.held and self._heads()
        return links if in_the_way else links._replace(cos_body=np.full(len(row), np.nan))

    def budget(
        self,
        sent: list[Sent],
        begin_us: int,
        geometry: Geometry,
        row: NDArray[np.int64],
        deviates: NDArray[np.float64],
    ) -> Budget:
        """Everything between the antennas, for packets of a block in the order of `sent`."""
        medium, propagation = self.medium, self.medium.propagation
        time_us, channel = (np.concatenate([each[column] for each in sent]) for column in (0, 1))
        obstacles_db = medium.obstacle_loss_db(
            self.level, begin_us, geometry.beacon_m, geometry.phone_m
        )
        headroom_db = medium.headroom_db[row]
        shadowing_db, fading_db = self._fields(sent, geometry)
        return Budget(
            path_loss_db=path_loss_db(propagation, geometry, obstacles_db, channel, headroom_db),
            obstacle_loss_db=obstacles_db,
            shadowing_db=shadowing_db,
            fading_db=fading_db + propagation.fading.of_packets_db(deviates),
            body_loss_db=carrier_loss_db(propagation, self.carried(), geometry)
            + self._crowd_db(time_us, geometry),
            gains_db=self._gains_db(geometry, row, channel),
        )

    def _gains_db(
        self, geometry: Geometry, row: NDArray[np.int64], channel: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """Channel gains of beacon and phone, antenna of the beacon, offset of the phone. [dB]."""
        medium, receiver = self.medium, self.phone.receiver
        every_db = medium.channel_gain_db + np.array(receiver.channel_gain_db) + receiver.offset_db
        total_db: NDArray[np.float64] = every_db.ravel()[
            row * len(CHANNELS) + (channel - CHANNELS[0])
        ]
        if medium.antenna[:, 2].any():
            total_db += antenna_gain_db(medium.antenna[row], geometry)
        return total_db

    def _crowd_db(self, time_us: NDArray[np.int64], geometry: Geometry) -> NDArray[np.float64]:
        crossing_db = self.medium.propagation.people.crossing_db
        crowd = self.medium.crowds.get(self.level)
        if crossing_db == 0 or crowd is None or set(crowd.trajectories) <= {self.walker}:
            return np.zeros(len(time_us))
        crossings = crowd.crossings(time_us, geometry.phone_m, geometry.beacon_m, self.walker)
        return crossing_db * crossings.astype(np.float64)

    def _fields(
        self, sent: list[Sent], geometry: Geometry
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Shadowing and multipath, two arrays (n,). [dB]."""
        distance_m = geometry.distance_m
        shadowing_db, fading_db = np.zeros(len(distance_m)), np.zeros(len(distance_m))
        x_m, y_m = (np.ascontiguousarray(geometry.phone_m[:, axis]) for axis in (0, 1))
        begin = 0
        for sender, packets in zip(self.medium.senders, sent, strict=True):
            whole = slice(begin, begin + len(packets.time_us))
            sender.shadow.add_to(x_m[whole], y_m[whole], shadowing_db[whole])
            for number, field in enumerate(sender.multipath):
                part = slice(begin + packets.first[number], begin + packets.first[number + 1])
                fading_db[part] = field.at_db(x_m[part], y_m[part], distance_m[part])
            begin = whole.stop
        return shadowing_db, fading_db
