import numpy as np
import pytest

from blesim.errors import UsageError
from blesim.estimators.check import check_estimator
from blesim.estimators.practice import practice_venue
from blesim.estimators.trilateration_particle_filter import (
    FixSense,
    TrilaterationParticleFilter,
)
from blesim.recording import Observations
from blesim.rng import Draws
from blesim.tables import Readings, Steps


def noiseless(time_us, places_m):
    """Rounded readings of all practice beacons at each time and place."""
    beacons_m = practice_venue().beacon_xyz_m
    away_m = np.array([[*place_m, 1.0] for place_m in places_m])[:, None] - beacons_m
    rssi_dbm = -61.0 - 20.0 * np.log10(np.linalg.norm(away_m, axis=2))
    count = len(beacons_m)
    return Readings(
        time_us=np.repeat(time_us, count),
        beacon=np.tile(np.arange(count), len(places_m)),
        rssi_dbm=np.rint(rssi_dbm).astype(int).ravel(),
        channel=np.zeros(rssi_dbm.size),
    )


def sense(estimator, place_m):
    fitted = estimator.fit(practice_venue(), ())
    made = FixSense(fitted, fitted.learned.ranging)
    made.feed(noiseless([0], [place_m]))
    return made


def test_particles_are_weighed_by_the_fix():
    made = sense(TrilaterationParticleFilter(fix_spread_m=2.0), (8.0, 4.0))
    found = made.increments(1, 0, np.array([8.0, 10.0, 8.0]), np.array([4.0, 4.0, 0.0]))
    # exp(-q / 2) at 0, 1 and 2 standard deviations; the fix is off by the rounding to 1 dB.
    np.testing.assert_allclose(found, np.exp([0.0, -0.5, -2.0]), atol=0.05)


def test_the_covariance_of_the_fit_counts_unless_a_spread_is_given():
    made = sense(TrilaterationParticleFilter(), (8.0, 4.0))
    # sigma ln 10 / (10 n) = 0.69 of each range: metres, and more of them for 12 dB.
    near, far = made.increments(1, 0, np.array([8.0, 8.0]), np.array([4.0, 1.0]))
    assert near == pytest.approx(1.0, abs=0.02)
    vaguer = sense(TrilaterationParticleFilter(spread_db=12.0), (8.0, 4.0))
    assert far < vaguer.increments(1, 0, np.array([8.0]), np.array([1.0]))[0] < 1.0


def test_nothing_heard_weighs_nothing():
    made = sense(TrilaterationParticleFilter(), (8.0, 4.0))
    assert made.increments(4_000_000, 0, np.zeros(2), np.zeros(2)).tolist() == [0.0, 0.0]


@pytest.mark.parametrize("use_map", [True, False])
def test_without_noise_it_follows_the_walk(use_map):
    time_us = np.arange(1, 21) * 500_000
    x_m = 2.0 + 0.6 * np.arange(20)
    steps = Steps(time_us=time_us, length_m=np.full(20, 0.6), heading_rad=np.zeros(20))
    readings = noiseless(time_us + 10, np.stack([x_m, np.full(20, 4.0)], axis=1))
    estimator = TrilaterationParticleFilter(use_map=use_map, step_m=0.6, rate=1.0)
    tracker = estimator.fit(practice_venue(), ()).start(
        None, Draws(seed=1, purpose="test").generator()
    )
    track = tracker.advance(Observations(readings=readings, steps=steps))
    now_m = np.interp(track.time_us, time_us, x_m)
    # Likelihoods are kept, so that the first fixes count for long: metres, not centimetres.
    assert np.hypot(track.x_m - now_m, track.y_m - 4.0)[4:].mean() < 1.5


@pytest.mark.parametrize("wrong", [{"fix_spread_m": -1.0}, {"most": 0}, {"rate": 0.0}])
def test_bad_settings_are_refused(wrong):
    with pytest.raises(UsageError, match=next(iter(wrong))):
        TrilaterationParticleFilter(**wrong)


def test_it_asks_to_be_fitted():
    with pytest.raises(UsageError, match="call fit"):
        TrilaterationParticleFilter().start(None, Draws(seed=1, purpose="test").generator())


@pytest.mark.parametrize(
    "estimator",
    [
        TrilaterationParticleFilter(use_map=False, particles=50, fix_spread_m=3.0),
        TrilaterationParticleFilter(source="imu", particles=50, curves="all", interval_s=1.0),
    ],
)
def test_other_settings_keep_the_contract(estimator):
    check_estimator(estimator)
