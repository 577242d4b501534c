"""The life of beacons: they die, reboot, are moved or replaced, and their batteries sag."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import simpy

from blesim import columns
from blesim.errors import UsageError
from blesim.radio.beacon_events import (
    BeaconEvent,
    Dies,
    Moves,
    Reboots,
    Replaced,
    Sags,
    impossible_events,
    in_order,
)
from blesim.tables import BeaconHistory
from blesim.units import to_us
from blesim.venue.beacons import Beacon

_EVENT = dict(columns.BEACON_EVENTS)

Process = Generator[simpy.Event, Any, None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Spell:
    """A time in which a beacon sends without anything about it changing.

    Attributes
    ----------
    beacon : int
        Its row.
    start_us, end_us : int
        From the start until just before the end. [us]
    x_m, y_m, z_m : float
        Where it hangs. [m]
    level : int
        On which level.
    power_db : float
        Relative to the measured power of the beacon as built. [dB]
    interval_s : float
        Advertising interval. [s]
    boot : int
        How often its clock was started anew; names the draws of that clock.
    """

    beacon: int
    start_us: int
    end_us: int
    x_m: float
    y_m: float
    z_m: float
    level: int
    power_db: float
    interval_s: float
    boot: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Lives:
    """All spells, in order of beacon and time, and the log of what happened; gaps are silence."""

    spells: tuple[Spell, ...]
    log: BeaconHistory


def simulate_life(beacons: Sequence[Beacon], events: Sequence[BeaconEvent], until_us: int) -> Lives:
    """Lives of all beacons from time 0 until just before `until_us`.

    Parameters
    ----------
    beacons : sequence of Beacon
        As built.
    events : sequence of BeaconEvent
        In any order; those at the same time happen in the order given.
    until_us : int
        End of the simulation; later events do not happen. [us]

    Returns
    -------
    Lives

    Raises
    ------
    UsageError
        If an event is of an unknown beacon or comes after its death.
    """
    for _, message in impossible_events(beacons, events):
        raise UsageError(message)
    env = simpy.Environment()
    log: list[tuple[float, ...]] = []
    lives = [_Life.of(row, beacon, log) for row, beacon in enumerate(beacons)]
    for life in lives:
        env.process(life.live(env, [e for e in events if e.beacon == life.beacon.id]))
    env.run(until=until_us)
    for life in lives:
        life.fall_silent(until_us)
    rows = zip(*log, strict=True) if log else [() for _ in BeaconHistory.STREAM.columns]
    history = {
        column.field: np.array(values)
        for column, values in zip(BeaconHistory.STREAM.columns, rows, strict=True)
    }
    return Lives(
        spells=tuple(spell for life in lives for spell in life.spells),
        log=BeaconHistory(**history),
    )


@dataclass(slots=True, kw_only=True)
class _Life:
    """One beacon while it lives: what it is like now, and what is already written down."""

    row: int
    beacon: Beacon
    log: list[tuple[float, ...]]
    place: tuple[float, float, float]
    level: int
    interval_s: float
    fresh_db: float = 0.0
    sag_db: float = 0.0
    boot: int = 0
    # Counts deaths and replacements: what the old hardware was about to do no longer happens.
    hardware: int = 0
    sending_since_us: int | None = 0
    spells: list[Spell] = field(default_factory=list)

    @classmethod
    def of(cls, row: int, beacon: Beacon, log: list[tuple[float, ...]]) -> "_Life":
        return cls(
            row=row,
            beacon=beacon,
            log=log,
            place=(beacon.x_m, beacon.y_m, beacon.z_m),
            level=beacon.level,
            interval_s=beacon.advertising_interval_s,
        )

    def live(self, env: simpy.Environment, events: Sequence[BeaconEvent]) -> Process:
        """The process: wait for one event after the other."""
        for number in in_order(events):
            yield env.timeout(to_us(events[number].at_s) - env.now)
            self._meet(env, events[number])

    def fall_silent(self, now_us: int) -> None:
        """Write down the spell that ends now, if the beacon sends."""
        start_us, self.sending_since_us = self.sending_since_us, None
        if start_us is None or start_us == now_us:
            return
        x_m, y_m, z_m = self.place
        self.spells.append(
            Spell(
                beacon=self.row,
                start_us=start_us,
                end_us=now_us,
                x_m=x_m,
                y_m=y_m,
                z_m=z_m,
                level=self.level,
                power_db=self.fresh_db + self.sag_db,
                interval_s=self.interval_s,
                boot=self.boot,
            )
        )

    def _meet(self, env: simpy.Environment, event: BeaconEvent) -> None:
        match event:
            case Dies():
                self.fall_silent(_now_us(env))
                self.hardware += 1
                self._note(env, "dies")
            case Reboots():
                self._reboot(env, event)
            case Moves():
                self._move(env, event)
            case Replaced():
                self._replace(env, event)
            case Sags():
                env.process(self._sag(env, event))

    def _reboot(self, env: simpy.Environment, event: Reboots) -> None:
        self.fall_silent(_now_us(env))
        self.boot += 1
        self._note(env, "reboots")
        env.process(self._return(env, event.off_s))

    def _return(self, env: simpy.Environment, off_s: float) -> Process:
        left = (self.hardware, self.boot)
        yield env.timeout(to_us(off_s))
        if left == (self.hardware, self.boot):
            self.sending_since_us = _now_us(env)
            self._note(env, "returns")

    def _move(self, env: simpy.Environment, event: Moves) -> None:
        sending = self._pause(env)
        z_m = self.place[2] if event.z_m is None else event.z_m
        self.place = (event.x_m, event.y_m, z_m)
        self.level = self.level if event.level is None else event.level
        self._go_on(env, sending)
        self._note(env, "moves")

    def _replace(self, env: simpy.Environment, event: Replaced) -> None:
        self.fall_silent(_now_us(env))
        if event.measured_power_dbm is not None:
            self.fresh_db = event.measured_power_dbm - self.beacon.measured_power_dbm
        if event.advertising_interval_s is not None:
            self.interval_s = event.advertising_interval_s
        self.sag_db = 0.0
        self.hardware += 1
        self.boot += 1
        self.sending_since_us = _now_us(env)
        self._note(env, "replaced")

    def _sag(self, env: simpy.Environment, event: Sags) -> Process:
        hardware, begin_us = self.hardware, _now_us(env)
        steps = event.steps if event.duration_s > 0 else 1
        for step in range(1, steps + 1):
            yield env.timeout(begin_us + to_us(event.duration_s * step / steps) - env.now)
            if self.hardware != hardware:
                return
            sending = self._pause(env)
            self.sag_db += event.power_db / steps
            self._go_on(env, sending)
            self._note(env, "sags")

    def _pause(self, env: simpy.Environment) -> bool:
        """End the spell, if there is one: something about the beacon is about to change."""
        sending = self.sending_since_us is not None
        self.fall_silent(_now_us(env))
        return sending

    def _go_on(self, env: simpy.Environment, sending: bool) -> None:
        self.sending_since_us = _now_us(env) if sending else None

    def _note(self, env: simpy.Environment, event: str) -> None:
        change_db = self.fresh_db + self.sag_db
        self.log.append((env.now, self.row, _EVENT[event], *self.place, self.level, change_db))


def _now_us(env: simpy.Environment) -> int:
    """Time of a clock that only ever counted whole microseconds. [us]."""
    return int(env.now)
