import numpy as np
import pytest

from blesim.fidelity.correlation import (
    autocorrelation,
    channel_correlation,
    correlation_between_places,
    decay_time_s,
)


def autoregressive(rng, step_s, memory_s, count):
    kept = np.exp(-step_s / memory_s)
    values = rng.standard_normal(count)
    for row in range(1, count):
        values[row] = kept * values[row - 1] + np.sqrt(1 - kept**2) * values[row]
    return values


def test_an_autoregressive_link_has_its_memory():
    rng = np.random.default_rng(1)
    time_s = np.arange(40_000) * 0.1
    values = autoregressive(rng, 0.1, 2.0, len(time_s))
    assert autocorrelation(time_s, values, 0.95, 1.05) == pytest.approx(np.exp(-0.5), abs=0.04)
    # Noise of the receiver belongs to lag 0 alone and does not shorten the memory.
    noisy = values + 0.5 * rng.standard_normal(len(time_s))
    assert decay_time_s(time_s, noisy, 0.25, 10.0) == pytest.approx(2.0, rel=0.1)


def test_white_readings_have_no_memory():
    rng = np.random.default_rng(2)
    time_s = np.cumsum(rng.uniform(0.05, 0.15, 5000))
    values = rng.standard_normal(5000)
    assert abs(autocorrelation(time_s, values, 0.4, 0.6)) < 0.03


def test_pairs_at_irregular_times_are_all_found():
    time_s = np.array([0.0, 0.4, 1.0, 1.5, 9.0])
    values = np.array([1.0, -1.0, 1.0, -1.0, 0.0])
    assert np.isnan(autocorrelation(time_s, values, 0.3, 0.7))
    often = np.concatenate([time_s + 100.0 * number for number in range(8)])
    # 0-0.4, 0.4-1.0, 1.0-1.5: each pair a +1 and a -1, over a variance of 0.8.
    assert autocorrelation(often, np.tile(values, 8), 0.3, 0.7) == pytest.approx(-1 / 0.8)


def test_a_constant_link_has_no_correlation():
    time_s = np.arange(100.0)
    assert np.isnan(autocorrelation(time_s, np.full(100, -70.0), 0.5, 1.5))
    assert np.isnan(decay_time_s(time_s, np.full(100, -70.0), 1.0, 10.0))


def test_places_nearby_are_alike_and_far_ones_are_not():
    rng = np.random.default_rng(3)
    places_m = rng.uniform(0.0, 40.0, (400, 2))
    apart_m = np.linalg.norm(places_m[:, None] - places_m[None], axis=2)
    field = np.linalg.cholesky(np.exp(-apart_m / 2.0) + 1e-9 * np.eye(400))
    found = np.array(
        [
            [
                correlation_between_places(places_m, field @ rng.standard_normal(400), *limits)
                for limits in ((0.9, 1.1), (7.0, 9.0))
            ]
            for _ in range(40)
        ]
    ).mean(axis=0)
    assert found == pytest.approx([np.exp(-0.5), np.exp(-4.0)], abs=0.06)


def test_channels_are_paired_by_time():
    rng = np.random.default_rng(4)
    time_s = np.arange(2000) * 0.1
    shared = rng.standard_normal(2000)
    one = shared + rng.standard_normal(2000)
    other = shared + rng.standard_normal(2000)
    kept = rng.uniform(size=2000) < 0.5
    later_s, later = time_s[kept] + 0.002, other[kept]
    assert channel_correlation((time_s, later_s), (one, later), 0.01) == pytest.approx(0.5, abs=0.1)
    assert np.isnan(channel_correlation((time_s, later_s + 0.05), (one, later), 0.01))
