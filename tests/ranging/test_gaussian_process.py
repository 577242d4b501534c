import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.distance import cdist
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

from blesim.errors import UsageError
from blesim.ranging.gaussian_process import GaussianProcessFill, filled_radio_map
from blesim.ranging.radio_map import MapLayout, RadioMap

RNG = np.random.default_rng(11)
PLACES_M = RNG.uniform(0, 20, (60, 2))
BEACONS_M = np.array([[2.0, 2.0], [18.0, 10.0]])


def field_dbm(places_m):
    """A smooth field: log-distance from 3 m below the beacons."""
    return -60 - 20 * np.log10(np.hypot(cdist(places_m, BEACONS_M), 3.0))


def surveyed(mean_dbm, places_m=PLACES_M, direction=-1, missing_dbm=-100.0):
    count = np.where(np.isnan(mean_dbm), 0, 10)
    return RadioMap(
        layout=MapLayout(missing_dbm=missing_dbm),
        x_m=places_m[:, 0].copy(),
        y_m=places_m[:, 1].copy(),
        level=np.zeros(len(places_m), np.int64),
        direction=np.array(np.broadcast_to(direction, len(places_m)), np.int64),
        mean_dbm=np.array(mean_dbm),
        spread_db=np.zeros(mean_dbm.shape),
        count=count,
    )


@pytest.mark.parametrize("kernel", ["squared exponential", "matern"])
def test_a_smooth_field_is_found_between_the_places(kernel):
    points_m = RNG.uniform(2, 18, (200, 2))
    found = filled_radio_map(
        surveyed(field_dbm(PLACES_M)), points_m, 0, GaussianProcessFill(kernel=kernel)
    )
    left_db = found.mean_dbm - field_dbm(points_m)
    # The field itself spreads by 4 dB.
    assert np.sqrt(np.mean(left_db**2)) < 0.5
    assert found.count.sum() == 0
    assert_array_equal(found.x_m, points_m[:, 0])


def test_prediction_agrees_with_the_textbook_formula():
    # Rasmussen and Williams, Eq 2.25 and 2.26, with the parameters that the fill arrived at.
    from sklearn.gaussian_process import GaussianProcessRegressor

    noisy_dbm = field_dbm(PLACES_M)[:, :1] + RNG.normal(0, 1, (60, 1))
    points_m = RNG.uniform(0, 20, (5, 2))
    found = filled_radio_map(surveyed(noisy_dbm), points_m, 0, GaussianProcessFill())
    kernel = ConstantKernel(1.0, (1e-2, 1e2)) * RBF(3.0, (0.5, 100.0)) + WhiteKernel(0.1, (1e-6, 1))
    learned = GaussianProcessRegressor(kernel, normalize_y=True).fit(PLACES_M, noisy_dbm[:, 0])
    amplitude, length_m, noise = np.exp(learned.kernel_.theta)
    mean, deviation = noisy_dbm.mean(), noisy_dbm.std()

    def covariance(a, b):
        return amplitude * np.exp(-cdist(a, b, "sqeuclidean") / (2 * length_m**2))

    inverse = np.linalg.inv(covariance(PLACES_M, PLACES_M) + (noise + 1e-10) * np.eye(60))
    across = covariance(points_m, PLACES_M)
    expected = across @ inverse @ ((noisy_dbm[:, 0] - mean) / deviation) * deviation + mean
    variance = amplitude + noise - np.einsum("ij,jk,ik->i", across, inverse, across)
    assert_allclose(found.mean_dbm[:, 0], expected, rtol=1e-6)
    assert_allclose(found.spread_db[:, 0], np.sqrt(variance) * deviation, rtol=1e-5)


def test_the_spread_grows_away_from_the_survey():
    points_m = np.array([[10.0, 10.0], [60.0, 60.0]])
    noisy_dbm = field_dbm(PLACES_M) + RNG.normal(0, 1, (60, 2))
    spread_db = filled_radio_map(surveyed(noisy_dbm), points_m, 0, GaussianProcessFill()).spread_db
    assert np.all(spread_db[1] > spread_db[0])


def test_silence_makes_a_beacon_weak_where_it_was_not_heard():
    mean_dbm = field_dbm(PLACES_M)
    mean_dbm[mean_dbm < -82] = np.nan
    silent_m = np.array([[19.0, 19.0]])
    weak = filled_radio_map(surveyed(mean_dbm), silent_m, 0, GaussianProcessFill())
    out = filled_radio_map(surveyed(mean_dbm), silent_m, 0, GaussianProcessFill(silence="left out"))
    assert weak.mean_dbm[0, 0] < -90 < out.mean_dbm[0, 0]
    assert weak.mean_dbm.min() >= -100


def test_a_beacon_heard_at_two_places_stays_missing():
    mean_dbm = field_dbm(PLACES_M)
    mean_dbm[2:, 1] = np.nan
    found = filled_radio_map(surveyed(mean_dbm), PLACES_M[:4], 0, GaussianProcessFill())
    assert np.isnan(found.mean_dbm[:, 1]).all()
    assert np.isfinite(found.mean_dbm[:, 0]).all()
    assert found.fingerprints_dbm[:, 1].tolist() == [-100] * 4


def test_directions_are_filled_apart():
    direction = np.arange(60) % 2
    shifted_dbm = field_dbm(PLACES_M) - 10.0 * direction[:, None]
    points_m = RNG.uniform(4, 16, (50, 2))
    fill = GaussianProcessFill()
    found = filled_radio_map(surveyed(shifted_dbm, direction=direction), points_m, 0, fill)
    apart_db = found.facing(0).mean_dbm - found.facing(1).mean_dbm
    assert np.median(apart_db) == pytest.approx(10.0, abs=0.5)


def test_the_same_survey_gives_the_same_bytes():
    points_m = RNG.uniform(0, 20, (30, 2))
    first, second = (
        filled_radio_map(surveyed(field_dbm(PLACES_M)), points_m, 0, GaussianProcessFill())
        for _ in range(2)
    )
    assert first.mean_dbm.tobytes() == second.mean_dbm.tobytes()


def test_of_many_places_a_bounded_number_is_used():
    places_m = RNG.uniform(0, 20, (1000, 2))
    mean_dbm = field_dbm(places_m)
    mean_dbm[np.arange(1000) % 5 > 0, 1] = np.nan
    fill = GaussianProcessFill(most_learned=40, most_places=100, silence="left out")
    found = filled_radio_map(surveyed(mean_dbm, places_m), PLACES_M, 0, fill)
    assert np.sqrt(np.mean((found.mean_dbm - field_dbm(PLACES_M)) ** 2)) < 1.0


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"kernel": "linear"}, "squared exponential, matern"),
        ({"silence": "golden"}, "weak, left out"),
        ({"length_m": 0.1}, "length_m 0.1"),
        ({"most_learned": 2}, "most_learned 2"),
        ({"most_learned": 20, "most_places": 10}, "in this order"),
    ],
)
def test_bad_settings_are_refused(wrong, says):
    with pytest.raises(UsageError, match=says):
        GaussianProcessFill(**wrong)


def test_a_level_without_survey_is_refused():
    with pytest.raises(UsageError, match="level 2"):
        filled_radio_map(surveyed(field_dbm(PLACES_M)), PLACES_M, 2, GaussianProcessFill())
