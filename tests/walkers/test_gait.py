import numpy as np
import pytest
from scipy import stats

from blesim.tables import StepTruth, Trajectory
from blesim.venue.graph import AisleGraph, Edge, Node
from blesim.walkers.gait import Gait, steps_of
from blesim.walkers.itinerary import Itinerary, Stop
from blesim.walkers.walker import simulate_walkers


def straight_walk(length_m: float, speed_m_s: float, pause_s: float = 0.0):
    graph = AisleGraph(
        nodes=(
            Node(id="A", x_m=0, y_m=0),
            Node(id="B", x_m=length_m / 2, y_m=0),
            Node(id="C", x_m=length_m, y_m=0),
        ),
        edges=(
            Edge(first="A", second="B", branch="a"),
            Edge(first="B", second="C", branch="a"),
        ),
    )
    route = tuple(
        Stop(place=graph.at_node(name), pause_s=pause)
        for name, pause in zip("ABC", (0, pause_s, 0), strict=True)
    )
    itinerary = Itinerary(walker="w", stops=route, speed_m_s=speed_m_s)
    return simulate_walkers(graph, (itinerary,))[0].trajectory()


@pytest.mark.parametrize(
    ("speed_m_s", "cadence_hz", "length_m"),
    # Measured with the phone in hand: 1.65 Hz and 0.61 m at 1.0 m/s, 1.82 Hz and 0.69 m at 1.25.
    [(1.0, 1.65, 0.61), (1.25, 1.82, 0.69)],
)
def test_cadence_and_step_length_are_those_measured(speed_m_s, cadence_hz, length_m):
    trajectory = straight_walk(2000.0, speed_m_s)
    steps = steps_of(trajectory, Gait(), 5, "w")
    duration_s = (trajectory.time_us[-1] - trajectory.time_us[0]) / 1e6
    assert len(steps) / duration_s == pytest.approx(cadence_hz, rel=0.01)
    assert steps.length_m.mean() == pytest.approx(length_m, rel=0.01)


def test_step_intervals_vary_as_configured():
    steps = steps_of(straight_walk(3000.0, 1.0), Gait(interval_variation=0.085), 5, "w")
    interval_s = np.diff(steps.time_us) / 1e6
    # About 4900 intervals: the standard error of the coefficient is 0.085 / sqrt(2 n) = 0.0009.
    assert interval_s.std() / interval_s.mean() == pytest.approx(0.085, abs=0.004)
    # Neighbouring intervals are independent; false alarm 1e-4.
    assert stats.pearsonr(interval_s[:-1], interval_s[1:]).pvalue > 1e-4


def test_steps_add_up_to_the_way_but_for_the_last():
    trajectory = straight_walk(100.0, 1.0)
    steps = steps_of(trajectory, Gait(), 5, "w")
    assert 100.0 - 1.0 < steps.length_m.sum() <= 100.0 + 1e-6


@pytest.mark.parametrize("speed_m_s", [0.05, 1.0, 6.0])
def test_no_step_is_longer_than_the_gait_allows(speed_m_s):
    gait = Gait(interval_variation=0.25)
    steps = steps_of(straight_walk(1500.0, speed_m_s), gait, 5, "w")
    longest_m = float(gait.longest_step_m(np.array(speed_m_s)))
    # Three standard deviations are reached once in 740 steps.
    assert 0.95 * longest_m < steps.length_m.max() <= longest_m + 1e-4


def test_nobody_steps_while_standing():
    trajectory = straight_walk(40.0, 1.0, pause_s=60.0)
    steps = steps_of(trajectory, Gait(), 5, "w")
    standing = trajectory.at(steps.time_us).state == 0
    assert not standing[:-1].any()
    assert len(steps) == pytest.approx(40 / 0.61, abs=3)


def test_feet_alternate_and_times_ascend():
    steps = steps_of(straight_walk(30.0, 1.0), Gait(), 5, "w")
    assert set(np.diff(steps.foot.astype(int)).tolist()) == {1, -1}
    assert (np.diff(steps.time_us) > 0).all()


def test_a_walk_shorter_than_a_step_has_none():
    assert steps_of(straight_walk(0.1, 1.0), Gait(), 5, "w") == StepTruth.empty()


def test_other_walkers_step_otherwise():
    trajectory = straight_walk(30.0, 1.0)
    assert steps_of(trajectory, Gait(), 5, "w") == steps_of(trajectory, Gait(), 5, "w")
    assert steps_of(trajectory, Gait(), 5, "w") != steps_of(trajectory, Gait(), 5, "v")
    assert steps_of(trajectory, Gait(), 5, "w") != steps_of(trajectory, Gait(), 6, "w")


def test_a_slowly_growing_speed_gives_the_steps_of_its_integral():
    # v = 0.4 + 0.05 t for 20 s: phase (T - a ln((a + b v1) / (a + b v0)) / (b a')) / b.
    a, b, rate, span = 0.29, 0.32, 0.05, 20.0
    way = 0.4 * span + 0.5 * rate * span**2
    trajectory = Trajectory(
        time_us=np.array([0, 20_000_000]),
        x_m=np.array([0.0, way]),
        y_m=np.zeros(2),
        level=np.zeros(2, int),
        heading_rad=np.zeros(2),
        speed_m_s=np.array([0.4, 0.0]),
        acceleration_m_s2=np.array([rate, 0.0]),
        edge=np.zeros(2, int),
        offset_m=np.array([0.0, way]),
        edge_speed_m_s=np.array([way / span, 0.0]),
        state=np.array([1, 0]),
    )
    steps = steps_of(trajectory, Gait(interval_variation=0.0), 5, "w")
    phase = (span - a * np.log((a + b * 1.4) / (a + b * 0.4)) / (b * rate)) / b
    assert len(steps) == int(phase)
    assert steps.length_m[1:].sum() == pytest.approx(
        trajectory.at(steps.time_us[-1:]).x_m[0] - trajectory.at(steps.time_us[:1]).x_m[0],
        abs=0.01,
    )
    # Each step is as long as its mean speed asks for.
    speed = np.diff(trajectory.at(steps.time_us).x_m) / np.diff(steps.time_us) * 1e6
    assert steps.length_m[1:] == pytest.approx(a + b * speed, abs=0.002)


@pytest.mark.parametrize(
    ("speed_m_s", "strides_per_minute"),
    # Self-selected stride frequencies, van Oeveren et al. 2017, doi:10.1371/journal.pone.0184273
    [(2.4, 77), (2.6, 79), (2.9, 80)],
)
def test_runners_step_as_measured(speed_m_s, strides_per_minute):
    trajectory = straight_walk(3000.0, speed_m_s)
    steps = steps_of(trajectory, Gait(), 5, "w")
    rate = len(steps) / 2 / (trajectory.time_us[-1] / 6e7)
    assert rate == pytest.approx(strides_per_minute, rel=0.015)
    interval = np.diff(steps.time_us)
    assert interval.std() / interval.mean() == pytest.approx(0.03, abs=0.002)
