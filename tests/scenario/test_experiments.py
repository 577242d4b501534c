"""The scenarios of the published experiments: what their papers give of them holds."""

from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
import shapely

from blesim.dataset.validator import validate
from blesim.dataset.writer import write_recording
from blesim.recording import Recording, Truth, Walk, WalkKind
from blesim.scenario.build import set_stage
from blesim.scenario.reading import ScenarioFile, read_scenario
from blesim.scenario.venue_built import LAYOUTS
from blesim.scenario.venue_source import LayoutName, VenueSource
from blesim.simulate import Simulation
from blesim.tables import Trajectory
from blesim.units import heading_to_azimuth

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"
EXPERIMENTS = ["room-two-pairs", "campus-corridor", "office-dense", "office-sparse", "h-floor"]


def scenario(name: str) -> ScenarioFile:
    return read_scenario(SCENARIOS / f"{name}.yaml")


@cache
def simulated(name: str) -> tuple[Recording, Truth]:
    return Simulation.run(scenario(name), 1).recording()


def walked(name: str, walk: str) -> Trajectory:
    return simulated(name)[1].walks[walk].trajectory


def length_m(way: Trajectory) -> float:
    return float(np.hypot(np.diff(way.x_m), np.diff(way.y_m)).sum())


def turns_deg(way: Trajectory) -> list[float]:
    """Angles between the straight stretches of a walk."""
    along = np.diff(np.stack([way.x_m, way.y_m], axis=1), axis=0)
    along = along[np.hypot(*along.T) > 1e-3]
    azimuth_rad = heading_to_azimuth(np.arctan2(along[:, 1], along[:, 0]))
    by_deg = np.degrees(np.diff(azimuth_rad)) % 360
    return [round(float(angle)) for angle in np.minimum(by_deg, 360 - by_deg) if angle > 1]


def rests_s(way: Trajectory) -> list[float]:
    """How long the walker stands each time."""
    still = np.hypot(np.diff(way.x_m), np.diff(way.y_m)) < 1e-6
    still &= np.abs(np.diff(np.unwrap(way.heading_rad))) < 1e-6
    return [float(span) for span in np.diff(way.time_us)[still] * 1e-6 if span > 1]


def test_every_layout_has_a_name_that_scenarios_know():
    assert set(LAYOUTS) == set(get_args(LayoutName))


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_a_recording_of_it_is_valid(name, tmp_path):
    path = tmp_path / "recording.h5"
    write_recording(path, *simulated(name))
    assert validate(path) == []


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_nobody_walks_through_a_wall(name):
    _, truth = simulated(name)
    plan = truth.venue.floor_plan
    free = shapely.buffer(plan.walkable[0], 1e-5)
    for walk, told in truth.walks.items():
        way = shapely.LineString(np.stack([told.trajectory.x_m, told.trajectory.y_m], axis=1))
        assert shapely.covers(free, way), walk


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_one_tester_does_it_all_one_after_the_other(name):
    _, truth = simulated(name)
    ways = [told.trajectory.time_us for told in truth.walks.values()]
    spans = sorted((int(time_us[0]), int(time_us[-1])) for time_us in ways)
    for (_, end_us), (start_us, _) in pairwise(spans):
        assert end_us < start_us


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_it_has_walks_to_position_and_a_survey_with_marks(name):
    walks = simulated(name)[0].walks
    assert {walk.kind for walk in walks} == {WalkKind.WALK, WalkKind.SURVEY}
    for walk in walks:
        assert len(walk.observations.marks) >= 2
        assert len(walk.observations.readings) > 20


class TestRoom:
    def test_the_survey_looks_four_ways_at_every_crossing_for_5_s(self):
        marks = simulated("room-two-pairs")[0].by_name["fingerprints"].observations.marks
        assert len(marks) == 27 * 8 * 4 * 2
        assert np.diff(marks.time_us)[::2] == pytest.approx(5e6)
        looks_deg = np.degrees(marks.heading_rad[:8:2]) % 360
        assert looks_deg == pytest.approx([0, 90, 180, 270])

    @pytest.mark.parametrize("walk", ["simple", "complex"])
    def test_walks_stand_within_3_m_of_a_beacon_long_enough_to_be_corrected(self, walk):
        way = walked("room-two-pairs", walk)
        assert rests_s(way) == pytest.approx([8.0, 8.0, 8.0])
        still = np.flatnonzero(np.diff(way.time_us) > 7.9e6)
        still = still[np.hypot(np.diff(way.x_m), np.diff(way.y_m))[still] < 1e-6]
        beacon_m = simulated("room-two-pairs")[1].venue.beacon_xyz_m
        for row in still:
            here_m = np.array([way.x_m[row], way.y_m[row], 1.1])
            assert np.linalg.norm(beacon_m - here_m, axis=1).min() < 3.0

    def test_the_complex_walk_turns_more_often(self):
        simple, complex_ = (walked("room-two-pairs", name) for name in ("simple", "complex"))
        assert len(turns_deg(simple)) == 4
        assert len(turns_deg(complex_)) == 12

    def test_the_phone_lies_flat_and_hears_every_beacon_about_once_a_second(self):
        for walk in simulated("room-two-pairs")[0].walks[:2]:
            assert walk.carrying == "flat"
            readings = walk.observations.readings
            span_s = np.ptp(readings.time_us) * 1e-6
            rate_hz = np.bincount(readings.beacon, minlength=4) / span_s
            assert np.all((rate_hz > 0.8) & (rate_hz <= 1.05))


class TestCorridor:
    def test_the_walk_takes_about_316_steps_and_turns_three_times(self):
        _, truth = simulated("campus-corridor")
        # Step intervals vary by 8.5 %: the count of 316 by 1.5, and four of these are 6.
        assert abs(len(truth.walks["b-to-c"].steps) - 316) <= 6
        assert turns_deg(walked("campus-corridor", "b-to-c")) == [90, 90, 35]
        way = walked("campus-corridor", "b-to-c")
        walks = way.speed_m_s > 0
        assert way.speed_m_s[walks] == pytest.approx(1.65, abs=1e-3)

    def test_the_seven_known_walks_are_as_long_as_published_and_marked_from_end_to_end(self):
        recording, _ = simulated("campus-corridor")
        lengths_m = [40.5, 71.4, 43.2, 39.5, 81.6, 211.68, 179.0]
        surveys = [walk for walk in recording.walks if walk.kind == WalkKind.SURVEY]
        for walk, expected_m in zip(surveys, lengths_m, strict=True):
            assert length_m(walked("campus-corridor", walk.name)) == pytest.approx(
                expected_m, abs=0.002
            )
            marks = walk.observations.marks
            marked_m = np.hypot(np.diff(marks.x_m), np.diff(marks.y_m)).sum()
            assert marked_m == pytest.approx(expected_m, abs=0.002)

    def test_imu_at_50_hz(self):
        imu = simulated("campus-corridor")[0].by_name["b-to-c"].observations.imu
        assert np.median(np.diff(imu.time_us)) == pytest.approx(20_000, rel=0.01)

    @pytest.mark.parametrize(
        ("layout", "count"),
        [("campus-corridor-15", 15), ("campus-corridor-10", 10), ("campus-corridor-keys", 5)],
    )
    def test_the_routes_hold_for_other_numbers_of_beacons(self, layout, count):
        file = scenario("campus-corridor").with_parameters(venue=VenueSource(layout=layout))
        stage = set_stage(file, 1)
        assert len(stage.built.beacons) == count
        assert len(stage.itineraries) == 8

    def test_signals_above_the_papers_threshold_come_from_within_5_m(self):
        # Section 2: at +4 dBm, -74 dBm "has contributed to obtaining a sensing area with a radius
        # of 5 m". With 20 seeds the share was 0.65 to 0.76.
        recording, truth = simulated("campus-corridor")
        beacon_m = truth.venue.beacon_xyz_m[:, :2]
        away_m = np.concatenate([distances_m(walk, truth, beacon_m) for walk in recording.walks])
        rssi_dbm = np.concatenate([w.observations.readings.rssi_dbm for w in recording.walks])
        strong = rssi_dbm >= -74
        assert np.mean(away_m[strong] < 5.0) > 0.6
        assert np.median(away_m[~strong]) > 10.0


def distances_m(walk: Walk, truth: Truth, beacon_m) -> np.ndarray:
    """Distance on the map to the beacon of each reading."""
    readings = walk.observations.readings
    poses = truth.walks[walk.name].trajectory.at(readings.time_us)
    here_m = np.stack([poses.x_m, poses.y_m], axis=1)
    return np.linalg.norm(beacon_m[readings.beacon] - here_m, axis=1)


def channels_a_second(walk: Walk) -> np.ndarray:
    readings = walk.observations.readings
    heard = np.stack(
        [readings.time_us // 1_000_000, readings.beacon.astype(int) * 64 + readings.channel]
    )
    seconds = np.unique(heard, axis=1)[0]
    return np.bincount(seconds - seconds[0])[1:-1]


class TestOffice:
    @pytest.mark.parametrize(("name", "lowest", "highest"), [("dense", 5, 19), ("sparse", 0, 9)])
    @pytest.mark.parametrize("walk", ["trajectory-1", "trajectory-2"])
    def test_about_as_many_channels_are_heard_as_published(self, name, lowest, highest, walk):
        # The paper does not say in which time. In a second, nine in ten of ours are 10 to 22 with
        # 20 beacons and 3 to 9 with 8.
        counts = channels_a_second(simulated(f"office-{name}")[0].by_name[walk])
        assert lowest < np.median(counts) < highest
        assert np.mean((counts >= lowest) & (counts <= highest)) > 0.7

    def test_the_phone_tells_all_three_channels(self):
        for walk in simulated("office-dense")[0].walks:
            assert set(walk.observations.readings.channel.tolist()) == {37, 38, 39}

    @pytest.mark.parametrize("name", ["office-dense", "office-sparse"])
    def test_fingerprints_are_taken_at_150_points(self, name):
        marks = simulated(name)[0].by_name["fingerprints"].observations.marks
        places_m = np.unique(np.stack([marks.x_m, marks.y_m], axis=1), axis=0)
        assert len(places_m) == 150
        assert len(marks) == 150 * 4 * 2

    @pytest.mark.parametrize("name", ["office-dense", "office-sparse"])
    def test_beacons_were_written_down_to_about_a_metre(self, name):
        recording, truth = simulated(name)
        off_m = np.linalg.norm(recording.venue.beacon_xyz_m - truth.venue.beacon_xyz_m, axis=1)
        # 96 % are below a metre: of 20, three or more are beyond in 6 of 100 seeds.
        assert np.sum(off_m > 1.0) <= 2
        assert np.median(off_m) > 0.2

    def test_trajectories_are_walked_at_constant_speed_between_junctions(self):
        recording, _ = simulated("office-dense")
        for name, expected_m in (("trajectory-1", 136.0), ("trajectory-2", 148.0)):
            way, marks = walked("office-dense", name), recording.by_name[name].observations.marks
            assert length_m(way) == pytest.approx(expected_m, abs=1e-3)
            assert way.speed_m_s[way.speed_m_s > 0] == pytest.approx(1.0, abs=1e-3)
            assert len(marks) >= 11


class TestHFloor:
    def test_the_course_is_70_m_long_with_six_turns(self):
        way = walked("h-floor", "course")
        assert length_m(way) == pytest.approx(70.0, abs=1e-4)
        assert turns_deg(way) == [90, 90, 180, 180, 90, 90]

    def test_the_tester_stands_at_both_read_out_points(self):
        way = walked("h-floor", "course")
        assert rests_s(way) == pytest.approx([3.0, 3.0])
        graph = simulated("h-floor")[1].venue.graph
        still = np.flatnonzero(np.diff(way.time_us) == 3_000_000)
        stood_m = np.stack([way.x_m[still], way.y_m[still]], axis=1)
        rows = [graph.node_row[f"point-{number}"] for number in (1, 2)]
        assert stood_m == pytest.approx(graph.node_xy_m[rows])

    def test_the_survey_stands_in_each_cell_of_30_cm_on_7_50_m_square(self):
        marks = simulated("h-floor")[0].by_name["proximity"].observations.marks
        cells_m = np.unique(np.round(np.stack([marks.x_m, marks.y_m], axis=1), 6), axis=0)
        assert len(cells_m) == 25 * 25
        assert np.ptp(cells_m, axis=0) == pytest.approx([7.2, 7.2])
        hall = simulated("h-floor")[1].venue.beacons[0]
        assert cells_m.mean(axis=0) == pytest.approx([hall.x_m, hall.y_m])

    def test_the_share_of_near_falls_with_distance_about_as_published(self):
        recording, truth = simulated("h-floor")
        walk = recording.by_name["proximity"]
        readings = walk.observations.readings
        away_m = distances_m(walk, truth, truth.venue.beacon_xyz_m[:, :2])
        of_hall = readings.beacon == 0
        middle_m = np.arange(0.3, 2.5, 0.3)
        near = np.array(
            [
                np.mean(readings.proximity[of_hall & (np.abs(away_m - m) < 0.15)] == 2)
                for m in middle_m
            ]
        )
        # Eq 5. One beacon has one field of shadows: with 20 seeds the rms was 0.05 to 0.27, and the
        # share beyond 4 m up to 0.26.
        published = np.clip(1.1077 - 0.3053 * middle_m, 0.0, 1.0)
        assert np.sqrt(np.mean((near - published) ** 2)) < 0.35
        assert np.polyfit(middle_m, near, 1)[0] < 0.0
        assert np.mean(readings.proximity[of_hall & (away_m > 4.0)] == 2) < 0.4
