"""PedPy, the pedestrian scientists' analysis tool, measures in a simulated day what was configured.

PedPy: Schroedter et al., doi:10.5281/zenodo.7194992. Its speed of a person in a frame is the length
of the way from half a second before to half a second after, over that second.
"""

from itertools import pairwise
from math import sqrt

import numpy as np
import pedpy
import pytest

from blesim.columns import STATES
from blesim.venue.layouts import CENTRE_TO_FACE_M
from blesim.walkers.day import simulate_day
from blesim.walkers.trading_day import Basket, Pace, Spread, Staff, Tills, TradingDay

S = 1_000_000
FRAMES_A_SECOND = 10
HALF_WINDOW = FRAMES_A_SECOND // 2
STATE = dict(STATES)
SECTION_TILLS = ("F/east", "E/east", "D/east")


def quiet_day(**settings):
    """A day in the wholesale section without staff and groups, where nobody queues."""
    tills = Tills(nodes=SECTION_TILLS, servers=50, service=Spread(median_s=1.0, spread=0.0))
    return TradingDay(
        entrance="F/west",
        tills=tills,
        group_shares=(1.0,),
        staff=Staff(number=0),
        **settings,
    )


def loaded(people, folder, since_us=0, until_us=86_400 * S):
    """What PedPy loads from a text file of everybody's positions, ten a second."""
    frame_us = S // FRAMES_A_SECOND
    parts = []
    for number, person in enumerate(people):
        knots_us = person.trajectory.time_us
        first = max(-(-knots_us[0] // frame_us), since_us // frame_us)
        frames = np.arange(first, min(knots_us[-1], until_us) // frame_us + 1)
        poses = person.trajectory.at(frames * frame_us)
        parts.append(np.stack([np.full(len(frames), number), frames, poses.x_m, poses.y_m], axis=1))
    path = folder / "day.txt"
    np.savetxt(path, np.concatenate(parts), fmt="%d %d %.6f %.6f")
    return pedpy.load_trajectory_from_txt(
        trajectory_file=path,
        default_frame_rate=FRAMES_A_SECOND,
        default_unit=pedpy.TrajectoryUnit.METER,
    )


def speeds_of(trajectories):
    """PedPy's speeds: columns id, frame and speed [m/s]."""
    return pedpy.compute_individual_speed(
        traj_data=trajectories,
        frame_step=HALF_WINDOW,
        speed_calculation=pedpy.SpeedCalculation.BORDER_EXCLUDE,
    )


@pytest.fixture(scope="module")
def alone(section, tmp_path_factory):
    """People of a day with hardly two at a time, and their speeds by PedPy."""
    day = quiet_day(
        shoppers=80, basket=Basket(mean=3, spread=1), pace=Pace(mean_m_s=0.85, spread_m_s=0.1)
    )
    people = simulate_day(section, day, (), 1).people
    trajectories = loaded(people, tmp_path_factory.mktemp("alone"))
    assert trajectories.data["id"].nunique() == len(people)
    return people, speeds_of(trajectories)


def test_who_walks_alone_walks_at_the_desired_speed(alone):
    people, speeds = alone
    desired_m_s = np.array([person.speed_m_s for person in people])
    fastest = speeds.groupby("id")["speed"].max().to_numpy()
    np.testing.assert_allclose(fastest, desired_m_s, atol=2e-3)
    # Not in one lucky frame: most of the time on the move is at that speed.
    moving = speeds[speeds["speed"] > 0.05]
    steady = np.abs(moving["speed"] - desired_m_s[moving["id"]]) < 0.01
    assert steady.mean() > 0.5


def test_the_measured_speeds_have_the_configured_mean_and_spread(alone):
    people, speeds = alone
    fastest = speeds.groupby("id")["speed"].max().to_numpy()
    count = len(people)
    assert count > 50
    # Four standard errors: a false alarm in 16 000 seeds each. The cut at three standard
    # deviations makes the spread 1.3 % smaller.
    assert abs(fastest.mean() - 0.85) < 4 * 0.1 / sqrt(count)
    assert abs(fastest.std(ddof=1) - 0.0987) < 4 * 0.1 / sqrt(2 * count)


def weidmann(others_per_m2):
    """Share of the free speed left in a crowd: Kladek's relation as Weidmann (1993) fitted it."""
    return 1 - np.exp(-1.913 * (1 / np.maximum(others_per_m2, 1e-9) - 1 / 5.4))


def passages(people, length_m, since_us, until_us):
    """Edges over 8 m that somebody walked along without a stop: person, edge, entry, exit [us]."""
    found = []
    for number, person in enumerate(people):
        walk = person.trajectory
        first = np.flatnonzero(np.diff(walk.edge, prepend=-1))
        for begin, end in pairwise(first.tolist()):
            entered_us, left_us = walk.time_us[[begin, end]].tolist()
            goes_on = np.all(walk.state[begin:end] == STATE["walking"])
            in_time = since_us <= entered_us and left_us <= until_us
            if goes_on and in_time and length_m[walk.edge[begin]] > 8:
                found.append((number, int(walk.edge[begin]), entered_us, left_us))
    return found


def edges_at(people, time_us):
    """Edge of everybody who is inside at a time."""
    walks = [person.trajectory for person in people]
    return [
        walk.edge[np.searchsorted(walk.time_us, time_us, side="right") - 1]
        for walk in walks
        if walk.time_us[0] <= time_us < walk.time_us[-1]
    ]


def test_in_a_crowd_people_are_slowed_by_the_density_relation(section, tmp_path):
    day = quiet_day(
        shoppers=700,
        opens="08:00",
        closes="08:10",
        capacity=900,
        basket=Basket(mean=12, spread=2),
        pace=Pace(mean_m_s=1.0, spread_m_s=0.05),
    )
    people = simulate_day(section, day, (), 1).people
    since_us, until_us = 440 * S, 500 * S
    speeds = speeds_of(loaded(people, tmp_path, since_us, until_us)).set_index(["id", "frame"])
    walked = passages(people, section.graph.length_m, since_us + S, until_us - S)
    assert len(walked) > 100
    measured, expected, free = [], [], []
    for number, edge, entered_us, left_us in walked:
        # Aisles between shelves are as wide as twice the way from their centre to the face.
        area_m2 = section.graph.length_m[edge] * 2 * CENTRE_TO_FACE_M
        others = edges_at(people, entered_us).count(edge) - 1
        # Half-way along, whoever had to speed up or to slow down has done so.
        middle = round((entered_us + left_us) / 2 * FRAMES_A_SECOND / S)
        measured.append(speeds.loc[(number, middle), "speed"])
        free.append(people[number].speed_m_s)
        expected.append(free[-1] * weidmann(others / area_m2))
    ratio = np.array(measured) / np.array(expected)
    assert np.median(ratio) == pytest.approx(1.0, abs=0.002)
    # Who stands on the node between two edges may be counted on either.
    assert np.mean(np.abs(ratio - 1) < 0.01) > 0.95
    slowed = np.array(measured) / np.array(free)
    assert np.quantile(slowed, 0.1) < 0.75 < 0.9 < np.quantile(slowed, 0.95)
