from dataclasses import replace

import numpy as np
import pytest

from blesim.estimators.practice import practice_recording, practice_venue
from blesim.estimators.surveyed_steps import learned_steps, spans_between
from blesim.estimators.walked_steps import SensedSteps, StepReading
from blesim.pdr.double_threshold import DoubleThreshold
from blesim.pdr.step_length import FixedLength
from blesim.recording import Observations, Recording
from blesim.tables import Headings, Imu, Marks, Steps
from blesim.units import wrap_angle
from blesim.venue.venue import Georeference

RECORDING = practice_recording()
SEEN = RECORDING.by_name["there"].observations


def told(*rows, headings=(), imu=None):
    """Step events of (time in s, length, heading), and headings of (time in s, heading)."""
    time_s, length_m, heading_rad = np.array(rows, float).reshape(-1, 3).T
    at_s, stream_rad = np.array(headings, float).reshape(-1, 2).T
    return Observations(
        steps=Steps(time_us=(time_s * 1e6).astype(int), length_m=length_m, heading_rad=heading_rad),
        headings=Headings(time_us=(at_s * 1e6).astype(int), heading_rad=stream_rad),
        imu=Imu.empty() if imu is None else imu,
    )


def spinning(rate_rad_s):
    """Two seconds of a flat phone that turns at a rate."""
    time_us = np.arange(0, 2_000_001, 20_000)
    none = np.zeros(len(time_us))
    return Imu(
        time_us=time_us,
        acceleration_x_m_s2=none,
        acceleration_y_m_s2=none,
        acceleration_z_m_s2=none + 9.80665,
        angular_rate_x_rad_s=none,
        angular_rate_y_rad_s=none,
        angular_rate_z_rad_s=none + rate_rad_s,
        magnetic_field_x_ut=none,
        magnetic_field_y_ut=none + 20.0,
        magnetic_field_z_ut=none - 45.0,
    )


def survey_turned_by(angle_rad):
    """Practice surveys whose system tells headings that are off by an angle."""
    walk = RECORDING.by_name["survey"]
    steps = walk.observations.steps
    steps = replace(steps, heading_rad=wrap_angle(steps.heading_rad + angle_rad))
    walk = replace(walk, observations=replace(walk.observations, steps=steps))
    return (replace(RECORDING, walks=(walk,)),)


@pytest.mark.parametrize(
    "how",
    [StepReading(), StepReading(detector=DoubleThreshold(), compass_weight=1.0)],
    ids=["norm", "vertical"],
)
def test_steps_of_the_imu_are_those_the_practice_walker_took(how):
    walked = how.start().advance(SEEN)
    assert len(walked) == pytest.approx(len(SEEN.steps), abs=1)
    # Each detected step has its event of the system within a step's time, and its heading, but
    # where the corner is turned.
    event = np.abs(walked.time_us[:, None] - SEEN.steps.time_us).argmin(axis=1)
    off_rad = np.abs(wrap_angle(walked.heading_rad - SEEN.steps.heading_rad[event]))
    assert np.mean(off_rad < 0.05) > 0.8
    assert np.count_nonzero(walked.turning) in range(3, 7)


def test_the_systems_steps_are_taken_as_told_and_turned_by_the_offset():
    walked = StepReading(source="system", offset_rad=0.5).start().advance(told((1, 0.7, 0.1)))
    assert walked.time_us.tolist() == [1_000_000]
    assert walked.length_m.tolist() == [0.7]
    np.testing.assert_allclose(walked.heading_rad, 0.6)


def test_a_length_of_ones_own_replaces_the_systems():
    how = StepReading(source="system", step_m=0.6)
    assert how.start().advance(told((1, 0.7, 0.1), (2, 0.9, 0.1))).length_m.tolist() == [0.6, 0.6]


def test_headings_of_the_stream_replace_the_steps_once_there_are_any():
    block = told((1, 0.7, 0.1), (2, 0.7, 0.1), (3, 0.7, 0.1), headings=[(1.5, 0.8), (2.5, 0.9)])
    how = StepReading(source="system", heading="stream")
    np.testing.assert_allclose(how.start().advance(block).heading_rad, [0.1, 0.8, 0.9])


def test_without_imu_a_step_turns_when_its_heading_does():
    block = told((1, 0.7, 0.0), (2, 0.7, 0.2), (3, 0.7, 0.5), (4, 0.7, -3.1), (5, 0.7, 3.1))
    walked = StepReading(source="system").start().advance(block)
    # 15 degrees are 0.262 rad; from -3.1 to 3.1 is a small angle.
    assert walked.turning.tolist() == [False, False, True, True, False]


def test_with_imu_a_step_turns_when_the_gyroscope_does():
    # At 0.3 rad/s the gyroscope turns by 0.3 rad in a second, whatever the system tells.
    block = told((1, 0.7, 0.0), (2, 0.7, 0.0), imu=spinning(0.3))
    assert StepReading(source="system").start().advance(block).turning.tolist() == [True, True]
    wide = StepReading(source="system", turning_rad=0.4)
    assert wide.start().advance(block).turning.tolist() == [False, False]
    still = told((1, 0.7, 0.0), (2, 0.7, 1.0), imu=spinning(0.0))
    assert not StepReading(source="system").start().advance(still).turning.any()


def test_the_survey_teaches_the_offset():
    how = StepReading(source="system")
    learned = learned_steps(how, RECORDING.venue, survey_turned_by(0.7), None)
    # The step at each corner still has the old heading in one of the two: four of 53.
    assert learned.offset_rad == pytest.approx(-0.7, abs=0.15)
    known = learned_steps(how, RECORDING.venue, survey_turned_by(0.7), 0.2)
    assert known.offset_rad == 0.2


def test_a_survey_that_stands_teaches_the_offset_of_the_compass():
    # The compass looks north; the tester says it looked east.
    marks = Marks(
        time_us=np.array([0, 2_000_000]),
        x_m=np.ones(2),
        y_m=np.ones(2),
        level=np.zeros(2),
        heading_rad=np.zeros(2),
    )
    seen = Observations(imu=spinning(0.0), marks=marks)
    walk = replace(RECORDING.by_name["survey"], observations=seen)
    surveys = (replace(RECORDING, walks=(walk,)),)
    learned = learned_steps(StepReading(), RECORDING.venue, surveys, None)
    assert learned.offset_rad == pytest.approx(-np.pi / 2)


def test_without_a_survey_the_georeference_tells_the_offset_of_a_compass():
    venue = replace(
        practice_venue(),
        georeference=Georeference(latitude_deg=0, longitude_deg=0, bearing_deg=90),
    )
    # The map's y axis points east: a compass that tells 90 degrees looks along it.
    assert learned_steps(StepReading(), venue, (), None).offset_rad == pytest.approx(np.pi / 2)
    assert learned_steps(StepReading(source="system"), venue, (), None).offset_rad == 0.0


def test_the_survey_teaches_the_lengths():
    surveys: tuple[Recording, ...] = (replace(RECORDING, walks=RECORDING.walks[:1]),)
    plain = StepReading(length=FixedLength(step_m=0.5))
    learned = learned_steps(plain, RECORDING.venue, surveys, None)
    # 32 m in the steps detected, of which none is outside the marks.
    steps = len(SensedSteps(plain).felt(RECORDING.walks[0].observations).time_us)
    assert learned.length.step_m == pytest.approx(32.0 / steps, rel=2e-3)
    kept = learned_steps(plain, RECORDING.venue, surveys, None, lengths=False)
    assert kept.length.step_m == 0.5


def test_spans_tell_walking_from_standing():
    marks = Marks(
        time_us=np.array([0, 10, 20, 30]),
        x_m=np.array([0.0, 2.0, 2.0, 2.0]),
        y_m=np.array([0.0, 0.0, 0.0, 3.0]),
        level=np.array([0, 0, 0, 1]),
        heading_rad=np.array([9.9, 1.0, np.nan, np.nan]) % 3,
    )
    spans = spans_between(marks)
    assert spans.length_m.tolist() == [2.0, 0.0]
    np.testing.assert_allclose(spans.heading_rad, [0.0, 1.0])
    # A mark belongs to what ended there; the way to another level is none.
    assert spans.at(np.array([0, 1, 10, 11, 20, 21, 40])).tolist() == [-1, 0, 0, 1, 1, -1, -1]


def test_no_events_no_steps():
    for how in (StepReading(), StepReading(source="system")):
        assert len(how.start().advance(Observations())) == 0
