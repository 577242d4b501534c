import numpy as np
import pytest
from scipy import stats

from blesim.radio.advertising import Advertising, event_times_us
from blesim.radio.life import simulate_life

SEED = 11
HOUR_US = 3_600_000_000


def times_us(beacon, seed=SEED, until_us=HOUR_US, **settings):
    (spell,) = simulate_life([beacon], (), until_us).spells
    return event_times_us(spell, beacon.id, Advertising(**settings), seed, until_us)


def test_gaps_are_the_interval_and_a_uniform_delay(section):
    beacon = section.beacons[0]
    gaps_us = np.diff(times_us(beacon, clock_drift_ppm=0.0))
    # Measured elsewhere with 450 ms beacons: gaps = interval + U(0, 10 ms). False alarm 1e-4.
    assert gaps_us.min() >= 350_000 - 1
    assert gaps_us.max() <= 360_000 + 1
    assert stats.kstest((gaps_us - 350_000) / 10_000, "uniform").pvalue > 1e-4


def test_delays_of_neighbouring_events_are_independent(section):
    gaps_us = np.diff(times_us(section.beacons[0], clock_drift_ppm=0.0))
    # The bound is 4 standard errors of a correlation of about 10 000 pairs.
    assert abs(np.corrcoef(gaps_us[:-1], gaps_us[1:])[0, 1]) < 0.04


def test_drift_stretches_the_mean_gap_within_its_bound(section):
    means = [
        np.diff(times_us(b, clock_drift_ppm=500.0, until_us=10 * HOUR_US)).mean()
        for b in section.beacons
    ]
    ppm = (np.array(means) - 5_000.0) / 350_000 * 1e6 - 1e6
    # The mean of 100 000 delays of 2.9 ms spread is good to 9 us, that is 26 ppm.
    assert np.abs(ppm).max() < 500 + 4 * 26
    assert ppm.std() == pytest.approx(500 / np.sqrt(3), rel=0.4)


def test_beacons_start_anywhere_within_an_interval(store):
    first = [times_us(beacon, until_us=1_000_000)[0] for beacon in store.beacons]
    # Phase U(0, 350 ms) plus delay U(0, 10 ms); 136 beacons, false alarm 1e-4.
    assert stats.kstest(np.array(first) / 355_000, "uniform").pvalue > 1e-4


def test_a_longer_simulation_begins_alike(section):
    short, long = (times_us(section.beacons[3], until_us=t) for t in (10**7, 10**9))
    assert np.array_equal(short, long[: len(short)])
    assert short[-1] < 10**7 <= long[len(short)]


def test_nothing_is_sent_in_no_time(section):
    assert len(times_us(section.beacons[0], until_us=1)) == 0
