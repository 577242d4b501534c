import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.optimize import curve_fit

from blesim.errors import UsageError
from blesim.ranging.lateration import Outcome, laterate
from blesim.ranging.path_loss_fit import fit_path_loss
from blesim.ranging.smoothers import Smoothing

BEACONS_M = np.array([[0, 0, 2.5], [10, 0, 2.5], [10, 8, 2.0], [0, 8, 2.0]], float)
HEIGHT_M = 1.0


def ranges_m(place_m, beacons_m=BEACONS_M, height_m=HEIGHT_M):
    return np.linalg.norm(np.array([*place_m, height_m]) - beacons_m, axis=1)


def fixed(range_m, beacons_m=BEACONS_M, **settings):
    return laterate(beacons_m, np.asarray(range_m, float), phone_height_m=HEIGHT_M, **settings)


def test_a_right_angle_worked_by_hand():
    # At (3, 4), at the beacons' height: 5 m from (0, 0), 4 from (3, 0), 3 from (0, 4).
    beacons_m = np.array([[0, 0, 1.0], [3, 0, 1.0], [0, 4, 1.0]])
    fix = fixed([5, 4, 3], beacons_m)
    assert_allclose([fix.x_m, fix.y_m], [3, 4], atol=1e-6)
    assert fix.outcome == Outcome.DETERMINED
    assert fix.residual_m < 1e-6


@given(st.floats(0.5, 9.5), st.floats(0.5, 7.5))
def test_exact_ranges_give_the_place(x_m, y_m):
    fix = fixed(ranges_m((x_m, y_m)))
    assert_allclose([fix.x_m, fix.y_m], [x_m, y_m], atol=1e-5)


@pytest.mark.parametrize("spread_m", [None, np.array([0.5, 1.0, 2.0, 1.5])])
def test_agrees_with_curve_fit(spread_m):
    rng = np.random.default_rng(6)
    measured_m = ranges_m((4, 3)) + rng.normal(0, 0.7, 4)

    def model(_, x_m, y_m):
        return ranges_m((x_m, y_m))

    known = spread_m is not None
    place_m, covariance_m2 = curve_fit(
        model, np.arange(4), measured_m, p0=(5, 4), sigma=spread_m, absolute_sigma=known, xtol=1e-12
    )
    fix = fixed(measured_m, spread_m=spread_m)
    assert_allclose([fix.x_m, fix.y_m], place_m, atol=1e-5)
    assert_allclose(fix.covariance_m2, covariance_m2, rtol=1e-4)


def test_the_covariance_is_that_of_many_fixes():
    # 2000 fixes: a variance is known to 3 %; 15 % are five standard errors, 6e-7, and curvature.
    rng = np.random.default_rng(7)
    spread_m = np.array([0.2, 0.2, 0.5, 0.5])
    truth_m = ranges_m((6, 3))
    found = [fixed(truth_m + rng.normal(0, spread_m), spread_m=spread_m) for _ in range(2000)]
    spread_m2 = np.cov([[fix.x_m, fix.y_m] for fix in found], rowvar=False)
    claimed_m2 = fixed(truth_m, spread_m=spread_m).covariance_m2
    assert_allclose(np.diag(spread_m2), np.diag(claimed_m2), rtol=0.15)


def test_good_ranges_weigh_more():
    measured_m = ranges_m((4, 3)) + np.array([0, 0, 0, 3.0])
    alike = fixed(measured_m)
    weighted = fixed(measured_m, spread_m=np.array([0.1, 0.1, 0.1, 10.0]))
    assert np.hypot(weighted.x_m - 4, weighted.y_m - 3) < 0.01
    assert np.hypot(alike.x_m - 4, alike.y_m - 3) > 0.3


def test_soft_loss_minds_one_bad_range_less():
    beacons_m = np.vstack([BEACONS_M, [[5, 0, 2.0], [5, 8, 2.0]]])
    measured_m = ranges_m((4, 3), beacons_m) + np.array([0, 0, 0, 0, 0, 9.0])
    far_m = [
        np.hypot(fix.x_m - 4, fix.y_m - 3)
        for fix in (fixed(measured_m, beacons_m, loss=loss) for loss in ("linear", "soft_l1"))
    ]
    assert far_m[1] < 0.5 * far_m[0]


def test_beacons_without_a_range_are_left_out():
    fix = fixed([*ranges_m((4, 3))[:3], np.nan])
    assert_allclose([fix.x_m, fix.y_m], [4, 3], atol=1e-5)
    assert fix.outcome == Outcome.DETERMINED


@pytest.mark.parametrize("side", [1, -1])
def test_beacons_on_a_line_give_the_side_of_the_start(side):
    beacons_m = np.array([[0, 0, 2.0], [5, 0, 2.0], [10, 0, 2.0]])
    fix = fixed(ranges_m((4, 3), beacons_m), beacons_m, start_xy_m=np.array([5.0, side]))
    assert fix.outcome == Outcome.MIRRORED
    assert_allclose([fix.x_m, fix.y_m], [4, 3 * side], atol=1e-5)


def test_on_a_line_without_a_start_the_left_side_is_taken():
    beacons_m = np.array([[0, 0, 2.0], [5, 0, 2.0], [10, 0, 2.0]])
    fix = fixed(ranges_m((4, 3), beacons_m), beacons_m)
    assert_allclose([fix.x_m, fix.y_m], [4, 3], atol=1e-5)


def test_on_the_line_itself_the_way_across_is_not_known():
    beacons_m = np.array([[0, 0, 2.0], [5, 0, 2.0], [10, 0, 2.0]])
    measured_m = ranges_m((4, 0), beacons_m) - 0.2
    fix = fixed(measured_m, beacons_m, spread_m=np.full(3, 0.1))
    assert fix.outcome == Outcome.MIRRORED
    assert abs(fix.y_m) < 0.3
    assert fix.covariance_m2[0, 0] < 0.1
    assert_allclose(fix.covariance_m2[1, 1], np.mean(measured_m**2))


def test_two_ranges_give_the_weighted_middle():
    # Weights 1/2 and 1/6: a quarter of the way; variance (3/4 * 3 + 1/4 * 35) / 2 = 5.5.
    beacons_m = np.array([[0, 0, 2.0], [8, 4, 2.0]])
    fix = fixed([2, 6], beacons_m)
    assert fix.outcome == Outcome.CENTROID
    assert_allclose([fix.x_m, fix.y_m], [2, 1])
    assert_allclose(fix.covariance_m2, 5.5 * np.eye(2))


def test_no_range_gives_nothing():
    for fix in (fixed([np.nan] * 4), fixed([], np.empty((0, 3)))):
        assert fix.outcome == Outcome.NOTHING
        assert np.isnan([fix.x_m, fix.y_m, *fix.covariance_m2.ravel()]).all()


def test_three_ranges_to_one_place_do_not_break_it():
    beacons_m = np.array([[2, 2, 2.0]] * 3)
    fix = fixed([3, 3, 3], beacons_m, spread_m=np.ones(3))
    assert fix.outcome == Outcome.MIRRORED
    assert np.isfinite(fix.covariance_m2).all()
    assert_allclose(np.hypot(fix.x_m - 2, fix.y_m - 2), np.sqrt(8), rtol=1e-4)


@given(st.lists(st.floats(0, 60), min_size=4, max_size=4))
def test_whatever_the_ranges_there_is_a_sound_answer(range_m):
    fix = fixed(range_m)
    assert np.isfinite([fix.x_m, fix.y_m]).all()
    assert np.all(np.linalg.eigvalsh(fix.covariance_m2) > 0)


def test_walks_through_the_real_hall(hall):
    # Measured before, log-distance grid likelihood, the nearest kin: median 2.34 m, mean 2.71 m.
    # One fix in ten readings; the beacon was carried at 1.75 m and surveyed at 1.85 m.
    model = fit_path_loss(hall.survey, hall.survey.distance_m(hall.venue, 1.85))
    curve = model.of(np.arange(12), np.zeros(12, np.int64))
    errors_m = []
    for readings, truth in hall.walks:
        signals_dbm = Smoothing(last=5).start(12).signals(readings)
        for row in range(0, len(readings), 10):
            range_m = curve.distance_m(signals_dbm[row])
            spread_m = np.where(np.isnan(range_m), 1.0, curve.distance_spread_m(range_m))
            fix = laterate(hall.venue.beacon_xyz_m, range_m, phone_height_m=1.75, spread_m=spread_m)
            errors_m.append(np.hypot(fix.x_m - truth.x_m[row], fix.y_m - truth.y_m[row]))
    assert np.median(errors_m) < 2.34
    assert np.mean(errors_m) < 2.71


def test_bad_calls_are_refused():
    with pytest.raises(UsageError, match="3 beacons"):
        fixed([1, 2, 3])
    with pytest.raises(UsageError, match="negative"):
        fixed([1, 2, 3, -1])
    with pytest.raises(UsageError, match="not positive"):
        fixed([1, 2, 3, 4], spread_m=np.zeros(4))
    with pytest.raises(UsageError, match="linear, soft_l1"):
        fixed([1, 2, 3, 4], loss="cauchy")
