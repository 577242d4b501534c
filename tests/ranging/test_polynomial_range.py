import numpy as np
import pytest
from numpy.testing import assert_allclose

from blesim.errors import DataError, UsageError
from blesim.ranging.polynomial_range import fit_polynomial_ranges, polynomial_fit

RSSI_DBM = np.arange(-95.0, -55.0)


def surveyed(seed=5, count=600):
    rng = np.random.default_rng(seed)
    distance_m = rng.uniform(1.0, 20.0, count)
    rssi_dbm = np.rint(-62 - 18 * np.log10(distance_m) + rng.normal(0, 3, count))
    return distance_m, rssi_dbm


def test_a_parabola_worked_by_hand():
    # d = 10 + (RSS + 90) / 2 + (RSS + 90)^2 / 10 -> c_0 = 865, c_1 = 18.5, c_2 = 0.1.
    distance_m = 10 + (RSSI_DBM + 90) / 2 + (RSSI_DBM + 90) ** 2 / 10
    fit = polynomial_fit(distance_m, RSSI_DBM, degree=2)
    assert_allclose(fit.coefficients(), [865, 18.5, 0.1], rtol=1e-9)
    assert_allclose(fit.distance_m(RSSI_DBM), distance_m, rtol=1e-9)
    assert fit.spread_m < 1e-9


@pytest.mark.parametrize("degree", [0, 1, 2, 3, 4, 5])
def test_agrees_with_numpy_polyfit(degree):
    distance_m, rssi_dbm = surveyed()
    fit = polynomial_fit(distance_m, rssi_dbm, degree=degree)
    # NumPy's own fit is made about the middle too, or its powers would be nearly collinear.
    expected = np.polyval(np.polyfit(rssi_dbm + 75, distance_m, degree), rssi_dbm + 75)
    assert_allclose(fit.distance_m(rssi_dbm), np.maximum(expected, 0), atol=1e-7)
    left_m = distance_m - expected
    assert_allclose(fit.spread_m**2, np.sum(left_m**2) / (600 - degree - 1))


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_normal_equations_of_the_paper(degree):
    # Eq 9, C = A^-1 B, word by word in raw RSSI; conditioning allows it up to degree 3.
    distance_m, rssi_dbm = surveyed()
    powers = np.array(
        [[np.sum(rssi_dbm ** (i + j)) for j in range(degree + 1)] for i in range(degree + 1)]
    )
    right = np.array([np.sum(distance_m * rssi_dbm**i) for i in range(degree + 1)])
    fit = polynomial_fit(distance_m, rssi_dbm, degree=degree)
    assert_allclose(fit.coefficients(), np.linalg.solve(powers, right), rtol=1e-3)


def test_beyond_what_was_heard_the_curve_is_held_and_never_negative():
    # d = -(RSS + 80) / 2: 7.5 m at the weakest heard, -95; 0 from -80 on.
    fit = polynomial_fit(-(RSSI_DBM + 80) / 2, RSSI_DBM, degree=1)
    assert_allclose(fit.distance_m([-120.0, -95.0, -90.0, -60.0, -20.0]), [7.5, 7.5, 5, 0, 0])


def test_more_degrees_never_fit_worse():
    distance_m, rssi_dbm = surveyed()
    fits = [polynomial_fit(distance_m, rssi_dbm, degree=degree) for degree in range(6)]
    squares = [fit.spread_m**2 * (600 - fit.scaled.shape[0]) for fit in fits]
    assert np.all(np.diff(squares) <= 1e-9)


def test_too_few_values_for_the_degree_make_no_curve():
    three = np.array([-70.0, -70.0, -80.0, -90.0])
    assert polynomial_fit(np.arange(4.0), three, degree=2) is not None
    assert polynomial_fit(np.arange(4.0), three, degree=3) is None
    assert polynomial_fit(np.arange(4.0), np.full(4, -70.0), degree=0) is None
    with pytest.raises(UsageError, match="degree 10"):
        polynomial_fit(np.arange(4.0), three, degree=10)


def test_channels_and_beacons_have_polynomials_of_their_own(readings_at):
    distance_m, rssi_dbm = surveyed()
    channel = np.repeat([37, 38, 0], [300, 290, 10])
    beacon = np.repeat([0, 0, 1], [300, 290, 10])
    survey = readings_at(rssi_dbm, beacons=2, beacon=beacon, channel=channel)
    model = fit_polynomial_ranges(survey, distance_m)
    ask = np.array([-65.0, -75.0, -85.0])

    def distances(beacon, channel):
        return model.of(np.full(3, beacon), np.full(3, channel)).distance_m(ask)

    def fitted(rows):
        return polynomial_fit(distance_m[rows], rssi_dbm[rows], degree=2).distance_m(ask)

    assert_allclose(distances(0, 37), fitted(channel == 37))
    assert_allclose(distances(0, 38), fitted(channel == 38))
    assert_allclose(distances(0, 39), fitted(beacon == 0))
    assert_allclose(distances(0, 0), fitted(beacon == 0))
    assert_allclose(distances(1, 37), fitted(np.ones(600, bool)))
    assert model.rows.fallen_back.tolist() == [False, True]


def test_aggregate_knows_no_channels(readings_at):
    distance_m, rssi_dbm = surveyed()
    survey = readings_at(rssi_dbm, channel=np.repeat([37, 38], 300))
    model = fit_polynomial_ranges(survey, distance_m, by="beacon")
    curves = model.of(np.zeros(3, np.int64), np.array([0, 37, 38]))
    assert len(np.unique(curves.spread_m)) == 1


def test_no_polynomial_at_all_is_refused(readings_at):
    with pytest.raises(DataError, match="survey more places"):
        fit_polynomial_ranges(readings_at(np.full(9, -70.0)), np.arange(9.0))
    with pytest.raises(UsageError, match="degree -1"):
        fit_polynomial_ranges(readings_at(np.full(9, -70.0)), np.arange(9.0), degree=-1)
