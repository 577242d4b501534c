import numpy as np

from blesim.radio.crowd import CROWD_STEP_US, PERSON_HEIGHT_M, PERSON_RADIUS_M, Crowd
from blesim.tables import Trajectory


def standing(x_m, y_m, until_us=10_000_000):
    return Trajectory(
        time_us=np.array([0, until_us]),
        x_m=np.full(2, x_m),
        y_m=np.full(2, y_m),
        level=np.zeros(2, int),
        heading_rad=np.zeros(2),
        speed_m_s=np.zeros(2),
        edge=np.full(2, -1),
        offset_m=np.full(2, np.nan),
        edge_speed_m_s=np.full(2, np.nan),
        state=np.zeros(2, int),
    )


def wandering(generator, start_us):
    """A walk with stops and with speeds that change between its knots."""
    count = int(generator.integers(2, 30))
    speeding = generator.random(count) < 0.5
    return Trajectory(
        time_us=start_us + np.cumsum(generator.integers(0, 4 * 10**6, count)),
        x_m=generator.uniform(0, 8, count),
        y_m=generator.uniform(0, 8, count),
        level=np.zeros(count, int),
        heading_rad=generator.uniform(-3.1, 3.1, count),
        speed_m_s=generator.uniform(0, 2, count),
        acceleration_m_s2=np.where(speeding, generator.uniform(0, 1, count), 0.0),
        edge=np.full(count, -1),
        offset_m=np.full(count, np.nan),
        edge_speed_m_s=np.full(count, np.nan),
        state=np.ones(count, int),
    )


def plain_crossings(walks, time_us, phone_m, beacon_m, walker):
    """The others on one link, one after the other, with the way to each as a share of the link."""
    count, step = 0, time_us // CROWD_STEP_US
    along = beacon_m - phone_m
    for name, walk in walks.items():
        first, last = int(walk.time_us[0]), int(walk.time_us[-1])
        if name == walker or not first // CROWD_STEP_US <= step <= last // CROWD_STEP_US:
            continue
        middle_us = min(max(step * CROWD_STEP_US + CROWD_STEP_US // 2, first), last)
        pose = walk.at(np.array([middle_us]))
        to = np.array([pose.x_m[0], pose.y_m[0]]) - phone_m[:2]
        share = to @ along[:2] / (along[:2] @ along[:2])
        beside_m = np.hypot(*(to - share * along[:2]))
        high_m = phone_m[2] + share * along[2]
        count += 0 < share < 1 and beside_m <= PERSON_RADIUS_M and high_m < PERSON_HEIGHT_M
    return count


def test_counts_are_those_of_one_person_after_the_other():
    generator = np.random.default_rng(8)
    starts = generator.integers(0, 10**8, 60)
    walks = {str(row): wandering(generator, int(start)) for row, start in enumerate(starts)}
    crowd = Crowd.of(walks)
    time_us = generator.integers(10**7, 11 * 10**7, 400)
    phone_m, beacon_m = generator.uniform(0, 8, (2, 400, 3))
    phone_m[:, 2] = generator.uniform(0.5, 2.2, 400)
    beacon_m[:, 2] = generator.uniform(0.5, 3.0, 400)
    counts = crowd.crossings(time_us, phone_m, beacon_m, "7")
    expected = [
        plain_crossings(walks, int(now), *ends, "7")
        for now, *ends in zip(time_us, phone_m, beacon_m, strict=True)
    ]
    assert counts.tolist() == expected
    assert sum(expected) > 100
    # What is asked about at the same time changes nothing.
    for part in (slice(0, 1), slice(100, 103)):
        ends = phone_m[part], beacon_m[part]
        assert np.array_equal(crowd.crossings(time_us[part], *ends, "7"), counts[part])


def test_only_others_on_the_link_count():
    crowd = Crowd.of(
        {
            "me": standing(0, 0),
            "on": standing(2, 0.1),
            "off": standing(2, 1),
            "behind": standing(-1, 0),
        }
    )
    ends = np.array([[0.0, 0.0, 1.0]]), np.array([[5.0, 0.0, 1.5]])
    now = np.array([1_000_000])
    assert crowd.crossings(now, *ends, "me").tolist() == [1]
    assert crowd.crossings(now, *ends, "on").tolist() == [0]
    assert crowd.crossings(np.array([60_000_000]), *ends, "me").tolist() == [0]


def test_a_link_above_the_heads_is_free():
    crowd = Crowd.of({"on": standing(2, 0)})
    ends = np.array([[0.0, 0.0, 1.0]]), np.array([[3.0, 0.0, 3.0]])
    assert crowd.crossings(np.array([0]), *ends, "me").tolist() == [0]


def test_an_empty_crowd_is_on_no_link():
    ends = np.zeros((3, 3)), np.ones((3, 3))
    assert Crowd.of({}).crossings(np.arange(3), *ends, "me").tolist() == [0, 0, 0]
