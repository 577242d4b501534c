import numpy as np
import pytest

from blesim.fidelity.path_fit import fit_path


def test_a_known_law_comes_back():
    rng = np.random.default_rng(7)
    distance_m = rng.uniform(1.0, 20.0, 4000)
    crossings = rng.integers(0, 4, (4000, 2)).astype(float)
    rssi = -60 - 10 * 1.7 * np.log10(distance_m) - crossings @ [1.5, 2.0] + rng.normal(0, 4, 4000)
    fit = fit_path(distance_m, rssi, crossings)
    assert fit.level_dbm == pytest.approx(-60.0, abs=1.0)
    assert fit.exponent == pytest.approx(1.7, abs=0.1)
    assert fit.loss_db == pytest.approx([1.5, 2.0], abs=0.2)
    assert fit.deviation_db == pytest.approx(4.0, abs=0.15)


def test_an_obstacle_left_out_goes_into_the_exponent():
    rng = np.random.default_rng(8)
    distance_m = rng.uniform(1.0, 20.0, 4000)
    between = np.floor(distance_m / 2.0)[:, None]
    rssi = -60 - 10 * 2.0 * np.log10(distance_m) - 1.5 * between[:, 0]
    assert fit_path(distance_m, rssi).exponent > 2.5
    assert fit_path(distance_m, rssi, between).exponent == pytest.approx(2.0)


def test_an_obstacle_that_is_never_crossed_has_no_loss():
    distance_m = np.arange(1.0, 21.0)
    crossings = np.stack([np.arange(20) % 2, np.zeros(20)], axis=1).astype(float)
    fit = fit_path(distance_m, -60 - 20 * np.log10(distance_m) - 3 * crossings[:, 0], crossings)
    assert fit.loss_db[0] == pytest.approx(3.0)
    assert np.isnan(fit.loss_db[1])


@pytest.mark.parametrize("distances", [[2.0, 3.0, 4.0], [5.0] * 10])
def test_too_little_to_fit_is_not_a_number(distances):
    fit = fit_path(np.array(distances), np.full(len(distances), -70.0))
    assert np.isnan([fit.level_dbm, fit.exponent, fit.deviation_db]).all()
