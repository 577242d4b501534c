import numpy as np
import pytest

from blesim.radio.collisions import collided


def lost(times, powers, channels=None, capture_db=10.0):
    count = len(times)
    channels = np.full(count, 37) if channels is None else np.array(channels)
    return collided(
        np.array(times), np.full(count, 368), channels, np.array(powers, float), capture_db
    ).tolist()


def test_equal_packets_destroy_each_other_and_a_strong_one_survives():
    assert lost([0, 100], [-70, -70]) == [True, True]
    assert lost([0, 100], [-60, -70]) == [False, True]
    assert lost([0, 100], [-70, -60]) == [True, False]
    assert lost([0, 100], [-60.1, -70]) == [True, True]


def test_packets_that_do_not_overlap_or_share_no_channel_live():
    assert lost([0, 368], [-70, -70]) == [False, False]
    assert lost([0, 100], [-70, -70], [37, 38]) == [False, False]


def test_a_third_packet_in_between_hides_nobody():
    assert lost([0, 100, 300], [-70, -70, -70], [37, 38, 37]) == [True, False, True]


@pytest.mark.parametrize(("beacons", "share"), [(10, 0.068), (50, 0.297), (100, 0.505)])
def test_share_of_collisions_without_capture_is_that_of_the_formula(beacons, share):
    # 1 - (1 - 2 tau / (T + 5 ms))^N, tau = 368 us, T = 100 ms: 6.8, 29.7 and 50.5 %.
    generator = np.random.default_rng(8)
    cycles = 400
    gaps = 100_000 + generator.uniform(0, 10_000, (beacons + 1, cycles))
    times = np.cumsum(gaps, axis=1) + generator.uniform(0, 105_000, (beacons + 1, 1))
    flat = times.ravel().astype(np.int64)
    order = np.argsort(flat, kind="stable")
    count = len(flat)
    found = collided(flat[order], np.full(count, 368), np.full(count, 37), np.zeros(count), 1e9)
    expected = 1 - (1 - 2 * 368 / 105_000) ** beacons
    assert expected == pytest.approx(share, abs=0.001)
    assert found.mean() == pytest.approx(expected, abs=0.02)
