from dataclasses import replace

import numpy as np
import pytest

from blesim.errors import UsageError
from blesim.estimators.check import check_estimator
from blesim.estimators.practice import practice_venue
from blesim.estimators.weighted_centroid import WeightedCentroid
from blesim.recording import Observations
from blesim.rng import Draws
from blesim.tables import Readings
from blesim.venue.floor_plan import FloorPlan


def follow(estimator, venue, *rows):
    time_us, beacon, rssi_dbm = np.array(rows, np.int64).reshape(-1, 3).T
    readings = Readings(
        time_us=time_us, beacon=beacon, rssi_dbm=rssi_dbm, channel=np.zeros(len(rows))
    )
    tracker = estimator.fit(venue, ()).start(None, Draws(seed=1, purpose="test").generator())
    return tracker.advance(Observations(readings=readings))


def test_the_centroid_is_weighted_by_the_power():
    # Beacons 0 and 1 hang at (2, 0.5) and (6, 0.5). 10 dB are ten times the power: 10 to 1.
    track = follow(WeightedCentroid(), practice_venue(), (0, 0, -60), (100, 1, -70))
    assert track.x_m.tolist() == pytest.approx([2.0, (10 * 2 + 1 * 6) / 11])
    assert track.y_m.tolist() == pytest.approx([0.5, 0.5])


@pytest.mark.parametrize(("exponent", "weight"), [(0, 1), (0.5, 10**0.5), (2, 100)])
def test_the_exponent_is_that_of_the_power(exponent, weight):
    estimator = WeightedCentroid(exponent=exponent)
    track = follow(estimator, practice_venue(), (0, 0, -60), (100, 1, -70))
    assert track.x_m[-1] == pytest.approx((weight * 2 + 6) / (weight + 1))


def test_the_covariance_is_that_of_the_places_about_the_centroid():
    # Beacons 0 and 4, (2, 0.5) and (2, 7.5), equally strong: 3.5 m off the middle each; the squares
    # about beacons 4 m apart add 4^2 / 12.
    track = follow(WeightedCentroid(), practice_venue(), (0, 0, -60), (100, 4, -60))
    assert track.variance_x_m2[-1] == pytest.approx(16 / 12)
    assert track.variance_y_m2[-1] == pytest.approx(3.5**2 + 16 / 12)
    assert track.covariance_xy_m2[-1] == pytest.approx(0)


def test_places_along_a_diagonal_are_correlated():
    # Beacons 0 and 5, (2, 0.5) and (6, 7.5): 2 m and 3.5 m off the middle.
    track = follow(WeightedCentroid(), practice_venue(), (0, 0, -60), (100, 5, -60))
    assert track.covariance_xy_m2[-1] == pytest.approx(2 * 3.5)


def test_the_window_forgets_and_averages():
    silent = follow(WeightedCentroid(), practice_venue(), (0, 0, -60), (3_000_000, 1, -60))
    assert silent.x_m[-1] == 6.0
    rows = (0, 0, -60), (100, 1, -60), (200, 1, -80)
    averaged = follow(WeightedCentroid(rate=0.5), practice_venue(), *rows)
    # 0.5 * -80 + 0.5 * -60 = -70.
    assert averaged.x_m[-1] == pytest.approx((10 * 2 + 6) / 11)
    highest = follow(WeightedCentroid(signal="highest"), practice_venue(), *rows)
    assert highest.x_m[-1] == pytest.approx(4.0)


def test_beacons_of_other_levels_do_not_count():
    venue = practice_venue()
    first, second = venue.floor_plan.levels[0], replace(venue.floor_plan.levels[0], level=1)
    upstairs = venue.beacons[0].model_copy(update={"level": 1})
    plan, beacons = FloorPlan(levels=(first, second)), (upstairs, *venue.beacons[1:])
    venue = replace(venue, floor_plan=plan, beacons=beacons)
    track = follow(WeightedCentroid(), venue, (0, 0, -60), (100, 1, -70), (200, 1, -20))
    assert track.level.tolist() == [1, 1, 0]
    assert track.x_m.tolist() == [2.0, 2.0, 6.0]


def test_nothing_heard_and_beacons_of_others_give_no_estimate():
    assert len(follow(WeightedCentroid(), practice_venue())) == 0
    assert len(follow(WeightedCentroid(), practice_venue(), (0, 99, -60))) == 0
    assert len(follow(WeightedCentroid(), practice_venue().with_beacons(()), (0, 0, -60))) == 0


@pytest.mark.parametrize("wrong", [{"exponent": -1.0}, {"window_s": 0.0}, {"rate": 0.0}])
def test_bad_settings_are_refused(wrong):
    with pytest.raises(UsageError, match=next(iter(wrong))):
        WeightedCentroid(**wrong)


def test_it_asks_to_be_fitted():
    with pytest.raises(UsageError, match="call fit"):
        WeightedCentroid().start(None, Draws(seed=1, purpose="test").generator())


def test_other_settings_keep_the_contract():
    check_estimator(WeightedCentroid(exponent=0.4, signal="highest", window_s=0.5))
