import numpy as np
import pytest
from scipy.special import j0

from blesim.radio.fading import Fading, MultipathField


def fields(count, channel=37, **settings):
    return [MultipathField.draw(Fading(**settings), 5, f"b{n}", channel) for n in range(count)]


def levels_db(fields_, x_m):
    x_m = np.asarray(x_m, dtype=float)
    return np.array([field.at_db(x_m, np.zeros(len(x_m)), 5.0 + x_m) for field in fields_])


def test_mean_level_is_zero_decibels():
    for rice_factor_db in (-30.0, 0.0, 6.0):
        levels = levels_db(fields(3000, rice_factor_db=rice_factor_db), [0.0])
        # Spread at most 5.6 dB: the standard error of the mean is 0.1; four of them.
        assert levels.mean() == pytest.approx(0.0, abs=0.4)


@pytest.mark.parametrize(("rice_factor_db", "spread_db"), [(-30.0, 5.57), (3.0, 4.2), (10.0, 2.0)])
def test_spread_falls_with_the_rice_factor(rice_factor_db, spread_db):
    # Rayleigh: pi/sqrt(6) * 10/ln(10) = 5.57 dB; eight waves in place of many cost a few per cent.
    # Rician: by numerical integration of the noncentral chi-squared density.
    levels = levels_db(fields(4000, rice_factor_db=rice_factor_db), [0.0])
    assert levels.std() == pytest.approx(spread_db, rel=0.12)


def test_scattered_field_decorrelates_over_half_a_wavelength():
    apart_m = np.array([0.0, 0.01, 0.02, 0.05])
    power = 10 ** (levels_db(fields(6000, rice_factor_db=-30.0), apart_m) / 10)
    correlation = np.corrcoef(power.T)[0, 1:]
    # Clarke: J0 squared; standard error 0.013 and the few waves.
    assert correlation == pytest.approx(j0(2 * np.pi * apart_m[1:] / 0.1248) ** 2, abs=0.08)


@pytest.mark.parametrize("place_m", [0.0, 7.3])
@pytest.mark.parametrize("wanted", [0.0, 0.36, 1.0])
def test_channels_are_correlated_as_configured_wherever_the_phone_is(wanted, place_m):
    settings = {"rice_factor_db": -30.0, "channel_correlation": wanted}
    power = [10 ** (levels_db(fields(6000, c, **settings), [place_m]) / 10) for c in (37, 39)]
    correlation = np.corrcoef(power[0][:, 0], power[1][:, 0])[0, 1]
    # The power of a field of which a part is shared correlates by the square of that part.
    assert correlation == pytest.approx(wanted, abs=0.1)


def test_a_strong_steady_part_leaves_a_level_line():
    assert levels_db(fields(50, rice_factor_db=60.0), np.linspace(0, 3, 30)).std() < 0.05


def test_gaussian_fading_belongs_to_packets():
    deviates = np.array([-1.0, 0.0, 2.0])
    assert Fading(model="gaussian", standard_deviation_db=3.0).of_packets_db(deviates).tolist() == [
        -3,
        0,
        6,
    ]
    assert not Fading(model="none").of_packets_db(deviates).any()
    assert not Fading(model="rician").of_packets_db(deviates).any()
