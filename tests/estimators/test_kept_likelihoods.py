import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from blesim.errors import UsageError
from blesim.estimators.base import Need
from blesim.estimators.clocked_tracker import ClockedTracker
from blesim.estimators.floors import Floors
from blesim.estimators.kept_likelihoods import KeptCloud, KeptLikelihoods
from blesim.estimators.practice import practice_venue
from blesim.estimators.walked_steps import StepReading
from blesim.filters.plan_motion import PlanMotion
from blesim.recording import Observations
from blesim.rng import Draws
from blesim.tables import Readings, Steps
from blesim.venue.floor_plan import FloorPlan, Obstacle

HALL = shapely.box(0.0, 0.0, 10.0, 10.0)


def generator(purpose="test"):
    return Draws(seed=1, purpose=purpose).generator()


def cloud(settings=None, area=HALL, walls=True):
    settings = KeptLikelihoods() if settings is None else settings
    return KeptCloud(settings, PlanMotion.on(area), walls, generator())


def placed(x_m, y_m, likelihood=0.0, **settings):
    """Cloud of particles at given places."""
    made = cloud(KeptLikelihoods(particles=len(x_m), **settings))
    made.x_m, made.y_m = np.array(x_m, float), np.array(y_m, float)
    made.likelihood = np.zeros(len(x_m)) + likelihood
    return made


def test_particles_begin_uniform_with_likelihood_zero():
    made = cloud(KeptLikelihoods(particles=4000))
    assert np.all(made.likelihood == 0)
    # Standard deviation of the mean of 4000 is 2.89 / 63 = 0.046 m: five of them, 1 in 1e6.
    assert np.hypot(made.x_m.mean() - 5, made.y_m.mean() - 5) < 0.3
    assert made.x_m.var() == pytest.approx(100 / 12, rel=0.1)


def test_a_step_is_65_cm_give_or_take_10_towards_the_heading_give_or_take_15_degrees():
    made = placed(np.full(2000, 5.0), np.full(2000, 5.0))
    made.move(math.radians(30.0))
    length_m = np.hypot(made.x_m - 5, made.y_m - 5)
    heading = np.degrees(np.arctan2(made.y_m - 5, made.x_m - 5))
    assert length_m.min() >= 0.55
    assert length_m.max() <= 0.75
    assert heading.min() >= 15
    assert heading.max() <= 45
    # Uniform: half the width over sqrt 3; 2000 draws are within 5 % but once in 1e4.
    assert length_m.std() == pytest.approx(0.10 / math.sqrt(3), rel=0.05)
    assert heading.std() == pytest.approx(15 / math.sqrt(3), rel=0.05)


def test_the_spread_may_be_gaussian():
    made = placed(np.full(2000, 5.0), np.full(2000, 5.0), spread="gaussian")
    made.move(0.0)
    length_m = np.hypot(made.x_m - 5, made.y_m - 5)
    assert length_m.std() == pytest.approx(0.10, rel=0.08)
    assert length_m.max() > 0.80


def test_eq_1_and_4_add_to_the_likelihood_and_never_go_below_zero():
    made = placed([1, 2, 3], [1, 1, 1], likelihood=np.array([2.0, 6.0, 0.5]))
    made._entered[:] = [True, True, False]
    made.add(np.array([0.5, 0.5, 0.25]))
    # 2 + 0.5 - 5 < 0; 6 + 0.5 - 5; 0.5 + 0.25.
    assert made.likelihood.tolist() == [0.0, 1.5, 0.75]
    made.add(np.zeros(3))
    assert made.likelihood.tolist() == [0.0, 1.5, 0.75]


@pytest.mark.parametrize("penalty", [-0.5, -1.0, -5.0, -10.0])
def test_a_particle_that_would_enter_a_wall_is_put_before_it_and_punished(penalty):
    made = placed([9.8, 5.0], [5.0, 5.0], 20.0, penalty=penalty, heading_spread_deg=0.0)
    made.move(0.0)
    assert made.x_m[0] == pytest.approx(9.99, abs=1e-6)
    assert made.x_m[1] == pytest.approx(5.65, abs=0.1)
    made.move(0.0)
    made.add(np.zeros(2))
    # Twice in one interval is punished once.
    assert made.likelihood.tolist() == [20.0 + penalty, 20.0]


def test_without_walls_nothing_stops_a_particle():
    made = cloud(walls=False)
    made.x_m[:] = 9.8
    made.move(0.0)
    made.add(np.zeros(500))
    assert np.all(made.x_m > 10.3)
    assert np.all(made.likelihood == 0)


def test_eq_2_and_3_are_the_weighted_mean():
    made = placed([1, 2, 6], [0, 3, 3], likelihood=np.array([1.0, 1.0, 2.0]))
    x_m, y_m, xx, yy, xy = made.moments()
    assert (x_m, y_m) == pytest.approx(((1 + 2 + 12) / 4, (0 + 3 + 6) / 4))
    # E[x^2] = (1 + 4 + 72) / 4, E[y^2] = (9 + 18) / 4, E[xy] = (6 + 36) / 4; 0.1 m on top.
    assert xx == pytest.approx(77 / 4 - 3.75**2 + 0.01)
    assert yy == pytest.approx(27 / 4 - 2.25**2 + 0.01)
    assert xy == pytest.approx(42 / 4 - 3.75 * 2.25)


def test_all_count_the_same_where_all_likelihoods_are_zero():
    assert placed([1, 2, 6], [0, 3, 3]).moments()[:2] == pytest.approx((3.0, 2.0))


def test_copies_keep_the_likelihood_of_their_parent():
    made = placed([1, 2, 3, 4], [1, 1, 1, 1], likelihood=np.array([0.0, 3.0, 1.0, 0.0]))
    made.resample()
    # Stratified: three quarters of the weight are the second's.
    assert made.x_m.tolist() == [2.0, 2.0, 2.0, 3.0]
    assert made.likelihood.tolist() == [3.0, 3.0, 3.0, 1.0]


class Recorded:
    """Sense that knows nothing but what it was asked."""

    def __init__(self):
        self.fed, self.asked = [], []

    def feed(self, readings):
        self.fed += readings.time_us.tolist()

    def increments(self, now_us, level, x_m, y_m):  # noqa: ARG002 (a sense has it)
        self.asked.append((now_us, level, max(self.fed)))
        return np.ones_like(x_m)


def tracker(sense, venue=None, **settings):
    chosen = KeptLikelihoods(particles=50, **settings)
    floors = Floors.of(practice_venue() if venue is None else venue, use_map=chosen.use_map)
    watch = StepReading(source="system").start()
    return ClockedTracker(chosen, floors, watch, sense, generator())


def readings_at(*times_us, beacon=0):
    count = len(times_us)
    return Readings(
        time_us=times_us,
        beacon=np.zeros(count, int) + beacon,
        rssi_dbm=np.full(count, -60),
        channel=np.zeros(count),
    )


def test_an_estimate_comes_at_every_multiple_of_t_s_from_what_was_before():
    sense = Recorded()
    readings = readings_at(100_000, 500_000, 1_400_000, 1_600_000)
    track = tracker(sense).advance(Observations(readings=readings))
    assert track.time_us.tolist() == [500_000, 1_000_000, 1_500_000]
    # The reading at the very moment counts for the next.
    expected = [(500_000, 0, 100_000), (1_000_000, 0, 500_000), (1_500_000, 0, 1_400_000)]
    assert sense.asked == expected


def test_the_clock_is_a_setting():
    readings = readings_at(100_000, 1_000_000)
    track = tracker(Recorded(), interval_s=0.2).advance(Observations(readings=readings))
    assert track.time_us.tolist() == [200_000, 400_000, 600_000, 800_000, 1_000_000]


def test_the_clock_stands_still_while_nothing_is_heard_or_felt():
    readings = readings_at(100_000, 3_600_000_000, 3_600_600_000)
    track = tracker(Recorded()).advance(Observations(readings=readings))
    # The window of 3 s is empty at 3.5 s; an hour later it goes on.
    assert track.time_us.tolist() == [
        *range(500_000, 3_100_000, 500_000),
        3_600_500_000,
    ]


def test_steps_alone_move_what_is_there_and_begin_nothing():
    times_us = np.arange(1, 20) * 500_000 + 7
    steps = Steps(time_us=times_us, length_m=np.full(19, 0.7), heading_rad=np.zeros(19))
    assert len(tracker(Recorded()).advance(Observations(steps=steps))) == 0
    both = Observations(steps=steps, readings=readings_at(100_000))
    track = tracker(Recorded(), penalty=0.0).advance(both)
    assert len(track) == 19
    # All end at the east wall, x = 16, at the latest.
    assert track.x_m[-1] > track.x_m[0] + 3
    assert track.x_m.max() <= 16


def test_on_another_level_the_cloud_begins_anew():
    venue = practice_venue()
    first, second = venue.floor_plan.levels[0], replace(venue.floor_plan.levels[0], level=1)
    upstairs = venue.beacons[7].model_copy(update={"level": 1})
    plan, beacons = FloorPlan(levels=(first, second)), (*venue.beacons[:7], upstairs)
    venue = replace(venue, floor_plan=plan, beacons=beacons, graph=None)
    sense = Recorded()
    readings = readings_at(0, 100, 4_000_000, 4_100_000, 4_600_000)
    readings = replace(readings, beacon=np.array([0, 0, 7, 7, 7]))
    track = tracker(sense, venue).advance(Observations(readings=readings))
    assert track.level.tolist() == [0] * 6 + [1]
    assert [level for _, level, _ in sense.asked] == [0] * 6 + [1]


def test_beacons_of_others_are_skipped_and_obstacles_hold_no_particles():
    assert len(tracker(Recorded()).advance(Observations(readings=readings_at(0, beacon=99)))) == 0
    venue = practice_venue()
    shelf = Obstacle(id="shelf", outline=shapely.box(4.0, 3.0, 12.0, 5.0), material="bookcase")
    levels = venue.floor_plan.levels
    venue = replace(venue, floor_plan=FloorPlan(levels=levels, obstacles=(shelf,)))
    inside = shelf.outline.buffer(-1e-6)
    for use_map in (True, False):
        motion = Floors.of(venue, use_map=use_map).motion[0]
        x_m, y_m = motion.uniform_places(300, generator())
        met = bool(np.any(shapely.contains_xy(inside, x_m, y_m)))
        assert met is not use_map


def test_it_needs_where_its_steps_come_from():
    assert KeptLikelihoods().needs == {Need.STEPS}
    assert KeptLikelihoods(source="imu").needs == {Need.IMU}


@pytest.mark.parametrize(
    "wrong",
    [
        {"particles": 0},
        {"interval_s": 0.0},
        {"penalty": 1.0},
        {"source": "feet"},
        {"spread": "flat"},
        {"window_s": 0.0},
        {"heading_spread_deg": 200.0},
    ],
)
def test_bad_settings_are_refused(wrong):
    with pytest.raises(UsageError, match=next(iter(wrong))):
        KeptLikelihoods(**wrong)
