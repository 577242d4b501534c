import numpy as np
import pytest

from blesim.fidelity.levels import (
    drift_db,
    explained_share,
    level_deviation_db,
    level_noise_db,
    level_spread_db,
    three_levels,
)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def three_level_link(rng: np.random.Generator, noise_db: float) -> np.ndarray:
    levels = rng.choice([-80.0, -72.0, -66.0], 3000)
    return levels + rng.normal(0.0, noise_db, len(levels))


def test_a_link_of_three_levels_gives_them_back(rng):
    rssi = three_level_link(rng, 0.5)
    assert three_levels(rssi).centre_dbm == pytest.approx([-80, -72, -66], abs=0.1)
    assert level_spread_db(rssi) == pytest.approx(14.0, abs=0.2)
    assert level_deviation_db(rssi) == pytest.approx(np.std([-80, -72, -66]), abs=0.1)
    assert level_noise_db(rssi) == pytest.approx(0.5, abs=0.03)
    assert explained_share(rssi) > 0.99


def test_three_levels_explain_81_percent_of_a_gaussian(rng):
    # The best three-point quantiser of a normal leaves 0.1902 of its variance (Max, 1960).
    assert explained_share(np.round(rng.normal(-70.0, 4.0, 20_000), 1)) == pytest.approx(
        0.81, abs=0.01
    )


def test_the_split_is_the_best_of_all(rng):
    rssi = np.rint(rng.normal(-70.0, 4.0, 40))
    values = np.unique(rssi)
    best = min(
        sum(np.sum((part - part.mean()) ** 2) for part in (rssi[rssi < a], middle, rssi[rssi >= b]))
        for i, a in enumerate(values[1:-1], start=1)
        for b in values[i + 1 :]
        if len(middle := rssi[(rssi >= a) & (rssi < b)])
    )
    levels = three_levels(rssi)
    assert np.sum((rssi - levels.centre_dbm[levels.member]) ** 2) == pytest.approx(best)


def test_fewer_than_three_values_are_their_own_levels():
    assert three_levels(np.array([-70.0, -70.0])).centre_dbm.tolist() == [-70.0]
    assert np.isnan(explained_share(np.array([-70.0, -70.0])))
    assert level_spread_db(np.array([-70.0, -75.0])) == 5.0


def test_drift_is_what_a_link_moves_from_minute_to_minute(rng):
    time_s = np.arange(0.0, 600.0, 0.45)
    still = three_level_link(rng, 0.4)[: len(time_s)]
    swing_db = 1.5 * np.sin(2 * np.pi * time_s / 300.0)
    assert drift_db(time_s, still, 60.0) < 0.1
    assert drift_db(time_s, still + swing_db, 60.0) > 0.5
    assert np.isnan(drift_db(time_s[:200], still[:200], 60.0))
