from dataclasses import replace

import numpy as np
import pytest

from blesim.errors import UsageError
from blesim.estimators.believed_path_loss import PathLossBelief
from blesim.estimators.check import check_estimator
from blesim.estimators.lateration import Lateration
from blesim.estimators.practice import practice_recording, practice_venue
from blesim.estimators.run import surveys_of
from blesim.ranging.path_loss_fit import PathLossFit
from blesim.recording import Observations
from blesim.rng import Draws
from blesim.tables import Readings


def follow(estimator, venue, readings, surveys=()):
    rng = Draws(seed=1, purpose="test").generator()
    return estimator.fit(venue, surveys).start(None, rng).advance(Observations(readings=readings))


def noiseless(place_m, beacons, exponent=2.0, height_m=1.1):
    """One rounded reading of each of some practice beacons at a place, 100 us apart."""
    away_m = practice_venue().beacon_xyz_m[beacons] - [*place_m, height_m]
    rssi_dbm = -61.0 - 10 * exponent * np.log10(np.linalg.norm(away_m, axis=1))
    return Readings(
        time_us=np.arange(len(beacons)) * 100,
        beacon=np.array(beacons),
        rssi_dbm=np.rint(rssi_dbm).astype(int),
        channel=np.zeros(len(beacons)),
    )


@pytest.mark.parametrize("place_m", [(4.0, 4.0), (8.0, 2.0), (12.0, 6.0)])
def test_without_noise_the_error_is_that_of_rounding_to_one_db(place_m):
    readings = noiseless(place_m, [0, 1, 2, 3, 4, 5, 6, 7])
    track = follow(Lateration(), practice_venue(), readings)
    # Half a dB is 6 % of a range: some centimetres at each of several metres.
    assert np.hypot(track.x_m[-1] - place_m[0], track.y_m[-1] - place_m[1]) < 0.3
    assert len(track) == 8


def test_the_exponent_without_a_survey_is_the_one_given():
    readings = noiseless((5.0, 3.0), [0, 1, 2, 4, 5, 6], exponent=3.0)
    right = follow(Lateration(exponent=3.0), practice_venue(), readings)
    wrong = follow(Lateration(exponent=1.5), practice_venue(), readings)
    assert np.hypot(right.x_m[-1] - 5.0, right.y_m[-1] - 3.0) < 0.3
    assert np.hypot(wrong.x_m[-1] - 5.0, wrong.y_m[-1] - 3.0) > 1.0


def test_one_beacon_gives_its_own_place_as_unsure_as_it_is_far():
    readings = noiseless((2.0, 4.5), [0])
    track = follow(Lateration(), practice_venue(), readings)
    assert (track.x_m[0], track.y_m[0]) == (2.0, 0.5)
    # 4 m off on the map: r^2 / 2 on either axis; rounding is 6 % of the range.
    assert track.variance_x_m2[0] == pytest.approx(8.0, rel=0.15)


def test_more_spread_means_more_variance():
    readings = noiseless((5.0, 3.0), [0, 1, 4, 5])
    sure = follow(Lateration(spread_db=2.0), practice_venue(), readings)
    unsure = follow(Lateration(spread_db=6.0), practice_venue(), readings)
    # Weights all scale alike: the same fix, nine times the variance.
    assert unsure.x_m[-1] == pytest.approx(sure.x_m[-1], abs=1e-3)
    assert unsure.variance_x_m2[-1] == pytest.approx(9 * sure.variance_x_m2[-1], rel=1e-2)


def test_only_the_strongest_are_used():
    learned = Lateration(most=2).fit(practice_venue(), ()).ranging
    signal_dbm = np.array([-70.0, np.nan, -60.0, -80.0, -65.0, np.nan, np.nan, np.nan])
    assert learned.used(signal_dbm, 0).tolist() == [2, 4]
    assert learned.used(signal_dbm, 1).tolist() == []


def test_a_fix_stays_inside_the_level_and_ranges_are_no_longer_than_it():
    # Very weak readings of the three beacons in one corner would lead far away.
    readings = Readings(
        time_us=[0, 100, 200], beacon=[0, 1, 4], rssi_dbm=[-100, -127, -100], channel=[0, 0, 0]
    )
    track = follow(Lateration(), practice_venue(), readings)
    assert np.all((track.x_m >= 0) & (track.x_m <= 16) & (track.y_m >= 0) & (track.y_m <= 8))
    assert np.all(np.isfinite(track.variance_x_m2))


def test_the_survey_tells_the_curves():
    recording = practice_recording()
    belief = PathLossBelief(by="all", exponent=5.0, spread_db=20.0, phone_height_m=1.0)
    announced = belief.curves(recording.venue, ())
    assert np.all(announced.exponent == 5.0)
    assert np.all(announced.spread_db == 20.0)
    assert np.all(announced.level_dbm == -61.0)
    learned = belief.curves(recording.venue, surveys_of(recording))
    # Made with exponent 2, -61 dBm at a metre and 4 dB of noise, 320 readings.
    assert len(learned.exponent) == 8
    assert learned.exponent == pytest.approx(np.full(8, 2.0), abs=0.35)
    assert learned.level_dbm == pytest.approx(np.full(8, -61.0), abs=2.5)
    assert learned.spread_db == pytest.approx(np.full(8, 4.0), abs=0.6)
    own = replace(belief, by="beacon").curves(recording.venue, surveys_of(recording))
    assert len(np.unique(own.exponent)) > 1


def test_a_path_loss_fit_of_the_belief_is_one_curve_a_beacon():
    ranging = Lateration().fit(practice_venue(), ()).ranging
    assert ranging.curve(3) == PathLossFit(level_dbm=-61.0, exponent=2.0, spread_db=6.0)


def test_nothing_heard_gives_no_estimate():
    assert len(follow(Lateration(), practice_venue(), Readings.empty())) == 0


@pytest.mark.parametrize(
    "wrong",
    [{"most": 0}, {"loss": "cubic"}, {"curves": "some"}, {"exponent": 0.0}, {"spread_db": 0.0}],
)
def test_bad_settings_are_refused(wrong):
    with pytest.raises(UsageError, match=next(iter(wrong))):
        Lateration(**wrong)


def test_it_asks_to_be_fitted():
    with pytest.raises(UsageError, match="call fit"):
        Lateration().start(None, Draws(seed=1, purpose="test").generator())


def test_other_settings_keep_the_contract():
    check_estimator(Lateration(curves="all", most=4, loss="soft_l1", window_s=1.0))
