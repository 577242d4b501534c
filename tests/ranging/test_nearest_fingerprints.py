import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from sklearn.neighbors import KNeighborsRegressor

from blesim.errors import DataError, UsageError
from blesim.ranging.gaussian_process import GaussianProcessFill, filled_radio_map
from blesim.ranging.nearest_fingerprints import (
    NO_FINGERPRINT,
    NearestFingerprints,
    SearchEllipse,
)
from blesim.ranging.radio_map import MapLayout, RadioMap
from blesim.ranging.radio_map import radio_map as real_map
from blesim.ranging.smoothers import Smoothing

NAN = np.nan


def radio_map(mean_dbm, places_m, level=0):
    mean_dbm = np.array(mean_dbm, np.float64)
    places_m = np.array(places_m, np.float64)
    count = len(places_m)
    return RadioMap(
        layout=MapLayout(),
        x_m=places_m[:, 0].copy(),
        y_m=places_m[:, 1].copy(),
        level=np.array(np.broadcast_to(level, count), np.int64),
        direction=np.full(count, -1),
        mean_dbm=mean_dbm,
        spread_db=np.zeros_like(mean_dbm),
        count=np.where(np.isnan(mean_dbm), 0, 1),
    )


# Four corners of a square of 4 m, two beacons.
CORNERS = radio_map(
    [[-60, -70], [-70, -60], [-64, -78], [-80, -80]], [[0, 0], [4, 0], [0, 4], [4, 4]]
)


def random_map(seed=1, places=500, beacons=12):
    rng = np.random.default_rng(seed)
    return radio_map(rng.uniform(-95, -55, (places, beacons)), rng.uniform(0, 50, (places, 2)))


def test_worked_by_hand():
    # Measured (-60, -74): ED = sqrt(16/2), sqrt((100 + 196)/2), sqrt((16 + 16)/2) -> 2.828,
    # 12.166, 4; the two nearest weigh 1/2.828 and 1/4.
    found = NearestFingerprints(radio_map=CORNERS, k=2).locate(np.array([[-60.0, -74.0]]))
    assert found.fingerprint.tolist() == [[0, 2]]
    assert_allclose(found.apart_db, [[np.sqrt(8), 4]])
    share = (1 / 4) / (1 / 4 + 1 / np.sqrt(8))
    assert_allclose([found.x_m[0], found.y_m[0]], [0, 4 * share])
    # Each place is a square of 4 m: 16/12; between the two, 16 p (1 - p).
    assert_allclose(found.variance_x_m2, 16 / 12)
    assert_allclose(found.variance_y_m2, 16 * share * (1 - share) + 16 / 12)
    assert_allclose(found.covariance_xy_m2, 0)


@pytest.mark.parametrize("k", [1, 3, 7])
def test_agrees_with_scikit_learn(k):
    surveyed = random_map()
    measured_dbm = np.random.default_rng(2).uniform(-95, -55, (200, 12))
    places_m = np.stack([surveyed.x_m, surveyed.y_m], axis=1)
    theirs = KNeighborsRegressor(k, weights="distance").fit(surveyed.mean_dbm, places_m)
    ours = NearestFingerprints(radio_map=surveyed, k=k).locate(measured_dbm)
    assert_allclose(np.stack([ours.x_m, ours.y_m], axis=1), theirs.predict(measured_dbm))
    apart_db, rows = theirs.kneighbors(measured_dbm)
    assert np.array_equal(ours.fingerprint, rows)
    # Eq 14 is the Euclidean distance over the root of the number of beacons.
    assert_allclose(ours.apart_db, apart_db / np.sqrt(12))


def test_an_exact_match_leaves_no_weight_to_others_as_in_scikit_learn():
    surveyed = random_map()
    measured_dbm = surveyed.mean_dbm[[17, 400]]
    found = NearestFingerprints(radio_map=surveyed, k=3).locate(measured_dbm)
    assert_allclose(found.x_m, surveyed.x_m[[17, 400]])
    assert found.fingerprint[:, 0].tolist() == [17, 400]
    assert np.all(found.apart_db[:, 0] == 0)


def test_only_heard_beacons_are_compared_unless_all_are():
    measured_dbm = np.array([[-62.0, NAN]])
    heard = NearestFingerprints(radio_map=CORNERS, k=1).locate(measured_dbm)
    # Of beacon 0 alone: 2 dB from the first and third corner; the first comes first.
    assert heard.fingerprint.tolist() == [[0]]
    assert_allclose(heard.apart_db, [[2]])
    # With -100 dBm for the silent beacon the third corner, -78, is the nearest.
    everything = NearestFingerprints(radio_map=CORNERS, k=1, compared="all").locate(measured_dbm)
    assert everything.fingerprint.tolist() == [[2]]
    assert_allclose(everything.apart_db, [[np.sqrt((4 + 22**2) / 2)]])


def test_a_beacon_missing_from_a_fingerprint_counts_as_weak():
    surveyed = radio_map([[-60, NAN], [-60, -95]], [[0, 0], [4, 0]])
    found = NearestFingerprints(radio_map=surveyed, k=2).locate(np.array([[-60.0, -96.0]]))
    assert found.fingerprint.tolist() == [[1, 0]]
    assert_allclose(found.apart_db, [[np.sqrt(1 / 2), np.sqrt(16 / 2)]])


@pytest.mark.parametrize("compared", ["heard", "all"])
def test_where_nothing_is_heard_there_is_no_position(compared):
    finder = NearestFingerprints(radio_map=CORNERS, compared=compared)
    found = finder.locate(np.array([[NAN, NAN], [-60.0, -70.0]]))
    assert found.fingerprint[0].tolist() == [NO_FINGERPRINT] * 3
    assert np.isnan([found.x_m[0], found.variance_x_m2[0], found.apart_db[0, 0]]).all()
    assert found.x_m[1] == 0.0


def test_fewer_places_than_k_are_all_used():
    found = NearestFingerprints(radio_map=CORNERS, k=6).locate(np.array([[-66.0, -71.0]]))
    assert sorted(found.fingerprint[0].tolist()) == [-1, -1, 0, 1, 2, 3]
    assert np.isnan(found.apart_db[0, 4:]).all()


def test_places_on_another_level_than_the_nearest_weigh_nothing():
    surveyed = radio_map([[-60], [-61], [-70]], [[0, 0], [10, 0], [2, 0]], level=[1, 0, 1])
    found = NearestFingerprints(radio_map=surveyed, k=3).locate(np.array([[-62.0]]))
    assert found.level.tolist() == [0]
    assert found.x_m.tolist() == [10]


def test_axes_of_the_ellipse_worked_by_hand():
    # Eigenvalues of [[5, 4], [4, 5]]: 9 and 1, along and across 45 degrees.
    covariance_m2 = np.array([[5.0, 4.0], [4.0, 5.0]])
    ellipse = SearchEllipse(x_m=0, y_m=0, covariance_m2=covariance_m2, scale=5, least_m=0)
    assert_allclose(ellipse.axes(), (15, 5, np.pi / 4))


@given(
    st.floats(0.1, 20),
    st.floats(0.1, 20),
    st.floats(-0.99, 0.99),
    st.floats(1, 6),
    st.integers(0, 9),
)
def test_the_ellipse_is_that_of_the_covariance(vx, vy, correlation, scale, seed):
    # Inside means a Mahalanobis distance up to s.
    c = correlation * np.sqrt(vx * vy)
    covariance_m2 = np.array([[vx, c], [c, vy]])
    ellipse = SearchEllipse(x_m=25, y_m=25, covariance_m2=covariance_m2, scale=scale, least_m=0)
    surveyed = random_map(seed, places=60, beacons=3)
    apart_m = np.stack([surveyed.x_m, surveyed.y_m], axis=1) - 25
    distance = np.sqrt(np.einsum("ni,ij,nj->n", apart_m, np.linalg.inv(covariance_m2), apart_m))
    inside = np.flatnonzero(distance <= scale)
    found = NearestFingerprints(radio_map=surveyed, k=60).locate(np.full((1, 3), -70.0), ellipse)
    rows = found.fingerprint[0][found.fingerprint[0] >= 0]
    assert sorted(rows) == (inside.tolist() if len(inside) else list(range(60)))


def test_a_filter_too_sure_of_itself_still_sees_its_neighbourhood():
    ellipse = SearchEllipse(x_m=4.5, y_m=0, covariance_m2=np.zeros((2, 2)), least_m=1.0)
    finder = NearestFingerprints(radio_map=CORNERS)
    found = finder.locate(np.array([[-60.0, -70.0]]), ellipse)
    assert found.fingerprint.tolist() == [[1, NO_FINGERPRINT, NO_FINGERPRINT]]


def test_an_empty_ellipse_means_the_whole_map():
    ellipse = SearchEllipse(x_m=90, y_m=90, covariance_m2=np.eye(2))
    finder, measured_dbm = NearestFingerprints(radio_map=CORNERS), np.array([[-61.0, -70.0]])
    assert finder.locate(measured_dbm, ellipse).x_m == finder.locate(measured_dbm).x_m


def test_the_spread_tells_the_error_where_the_map_is_noisy():
    # Fingerprints of a log-distance field with 4 dB of noise, k = 8: the covariance is meant to be
    # of the order of the squared error, within a factor of three either way.
    rng = np.random.default_rng(4)
    places_m = np.stack(np.meshgrid(np.arange(0, 30, 1.5), np.arange(0, 30, 1.5)), -1).reshape(
        -1, 2
    )
    beacons_m = rng.uniform(0, 30, (10, 2))

    def heard_dbm(at_m):
        away_m = np.hypot(*(at_m[:, None] - beacons_m[None]).transpose(2, 0, 1)) + 1
        return -60 - 20 * np.log10(away_m) + rng.normal(0, 4, away_m.shape)

    finder = NearestFingerprints(radio_map=radio_map(heard_dbm(places_m), places_m), k=8)
    true_m = rng.uniform(3, 27, (400, 2))
    found = finder.locate(heard_dbm(true_m))
    errors_m2 = (found.x_m - true_m[:, 0]) ** 2 + (found.y_m - true_m[:, 1]) ** 2
    claimed_m2 = found.variance_x_m2 + found.variance_y_m2
    assert 1 / 3 < errors_m2.mean() / claimed_m2.mean() < 3


@pytest.mark.parametrize("filled", [False, True])
def test_walks_through_the_real_hall(hall, filled):
    # Measured before, nearest fingerprints with k = 4: median 1.92 m, mean 2.20 m, 90 % 3.98 m.
    surveyed = real_map(hall.survey, MapLayout())
    if filled:
        grid_m = np.stack(np.meshgrid(np.arange(0.5, 20.6), np.arange(0.5, 17.6)), -1)
        surveyed = filled_radio_map(surveyed, grid_m.reshape(-1, 2), 0, GaussianProcessFill())
    finder, smoothing = NearestFingerprints(radio_map=surveyed, k=4), Smoothing(last=5)
    errors_m = []
    for readings, truth in hall.walks:
        found = finder.locate(smoothing.start(12).signals(readings))
        errors_m.append(np.hypot(found.x_m - truth.x_m, found.y_m - truth.y_m))
    errors_m = np.concatenate(errors_m)
    assert np.median(errors_m) < 1.92
    assert np.mean(errors_m) < 2.20
    assert np.quantile(errors_m, 0.9) < 3.98


def test_bad_calls_are_refused():
    with pytest.raises(UsageError, match="k 0"):
        NearestFingerprints(radio_map=CORNERS, k=0)
    with pytest.raises(UsageError, match="heard, all"):
        NearestFingerprints(radio_map=CORNERS, compared="some")
    with pytest.raises(DataError, match="empty"):
        NearestFingerprints(radio_map=CORNERS.rows(np.zeros(4, bool)))
    with pytest.raises(UsageError, match=r"give \(n, 2\)"):
        NearestFingerprints(radio_map=CORNERS).locate(np.array([-60.0, -70.0]))
