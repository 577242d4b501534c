import numpy as np
import pytest
from scipy import stats

from blesim.radio.shadowing import ShadowField, Shadowing


def level_db(field: ShadowField, x_m: np.ndarray, y_m: np.ndarray) -> np.ndarray:
    out = np.zeros(len(x_m))
    field.add_to(x_m, y_m, out)
    return out


SHADOWING = Shadowing(standard_deviation_db=4.5, decorrelation_m=1.25)


def fields(count: int, shadowing: Shadowing = SHADOWING) -> list[ShadowField]:
    return [ShadowField.draw(shadowing, 5, f"beacon {number}") for number in range(count)]


def test_level_is_gaussian_with_the_configured_spread():
    here = np.array([3.0]), np.array([4.0])
    levels = np.array([level_db(field, *here)[0] for field in fields(2000)])
    # False alarm 1e-4; the sum of 128 waves is Gaussian far beyond what 2000 samples resolve.
    assert stats.kstest(levels / 4.5, "norm").pvalue > 1e-4


@pytest.mark.parametrize("apart_m", [0.25, 1.25, 3.0])
def test_correlation_falls_exponentially_with_distance(apart_m):
    ends = np.array([0.0, apart_m]), np.zeros(2)
    pairs = np.array([level_db(field, *ends) for field in fields(4000)])
    expected = np.exp(-apart_m / 1.25)
    # Standard error of a correlation of 4000 pairs is below 0.016; four of them.
    assert np.corrcoef(pairs.T)[0, 1] == pytest.approx(expected, abs=0.064)


def test_correlation_is_the_same_in_every_direction():
    angle = np.linspace(0, np.pi, 5, endpoint=False)
    places = np.append(np.cos(angle), 0.0), np.append(np.sin(angle), 0.0)
    levels = np.array([level_db(field, *places) for field in fields(4000)])
    correlation = np.corrcoef(levels.T)[:-1, -1]
    assert correlation == pytest.approx(np.full(5, np.exp(-1 / 1.25)), abs=0.064)


def test_beacons_are_shadowed_independently():
    along = np.arange(0, 4000, 10.0), np.zeros(400)
    one, two = (level_db(field, *along) for field in fields(2))
    assert abs(np.corrcoef(one, two)[0, 1]) < 4 / np.sqrt(400)


def test_a_field_is_a_place_not_a_draw():
    (field,) = fields(1)
    x_m, y_m = np.array([1.0, 7.0]), np.array([2.0, 7.0])
    assert np.array_equal(level_db(field, x_m, y_m)[::-1], level_db(field, x_m[::-1], y_m[::-1]))


def test_no_spread_is_no_shadowing():
    (field,) = fields(1, Shadowing(standard_deviation_db=0.0))
    assert level_db(field, np.arange(3.0), np.arange(3.0)).tolist() == [0, 0, 0]


@pytest.mark.parametrize("correlation", [0.0, 0.5, 1.0])
def test_beacons_are_correlated_as_configured(correlation):
    shadowing = Shadowing(standard_deviation_db=4.5, beacon_correlation=correlation)
    along = np.arange(0, 40000, 10.0), np.zeros(4000)
    one, two = (level_db(field, *along) for field in fields(2, shadowing))
    # 4000 places ten metres apart are independent: standard error below 0.016; four of them.
    assert np.corrcoef(one, two)[0, 1] == pytest.approx(correlation, abs=0.064)
    assert one.std() == pytest.approx(4.5, rel=0.1)
