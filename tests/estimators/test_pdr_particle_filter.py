import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from blesim.errors import UsageError
from blesim.estimators.base import Need
from blesim.estimators.check import check_estimator
from blesim.estimators.pdr_particle_filter import PdrParticleFilter, curve_table
from blesim.estimators.practice import practice_venue
from blesim.estimators.walking_cloud import CloudSettings, WalkingCloud
from blesim.filters.plan_motion import PlanMotion
from blesim.ranging.path_loss_fit import PathLossFit
from blesim.recording import Observations
from blesim.rng import Draws
from blesim.tables import Readings, Steps

HALL = PlanMotion.on(shapely.box(0.0, 0.0, 10.0, 10.0))
CURVE = curve_table(PathLossFit(level_dbm=[-60.0], exponent=[2.0], spread_db=[4.0]))[0]


def generator():
    return Draws(seed=1, purpose="test").generator()


def placed(x_m, y_m, **settings):
    """Cloud of particles at given places, weighed alike and without a heading error."""
    chosen = {"phone_height_m": 1.0, "particles": len(x_m), "resample_below": 0.0, **settings}
    cloud = WalkingCloud(CloudSettings(**chosen), HALL, generator())
    cloud._x_m, cloud._y_m = np.array(x_m, float), np.array(y_m, float)
    cloud._log_weight, cloud._bias = np.zeros(len(x_m)), np.zeros(len(x_m))
    return cloud


def test_a_reading_weighs_by_its_departure_from_the_curve():
    # A beacon at (0, 0) in the phone's plane: -60 dBm at 1 m, -80 at 10 m.
    cloud = placed([1.0, 10.0], [0.0, 0.0], trust=0.5, outlier=100.0)
    mean_x_m, *_ = cloud.hear(np.array([0.0, 0.0, 1.0]), CURVE, -64.0)
    # z = 1 and 4: exp(-0.5 * 0.5 * 1) against exp(-0.5 * 0.5 * 16).
    near, far = math.exp(-0.25), math.exp(-4.0)
    assert mean_x_m == pytest.approx((near * 1.0 + far * 10.0) / (near + far))


def test_beyond_the_outlier_all_departures_count_the_same():
    cloud = placed([1.0, 10.0], [0.0, 0.0], trust=1.0, outlier=2.0)
    cloud.hear(np.array([0.0, 0.0, 1.0]), CURVE, -100.0)
    assert cloud._log_weight == pytest.approx([-2.0, -2.0])


def test_distances_are_in_space():
    cloud = placed([3.0], [0.0], trust=1.0, outlier=100.0)
    cloud.hear(np.array([0.0, 0.0, 5.0]), CURVE, -60.0 - 20.0 * math.log10(5.0))
    # 3 m along and 4 m up are 5 m.
    assert cloud._log_weight == pytest.approx([0.0], abs=1e-12)


def test_a_step_moves_by_length_and_heading():
    exact = {"length_share": 0.0, "heading_spread_deg": 0.0, "heading_bias_deg": 0.0}
    cloud = placed([5.0], [5.0], **exact)
    cloud.walk(0.8, math.pi / 2)
    assert (cloud._x_m[0], cloud._y_m[0]) == pytest.approx((5.0, 5.8))
    many = placed(np.full(4000, 5.0), np.full(4000, 5.0), **{**exact, "length_share": 0.1})
    many.walk(1.0, 0.0)
    # The deviation of 4000 draws is within 5 % but once in 1e5.
    assert many._x_m.std() == pytest.approx(0.1, rel=0.05)


def test_headings_share_an_error_for_a_while():
    settings = {"length_share": 0.0, "heading_spread_deg": 0.0, "heading_bias_deg": 10.0}
    for steps, expected in ((1e6, 1.0), (0.1, 0.0)):
        cloud = placed(np.full(4000, 5.0), np.full(4000, 5.0), bias_steps=steps, **settings)
        cloud._bias = generator().standard_normal(4000)
        cloud.walk(1.0, 0.0)
        first = np.arctan2(cloud._y_m - 5.0, cloud._x_m - 5.0)
        before_x_m, before_y_m = cloud._x_m.copy(), cloud._y_m.copy()
        cloud.walk(1.0, 0.0)
        second = np.arctan2(cloud._y_m - before_y_m, cloud._x_m - before_x_m)
        assert np.corrcoef(first, second)[0, 1] == pytest.approx(expected, abs=0.08)
        assert np.degrees(second.std()) == pytest.approx(10.0, rel=0.06)


def test_walls_kill_or_stop_or_are_not_there():
    exact = {"length_share": 0.0, "heading_spread_deg": 0.0, "heading_bias_deg": 0.0}
    killed = placed([9.8, 5.0], [5.0, 5.0], walls="kill", **exact)
    killed.walk(0.7, 0.0)
    assert killed.moments()[0] == pytest.approx(5.7)
    stopped = placed([9.8, 5.0], [5.0, 5.0], walls="stop", **exact)
    stopped.walk(0.7, 0.0)
    assert stopped.moments()[0] == pytest.approx((9.99 + 5.7) / 2)
    through = placed([9.8, 5.0], [5.0, 5.0], walls="ignore", **exact)
    through.walk(0.7, 0.0)
    assert through.moments()[0] == pytest.approx((10.5 + 5.7) / 2)
    every = placed([9.8, 9.7], [5.0, 5.0], walls="kill", **exact)
    every.walk(0.7, 0.0)
    assert every.moments()[0] == pytest.approx(9.99)


def test_it_resamples_when_few_particles_carry_the_weight():
    beacon_m = np.array([0.0, 0.0, 1.0])
    calm = placed([1.0, 10.0], [0.0, 0.0], trust=1.0, roughening_m=0.0)
    calm.hear(beacon_m, CURVE, -60.0)
    assert calm._x_m.tolist() == [1.0, 10.0]
    eager = placed([1.0, 10.0], [0.0, 0.0], trust=1.0, roughening_m=0.0, resample_below=1.0)
    eager.hear(beacon_m, CURVE, -60.0)
    assert eager._x_m.tolist() == [1.0, 1.0]
    assert eager._log_weight.tolist() == [0.0, 0.0]


def walk_of(rows=40):
    """Walk along y = 4 from x = 2, noiseless: a step and a reading of each beacon every 0.5 s."""
    beacons_m = practice_venue().beacon_xyz_m
    time_us = np.arange(1, rows + 1) * 500_000
    x_m = 2.0 + 0.3 * np.arange(rows)
    away_m = np.stack([x_m, np.full(rows, 4.0), np.full(rows, 1.1)], axis=1)[:, None] - beacons_m
    rssi_dbm = -61.0 - 20.0 * np.log10(np.linalg.norm(away_m, axis=2))
    readings = Readings(
        time_us=np.repeat(time_us, len(beacons_m)),
        beacon=np.tile(np.arange(len(beacons_m)), rows),
        rssi_dbm=np.rint(rssi_dbm).astype(int).ravel(),
        channel=np.zeros(rssi_dbm.size),
    )
    steps = Steps(time_us=time_us, length_m=np.full(rows, 0.3), heading_rad=np.zeros(rows))
    return Observations(readings=readings, steps=steps), np.repeat(x_m, len(beacons_m))


@pytest.mark.parametrize("walls", ["kill", "stop", "ignore"])
def test_without_noise_it_follows_the_walk(walls):
    walk, x_m = walk_of()
    estimator = PdrParticleFilter(walls=walls, spread_db=2.0, heading_bias_deg=0.0)
    track = estimator.fit(practice_venue(), ()).start(None, generator()).advance(walk)
    assert len(track) == len(walk.readings)
    error_m = np.hypot(track.x_m - x_m, track.y_m - 4.0)
    assert error_m[80:].mean() < 0.4
    # It says so, within a factor of three.
    spread_m = np.sqrt(track.variance_x_m2 + track.variance_y_m2)[80:].mean()
    assert error_m[80:].mean() / 3 < spread_m < 1.5


def test_the_first_reading_tells_where_to_begin():
    walk, _ = walk_of(1)
    alone = replace(walk, readings=walk.readings.rows(slice(0, 1)))
    tracker = PdrParticleFilter(spread_db=1.0, trust=1.0).fit(practice_venue(), ())
    track = tracker.start(None, generator()).advance(alone)
    # On a part of a circle of 3.5 m about beacon 0 at (2, 0.5), not the middle of the hall.
    assert track.x_m[0] < 5.0
    assert len(track) == 1


def test_after_a_long_silence_the_cloud_begins_anew():
    walk, _ = walk_of()
    late = replace(walk.readings.rows(slice(4, 5)), time_us=np.array([10**9]))
    readings = Readings.concatenate([walk.readings, late])
    walk = replace(walk, readings=readings)
    for silence_s, wide in ((30.0, True), (1e5, False)):
        estimator = PdrParticleFilter(silence_s=silence_s, spread_db=2.0)
        track = estimator.fit(practice_venue(), ()).start(None, generator()).advance(walk)
        assert bool(track.variance_x_m2[-1] > 5 * track.variance_x_m2[-2]) is wide


def test_trust_is_in_the_covariance():
    walk, _ = walk_of()
    found = []
    for trust in (0.05, 1.0):
        estimator = PdrParticleFilter(trust=trust)
        track = estimator.fit(practice_venue(), ()).start(None, generator()).advance(walk)
        found.append(float(track.variance_x_m2[80:].mean()))
    assert found[0] > 2 * found[1]


def test_no_readings_give_no_estimates_and_strange_beacons_are_skipped():
    walk, _ = walk_of(4)
    fitted = PdrParticleFilter().fit(practice_venue(), ())
    silent = replace(walk, readings=Readings.empty())
    assert len(fitted.start(None, generator()).advance(silent)) == 0
    strange = replace(walk, readings=replace(walk.readings, beacon=walk.readings.beacon + 4))
    track = fitted.start(None, generator()).advance(strange)
    assert len(track) == 16


def test_it_needs_where_its_steps_come_from_and_asks_to_be_fitted():
    assert PdrParticleFilter().needs == {Need.STEPS}
    assert PdrParticleFilter(source="imu").needs == {Need.IMU}
    with pytest.raises(UsageError, match="call fit"):
        PdrParticleFilter().start(None, generator())


@pytest.mark.parametrize(
    "wrong", [{"particles": 0}, {"walls": "bend"}, {"trust": 0.0}, {"source": "feet"}]
)
def test_bad_settings_are_refused(wrong):
    with pytest.raises(UsageError, match=next(iter(wrong))):
        PdrParticleFilter(**wrong)


@pytest.mark.parametrize(
    "estimator",
    [
        PdrParticleFilter(particles=40, walls="stop", resample_below=1.0),
        PdrParticleFilter(particles=40, source="imu", walls="ignore", curves="all", silence_s=0.2),
    ],
)
def test_other_settings_keep_the_contract(estimator):
    check_estimator(estimator)
