"""The radio once more, plainly: one SimPy process a beacon and a scanner, one event a packet.

Written apart from `blesim.radio.air`, packet by packet, with the math module and shapely, to hold
the fast engine against and to measure it by. With the same names for the random numbers it gives
the same packets; with other numbers it must agree in every statistic.
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely
import simpy

from blesim.radio.fading import WAVELENGTH_M, MultipathField
from blesim.radio.phone import Phone
from blesim.radio.propagation import Propagation
from blesim.radio.shadowing import ShadowField
from blesim.rng import Draws, normals_of
from blesim.tables import Trajectory
from blesim.venue.beacons import Beacon
from blesim.venue.venue import Venue

CHANNELS = (37, 38, 39)


@dataclass(slots=True)
class Packet:
    beacon: int
    channel: int
    ordinal: int
    sent_us: int
    power_dbm: float = 0.0
    collided: bool = False


@dataclass(slots=True)
class Store:
    """Everything the processes share."""

    env: simpy.Environment
    venue: Venue
    propagation: Propagation
    seed: int
    scanners: list["Scanner"] = field(default_factory=list)
    packets: int = 0


def send(store: Store, row: int, beacon: Beacon, until_us: int) -> Any:
    """The process of a beacon."""
    start = draw(store.seed, "advertising start", "", beacon.id, 0)
    interval_us = beacon.advertising_interval_s * 1e6
    advertising = store.propagation.advertising
    drift = advertising.clock_drift_ppm * 1e-6 * (2 * start[1] - 1)
    event, delays_us = 0, 0
    while True:
        delays_us += math.floor(
            draw(store.seed, "advertising delay", "", beacon.id, event)[0] * 10_001
        )
        time_us = round((start[0] + event * (1 + drift)) * interval_us) + delays_us
        if time_us >= until_us:
            return
        yield store.env.timeout(time_us - store.env.now)
        for number, channel in enumerate(CHANNELS):
            store.packets += 1
            for scanner in store.scanners:
                scanner.on_air(Packet(row, channel, 3 * event + number, store.env.now))
            if number < 2:
                yield store.env.timeout(advertising.packet_spacing_us)
        event += 1


@dataclass(slots=True)
class Scanner:
    """A phone: its scan windows as a process, and what it hears."""

    store: Store
    phone: Phone
    walker: str
    trajectory: Trajectory
    fields: list[tuple[ShadowField, tuple[MultipathField, ...]]]
    channel: int | None = None
    closes_us: int = 0
    in_the_air: list[Packet] = field(default_factory=list)
    heard: list[tuple[int, int, int, int]] = field(default_factory=list)

    def scan(self) -> Any:
        """The process of the scan windows."""
        env, scanner = self.store.env, self.phone.scanner
        begin_us = int(self.trajectory.time_us[0])
        cycles = draw(self.store.seed, "scan start", self.walker, "", 0)[0]
        opens_us = int(begin_us - cycles * 3 * scanner.interval_us)
        number = 0
        while opens_us <= self.trajectory.time_us[-1]:
            if opens_us + scanner.interval_us > begin_us:
                if opens_us > env.now:
                    yield env.timeout(opens_us - env.now)
                self.channel = CHANNELS[number % 3]
                self.closes_us = opens_us + scanner.window_us
            opens_us += scanner.interval_us
            number += 1

    def on_air(self, packet: Packet) -> None:
        """A packet begins; it is judged when it has ended."""
        duration_us = self.store.venue.beacons[packet.beacon].packet_duration_us
        first_us, last_us = self.trajectory.time_us[0], self.trajectory.time_us[-1]
        if not first_us <= packet.sent_us < last_us - duration_us:
            return
        if self.channel != packet.channel or packet.sent_us + duration_us > self.closes_us:
            return
        packet.power_dbm = self.level_dbm(packet)
        if self.store.propagation.collisions.model == "capture":
            capture_db = self.store.propagation.collisions.capture_db
            for other in self.in_the_air:
                if other.channel == packet.channel:
                    other.collided |= other.power_dbm - packet.power_dbm < capture_db
                    packet.collided |= packet.power_dbm - other.power_dbm < capture_db
        self.in_the_air.append(packet)
        self.store.env.process(self.receive(packet, duration_us))

    def receive(self, packet: Packet, duration_us: int) -> Any:
        """The end of a packet."""
        yield self.store.env.timeout(duration_us)
        self.in_the_air.remove(packet)
        receiver = self.phone.receiver
        chance = draw(self.store.seed, "packet", self.walker, self.id_of(packet), packet.ordinal)
        margin = (packet.power_dbm - receiver.sensitivity_dbm) / receiver.edge_db
        kept = (1 - receiver.random_loss) * (1 - self.store.propagation.traffic_loss)
        strong = chance[3] < 1 / (1 + math.exp(-min(max(margin, -60.0), 60.0)))
        if packet.collided or chance[2] >= kept or not strong:
            return
        rssi_dbm = round(packet.power_dbm + receiver.noise_db * normal(chance[1]))
        self.heard.append(
            (
                packet.sent_us + duration_us,
                packet.beacon,
                min(max(rssi_dbm, -127), 20),
                packet.channel,
            )
        )

    def id_of(self, packet: Packet) -> str:
        return self.store.venue.beacons[packet.beacon].id

    def level_dbm(self, packet: Packet) -> float:
        """Power of a packet at the phone."""
        propagation, beacon = self.store.propagation, self.store.venue.beacons[packet.beacon]
        x, y, heading = self.place(packet.sent_us)
        height = self.phone.height_m
        distance = math.sqrt(
            (beacon.x_m - x) ** 2 + (beacon.y_m - y) ** 2 + (beacon.z_m - height) ** 2
        )
        level = beacon.measured_power_dbm + beacon.channel_gain_db[packet.channel - 37]
        level += (
            self.phone.receiver.offset_db + self.phone.receiver.channel_gain_db[packet.channel - 37]
        )
        level -= 10 * propagation.path_loss_exponent * math.log10(max(distance, 0.1))
        line = shapely.LineString([(x, y), (beacon.x_m, beacon.y_m)])
        for obstacle in self.store.venue.floor_plan.obstacles:
            inside = shapely.intersection(line, obstacle.outline).length
            if inside > 1e-6 and not shapely.touches(line, obstacle.outline):
                level -= obstacle.loss.crossing_db + inside * obstacle.loss.metre_db
        level += self.field_db(packet, x, y, distance)
        deviate = normal(draw(self.store.seed, "packet", self.walker, beacon.id, packet.ordinal)[0])
        if propagation.fading.model == "gaussian":
            level += propagation.fading.standard_deviation_db * deviate
        if self.phone.held:
            cosine = (
                (beacon.x_m - x) * math.cos(heading) + (beacon.y_m - y) * math.sin(heading)
            ) / distance
            level -= propagation.people.body_loss_db * (1 - cosine) / 2
        return level

    def field_db(self, packet: Packet, x: float, y: float, distance: float) -> float:
        """Shadowing and multipath at a place, wave by wave."""
        shadow, multipath = self.fields[packet.beacon]
        total_db = sum(
            amplitude * math.cos(2 * math.pi * (kx * x + ky * y + phase))
            for amplitude, waves in shadow.parts
            for kx, ky, phase in waves
        )
        if not multipath:
            return total_db
        field_ = multipath[packet.channel - 37]
        h = field_.steady * complex_turn(-distance / WAVELENGTH_M)
        for kx, ky, phase, amplitude in field_.scattered:
            h += amplitude * complex_turn(kx * x + ky * y + phase)
        return total_db + 20 * math.log10(max(abs(h), 1e-3)) - field_.mean_db

    def place(self, time_us: int) -> tuple[float, float, float]:
        pose = self.trajectory.at(np.array([time_us]))
        return float(pose.x_m[0]), float(pose.y_m[0]), float(pose.heading_rad[0])


def complex_turn(turns: float) -> complex:
    return complex(math.cos(2 * math.pi * turns), math.sin(2 * math.pi * turns))


def draw(seed: int, purpose: str, walker: str, beacon: str, ordinal: int) -> list[float]:
    draws = Draws(seed=seed, purpose=purpose, walker=walker, beacon=beacon)
    return [float(each) for each in draws.uniforms(np.array([ordinal]))[0]]


def normal(uniform: float) -> float:
    return float(normals_of(np.array([uniform]))[0])


def listen(
    venue: Venue,
    propagation: Propagation,
    seed: int,
    phones: dict[str, tuple[Phone, Trajectory]],
) -> tuple[dict[str, list[tuple[int, int, int, int]]], int]:
    """Readings (time, beacon, RSSI, channel) of each walker, and the number of packets sent."""
    store = Store(simpy.Environment(), venue, propagation, seed)
    until_us = 1 + max(int(trajectory.time_us[-1]) for _, trajectory in phones.values())
    fading = propagation.fading
    fields = [
        (
            ShadowField.draw(propagation.shadowing, seed, beacon.id),
            tuple(
                MultipathField.draw(fading, seed, beacon.id, channel)
                for channel in (CHANNELS if fading.model == "rician" else ())
            ),
        )
        for beacon in venue.beacons
    ]
    for walker, (phone, trajectory) in phones.items():
        store.scanners.append(Scanner(store, phone, walker, trajectory, fields))
        store.env.process(store.scanners[-1].scan())
    for row, beacon in enumerate(venue.beacons):
        store.env.process(send(store, row, beacon, until_us))
    store.env.run()
    heard = {scanner.walker: sorted(scanner.heard) for scanner in store.scanners}
    return heard, store.packets
