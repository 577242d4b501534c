import numpy as np
import pytest
from scipy import stats

from blesim.tables import StepTruth
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
