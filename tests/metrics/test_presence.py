from types import MappingProxyType

import numpy as np
import pytest

from blesim.errors import DataError
from blesim.metrics.presence import (
    most_present,
    occupancy,
    presence_h,
    section_visits,
)
from blesim.recording import Crowd, Person, Role
from blesim.tables import Trajectory, Visits
from blesim.venue.section_places import SectionPlaces

S = 1_000_000
H = 3600


def stay(came_s, left_s, role=Role.SHOPPER, name="Ana"):
    """Somebody who stands at the entrance for a while."""
    walked = Trajectory(
        time_us=[came_s * S, left_s * S],
        x_m=[0.0, 0.0],
        y_m=[0.0, 0.0],
        level=[0, 0],
        heading_rad=[0.0, 0.0],
        speed_m_s=[0.0, 0.0],
        edge=[-1, -1],
        offset_m=[np.nan, np.nan],
        edge_speed_m_s=[np.nan, np.nan],
        state=[0, 0],
    )
    return Person(name=name, role=role, trajectory=walked)


def on_edge(edge, knots, name="Ana", role=Role.SHOPPER):
    """A walk on one edge; knots are (time_s, offset_m, speed_m_s, acceleration_m_s2, rate_m_s)."""
    time_s, offset_m, speed_m_s, acceleration_m_s2, rate_m_s = np.array(knots, float).T
    count = len(knots)
    walked = Trajectory(
        time_us=np.round(time_s * S),
        x_m=offset_m,
        y_m=np.zeros(count),
        level=np.zeros(count, int),
        heading_rad=np.zeros(count),
        speed_m_s=speed_m_s,
        acceleration_m_s2=acceleration_m_s2,
        edge=np.full(count, edge),
        offset_m=offset_m,
        edge_speed_m_s=rate_m_s,
        state=np.ones(count, int),
    )
    return Person(name=name, role=role, trajectory=walked)


def random_walk(graph, rng, number, legs=12):
    """Somebody who wanders from node to node, with speeds up, down and steady, and stops."""
    node = int(rng.integers(len(graph.nodes)))
    time_us, rows = int(rng.integers(0, 4000)) * S, []
    for _ in range(legs):
        around = np.flatnonzero((graph.ends == node).any(axis=1))
        edge = int(rng.choice(around))
        forwards = graph.ends[edge, 0] == node
        length_m = float(graph.length_m[edge])
        v0, v1 = (round(float(v), 4) for v in rng.uniform(0.3, 1.5, 2))
        span_us = round(2 * length_m / (v0 + v1) * S)
        rate = (v1 - v0) / (span_us / S)
        sign = 1.0 if forwards else -1.0
        at_m = 0.0 if forwards else length_m
        rows.append((time_us, edge, at_m, v0, rate, sign * length_m / (span_us / S)))
        time_us += span_us
        node = int(graph.ends[edge, 1 if forwards else 0])
        end_m = length_m if forwards else 0.0
        rows.append((time_us, edge, end_m, 0.0, 0.0, 0.0))
        time_us += int(rng.integers(0, 5)) * S
    times, edges, offsets, speeds, accelerations, rates = zip(*rows, strict=True)
    xy_m = graph.xy_m(edges, offsets)
    walked = Trajectory(
        time_us=times,
        x_m=xy_m[:, 0],
        y_m=xy_m[:, 1],
        level=np.zeros(len(rows), int),
        heading_rad=np.zeros(len(rows)),
        speed_m_s=speeds,
        acceleration_m_s2=accelerations,
        edge=edges,
        offset_m=offsets,
        edge_speed_m_s=rates,
        state=np.ones(len(rows), int),
    )
    return Person(name=f"p{number}", role=Role(number % 3), trajectory=walked)


@pytest.fixture(scope="module")
def crowd(store):
    rng = np.random.default_rng(7)
    return Crowd(people=tuple(random_walk(store.graph, rng, number) for number in range(40)))


def test_occupancy_by_hand():
    crowd = Crowd(people=(stay(5, 25), stay(10, 20, Role.STAFF), stay(10, 40)))
    found = occupancy(crowd, 10.0)
    assert (found.time_us // S).tolist() == [0, 10, 20, 30, 40]
    assert found.inside[Role.SHOPPER].tolist() == [0, 2, 2, 1, 0]
    assert found.inside[Role.STAFF].tolist() == [0, 1, 0, 0, 0]
    assert found.total.tolist() == [0, 3, 2, 1, 0]
    assert Role.TESTER not in found.inside
    assert most_present(crowd) == (3, 10 * S)


def test_one_goes_as_another_comes():
    assert most_present(Crowd(people=(stay(0, 10), stay(10, 20)))) == (1, 0)


def test_who_came_before_opening_is_counted():
    found = occupancy(Crowd(people=(stay(-15, 5, Role.STAFF),)), 10.0)
    assert (found.time_us // S).tolist() == [-20, -10, 0, 10]
    assert found.total.tolist() == [0, 1, 1, 0]


def test_nobody_came():
    found = occupancy(Crowd(), 60.0)
    assert len(found.time_us) == len(found.total) == 0
    assert found.inside == MappingProxyType({})
    assert most_present(Crowd()) == (0, None)


def test_a_step_that_leads_nowhere_is_refused():
    with pytest.raises(DataError, match="a step of 0 s leads nowhere"):
        occupancy(Crowd(), 0.0)


def test_the_area_under_occupancy_is_the_time_of_all_stays(crowd):
    stays_s = np.array([np.ptp(p.trajectory.time_us) / S for p in crowd.people])
    for step_s in (1.0, 7.0, 60.0):
        area_s = occupancy(crowd, step_s).total.sum() * step_s
        assert abs(area_s - stays_s.sum()) <= step_s * len(crowd.people)


def test_the_most_present_are_never_fewer_than_at_any_step(crowd):
    most, when_us = most_present(crowd)
    found = occupancy(crowd, 1.0)
    assert most >= found.total.max()
    inside = [p.trajectory.time_us[0] <= when_us < p.trajectory.time_us[-1] for p in crowd.people]
    assert most == sum(inside)


def test_presence_by_hand_of_a_steady_walk_there_and_a_stop(section):
    # Edge 1 of aisle F lies between beacons F1 and F2: 8.1 m, three sections of 2.7 m.
    edge = next(
        row for row, e in enumerate(section.graph.edges) if {e.first, e.second} == {"F1", "F2"}
    )
    length_m = float(section.graph.length_m[edge])
    assert length_m == pytest.approx(8.1)
    walk = [(0, 0.0, 0.9, 0, 0.9), (9, 8.1, 0, 0, 0), (99, 8.1, 0.9, 0, -0.9), (108, 0.0, 0, 0, 0)]
    found = presence_h(Crowd(people=(on_edge(edge, walk),)), section) * H
    by_id = {s.id: hours for s, hours in zip(section.sections, found, strict=True)}
    # 3 s in each section a way, and 90 s at the end of the third.
    assert by_id["F-01"] == pytest.approx(6)
    assert by_id["F-02"] == pytest.approx(6)
    assert by_id["F-03"] == pytest.approx(96)
    assert found.sum() == pytest.approx(108)


def test_presence_by_hand_of_one_who_sets_out(section):
    # s = 0.5 a t^2 with a = 0.2: 2.7 m after sqrt(27) s, 5.4 m after sqrt(54), 8.1 m after 9 s.
    edge = next(
        row for row, e in enumerate(section.graph.edges) if {e.first, e.second} == {"F1", "F2"}
    )
    walk = [(0, 0.0, 0.0, 0.2, 0.9), (9, 8.1, 0.0, 0, 0)]
    found = presence_h(Crowd(people=(on_edge(edge, walk),)), section) * H
    passes_s = np.diff([0.0, 27**0.5, 54**0.5, 9.0])
    named = [
        found[row] for row, s in enumerate(section.sections) if s.id in ("F-01", "F-02", "F-03")
    ]
    np.testing.assert_allclose(named, passes_s, rtol=1e-6)


def test_presence_agrees_with_the_poses_sampled_often(crowd, store):
    places = SectionPlaces.of(store.graph, store.sections)
    sampled_h = np.zeros(len(store.sections))
    step_us = 20_000
    for person in crowd.people:
        walked = person.trajectory
        poses = walked.at(np.arange(walked.time_us[0], walked.time_us[-1], step_us))
        row = places.at(poses.edge, poses.offset_m)
        sampled_h += np.bincount(row[row >= 0], minlength=len(sampled_h)) * step_us / (H * S)
    found_h = presence_h(crowd, store)
    # A passage is off by a step at most.
    passages = sum(len(person.trajectory) for person in crowd.people)
    assert np.abs(found_h - sampled_h).max() * H < 20 * step_us / S
    assert abs(found_h.sum() - sampled_h.sum()) * H < passages * step_us / S
    assert found_h.sum() > 0.2


def test_whoever_is_on_no_edge_is_in_no_section(section):
    assert presence_h(Crowd(people=(stay(0, 9),)), section).sum() == 0
    assert presence_h(Crowd(), section).tolist() == [0.0] * len(section.sections)


def test_visits_by_hand(section):
    visits = Visits(
        time_us=[1, 2, 3], person=[0, 0, 0], section=[2, 0, 2], dwell_us=[H * S, 0, H * S // 2]
    )
    found = section_visits(Crowd(people=(stay(0, 9),), visits=visits), section)
    assert found.stops[:4].tolist() == [1, 0, 2, 0]
    assert found.dwell_h[:4].tolist() == [0.0, 0.0, 1.5, 0.0]
    assert len(found.stops) == len(found.dwell_h) == len(section.sections)


def test_a_visit_to_a_section_that_is_not_there_is_refused(section):
    visits = Visits(time_us=[1], person=[0], section=[999], dwell_us=[0])
    with pytest.raises(DataError, match="section row 999, but the venue has 54"):
        section_visits(Crowd(visits=visits), section)
