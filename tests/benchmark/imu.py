"""What a phone feels: samples a second with every effect on, and against the plain way."""

from collections.abc import Callable
from functools import cache
from statistics import median
from time import process_time

import numpy as np
from measure import Row
from plain_imu import plain_phone

from blesim import columns
from blesim.imu.feel import Signal, feel
from blesim.imu.magnetics import Magnetics
from blesim.imu.sensors import ImuSettings
from blesim.tables import Carrying, StepTruth, Trajectory
from blesim.venue.layouts import wholesale_section
from blesim.walkers.gait import Gait, steps_of
from blesim.walkers.itinerary import Itinerary, Stop
from blesim.walkers.walker import simulate_walkers

_STOPS = 40
_PAUSE_S = 10.0
_SWITCH_US = 60_000_000
_PLAIN_SAMPLES = 400


@cache
def _walk() -> tuple[Trajectory, StepTruth, Carrying]:
    """A walk from beacon to beacon through the section, in all ways of carrying in turn."""
    graph = wholesale_section().graph
    assert graph is not None
    nodes = [node.id for node in graph.nodes if "/" not in node.id]
    stops = tuple(
        Stop(place=graph.at_node(nodes[7 * number % len(nodes)]), pause_s=_PAUSE_S)
        for number in range(_STOPS)
    )
    (log,) = simulate_walkers(graph, (Itinerary(walker="walker", stops=stops),))
    trajectory = log.trajectory()
    times_us = np.arange(trajectory.time_us[0], trajectory.time_us[-1], _SWITCH_US)
    carrying = Carrying(
        time_us=times_us, carrying=np.arange(len(times_us)) % len(columns.CARRYINGS)
    )
    return trajectory, steps_of(trajectory, Gait(), 1, "walker"), carrying


def _seconds(work: Callable[[], object]) -> float:
    """Time of the processor, since others share the machine. [s]."""
    start = process_time()
    work()
    return process_time() - start


def _samples_per_second(rate_hz: float) -> float:
    trajectory, steps, carrying = _walk()
    phone = ImuSettings(rate_hz=rate_hz, dropped=0.01)

    def work() -> int:
        felt = feel(phone, Magnetics(), trajectory, steps, carrying, 1, "walker")
        return len(felt.imu)

    count = work()
    return count / median(_seconds(work) for _ in range(9))


def samples_at_50_hz() -> float:
    """Samples of all nine axes a second, at 50 Hz."""
    return _samples_per_second(50.0) / 1e6


def samples_at_100_hz() -> float:
    """Samples of all nine axes a second, at 100 Hz."""
    return _samples_per_second(100.0) / 1e6


def over_plain_loop() -> float:
    """Time of a plain sample, without the sensors' errors, over one of ours with them.

    The plain way works out three attitudes a sample, since it has its rates from differences.
    """
    trajectory, steps, carrying = _walk()
    signal = Signal.of(Magnetics(), trajectory, steps, carrying, 1, "walker")
    plain = plain_phone(signal, trajectory, steps, carrying)
    span_s = float(trajectory.time_us[-1] - trajectory.time_us[0]) * 1e-6
    times_s = np.linspace(1.0, span_s - 1.0, _PLAIN_SAMPLES)

    def work() -> None:
        for time_s in times_s:
            plain.sample(time_s)

    plain_s = median(_seconds(work) for _ in range(3)) / _PLAIN_SAMPLES
    return plain_s * _samples_per_second(50.0)


ROWS = [
    Row(name="imu at 50 Hz", unit="M samples/s", measure=samples_at_50_hz, goal=">= 2"),
    Row(name="imu at 100 Hz", unit="M samples/s", measure=samples_at_100_hz, goal=">= 2"),
    Row(name="imu / plain loop", unit="x", measure=over_plain_loop),
]
