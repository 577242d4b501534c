from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from blesim.radio.advertising import STRETCH, Advertising, Clock, clock_name
from blesim.radio.life import simulate_life
from blesim.rng import Draws

SEED = 11
HOUR_US = 3_600_000_000


def clock_of(beacon, seed=SEED, until_us=HOUR_US, **settings):
    (spell,) = simulate_life([beacon], (), until_us).spells
    return Clock.of(spell, beacon.id, Advertising(**settings), seed, until_us)


def times_us(beacon, seed=SEED, until_us=HOUR_US, **settings):
    clock = clock_of(beacon, seed, until_us, **settings)
    return clock.events_between(0, until_us)[0]


def plain_times_us(spell, beacon, drift_ppm, seed, until_us):
    """Every event at once: the cumulative sum of all delays."""
    starts = Draws(seed=seed, purpose="advertising start", beacon=beacon)
    phase, deviate = starts.uniforms(np.array([spell.boot]))[0, :2]
    rate, interval_us = 1 + drift_ppm * 1e-6 * (2 * deviate - 1), spell.interval_s * 1e6
    ordinals = np.arange((until_us - spell.start_us) // int(interval_us * 0.999) + 1)
    name = clock_name(beacon, spell.boot)
    delays = Draws(seed=seed, purpose="advertising delay", beacon=name).uniforms(ordinals)
    delay_us = np.floor(delays[:, 0] * 10_001).astype(np.int64)
    regular_us = np.rint((phase + ordinals * rate) * interval_us).astype(np.int64)
    times = spell.start_us + regular_us + np.cumsum(delay_us)
    return times[times < until_us]


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


@pytest.mark.parametrize("interval_s", [0.02, 0.35, 10.24])
@pytest.mark.parametrize("start_us", [0, 123_456_789])
def test_any_stretch_is_that_of_the_plain_cumulative_sum(section, interval_s, start_us):
    (spell,) = simulate_life(section.beacons[:1], (), 2 * HOUR_US).spells
    spell = replace(spell, start_us=start_us, interval_s=interval_s, boot=2)
    advertising = Advertising(clock_drift_ppm=500.0)
    clock = Clock.of(spell, "b", advertising, SEED, 2 * HOUR_US)
    expected = plain_times_us(spell, "b", 500.0, SEED, 2 * HOUR_US)
    assert len(expected) > 5 * STRETCH
    whole, first = clock.events_between(0, 2 * HOUR_US)
    assert first == 0
    assert np.array_equal(whole, expected)
    generator = np.random.default_rng(5)
    edges = [int(each) for each in expected[[0, STRETCH - 1, STRETCH, STRETCH + 1, -1]]]
    edges += [int(each) for each in generator.integers(0, 2 * HOUR_US, 20)]
    for begin_us in edges:
        for length_us in (-1, 0, 1, 10**7, 10**9):
            end_us = min(begin_us + length_us, 2 * HOUR_US)
            times, first = clock.events_between(begin_us, end_us)
            low = np.searchsorted(expected, begin_us)
            assert first == low
            assert np.array_equal(times, expected[low : np.searchsorted(expected, end_us)])


def test_a_day_of_a_clock_takes_little_memory(section):
    clock = clock_of(section.beacons[0], until_us=24 * HOUR_US)
    # Some 240 000 events; all their times would take 2 MB.
    assert clock.kept_us.nbytes < 20_000
    times, first = clock.events_between(23 * HOUR_US, 24 * HOUR_US)
    assert first == pytest.approx(23 * 3600 / 0.355, rel=1e-3)
    assert len(times) == pytest.approx(3600 / 0.355, rel=1e-3)
