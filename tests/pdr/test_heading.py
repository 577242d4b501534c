import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from blesim.errors import DataError, UsageError
from blesim.pdr.heading import (
    Complementary,
    ComplementaryFilter,
    HeldHeadings,
    StepHeadings,
    compass_heading_rad,
    compass_offset_rad,
)
from blesim.units import wrap_angle

NONE = np.empty(0, np.int64)


def test_compass_headings_of_the_four_directions():
    # North is +y, east +x; the offset turns counter-clockwise.
    azimuth = np.radians([0, 90, 180, 270])
    expected = np.radians([90, 0, -90, -180])
    np.testing.assert_allclose(compass_heading_rad(azimuth), expected, atol=1e-12)
    np.testing.assert_allclose(compass_heading_rad(azimuth[:3], 0.1), expected[:3] + 0.1)


@given(st.floats(-3.1, 3.1), st.integers(1, 200))
def test_the_offset_of_a_survey_is_found_across_the_end_of_the_circle(offset, count):
    rng = np.random.default_rng(count)
    azimuth = rng.uniform(-math.pi, math.pi, count)
    walked = wrap_angle(compass_heading_rad(azimuth, offset) + rng.normal(0, 0.2, count))
    # Five standard errors: less than one false alarm in a million.
    found = compass_offset_rad(np.append(azimuth, np.nan), np.append(walked, 0.0))
    assert abs(wrap_angle(found - offset)) < 5 * 0.21 / math.sqrt(count)


def test_no_fixed_offset_is_refused():
    with pytest.raises(DataError, match="no compass azimuth"):
        compass_offset_rad([np.nan], [0.0])
    with pytest.raises(DataError, match="no fixed offset"):
        compass_offset_rad(np.zeros(4), np.radians([0, 90, 180, 270]))


def test_equation_9_worked_by_hand():
    # 0.25 (1 + 2 * 0.1) + 0.75 * 1.6 = 1.5.
    filter_ = ComplementaryFilter(Complementary(weight=0.75), 1.0)
    filter_.advance(np.array([0]), np.array([7.0]), np.array([np.nan]))
    heading = filter_.advance(np.array([100_000]), np.array([2.0]), np.array([1.6]))
    assert heading[0] == pytest.approx(1.5)


def test_the_filter_turns_the_shorter_way_round():
    filter_ = ComplementaryFilter(Complementary(weight=0.5), 3.0)
    heading = filter_.advance(np.array([0]), np.zeros(1), np.array([-3.0]))
    assert abs(wrap_angle(heading[0] - math.pi)) < 1e-12


def test_the_gyroscope_alone_and_the_compass_alone():
    time_us = np.arange(101) * 20_000
    rate, compass = np.full(101, 0.5), np.linspace(0, 1, 101)
    gyro = ComplementaryFilter(Complementary(weight=0.0), -3.0).advance(time_us, rate, compass)
    np.testing.assert_allclose(gyro, wrap_angle(-3.0 + 0.5 * time_us * 1e-6), atol=1e-12)
    alone = ComplementaryFilter(Complementary(weight=1.0)).advance(time_us, rate, compass)
    np.testing.assert_allclose(alone, compass, atol=1e-12)
    with pytest.raises(UsageError, match="start_heading_rad"):
        ComplementaryFilter(Complementary(weight=0.0))


def test_the_filter_is_better_than_either_sensor():
    # A compass of 10 deg white error and a gyroscope with 1 deg/s of bias, for two minutes.
    rng = np.random.default_rng(8)
    time_us = np.arange(6000) * 20_000
    yaw = 1.5 * np.sin(2 * np.pi * time_us * 1e-6 / 20)
    rate = np.gradient(yaw, 0.02) + math.radians(1)
    compass = yaw + rng.normal(0, math.radians(10), len(yaw))

    def rms_deg(weight):
        heading = ComplementaryFilter(Complementary(weight=weight), 0.0).advance(
            time_us, rate, compass
        )
        return math.degrees(np.sqrt(np.mean(wrap_angle(heading - yaw) ** 2)))

    # The bias settles at 0.98 * 0.02 deg / 0.02, the noise at 10 deg * sqrt(0.02 / 1.98).
    assert rms_deg(0.02) == pytest.approx(math.hypot(0.98, 1.005), rel=0.15)
    assert rms_deg(1.0) > 9
    assert rms_deg(0.0) > 60


def test_a_heading_not_yet_known_is_nan():
    filter_ = ComplementaryFilter(Complementary())
    heading = filter_.advance(np.arange(3), np.zeros(3), np.array([np.nan, 0.4, np.nan]))
    np.testing.assert_allclose(heading, [np.nan, 0.4, 0.4], rtol=1e-12)


def test_mean_heading_of_a_step_across_the_end_of_the_circle():
    headings = StepHeadings()
    heading = np.array([3.0, -3.0, 3.1, 1.0])
    mean = headings.advance(np.arange(4) * 100, heading, np.array([200, 300]))
    assert abs(wrap_angle(mean[0] - math.pi)) < 1e-12
    assert mean[1] == pytest.approx(3.1)


def test_a_step_without_heading_keeps_the_one_before():
    headings = StepHeadings()
    mean = headings.advance(
        np.array([0, 10, 20]), np.array([np.nan, 0.5, np.nan]), np.array([10, 20, 30])
    )
    np.testing.assert_array_equal(mean, [np.nan, 0.5, 0.5])


def test_headings_of_the_system_are_held():
    held = HeldHeadings()
    time_us, heading = np.array([100, 200, 200]), np.array([0.1, 0.2, 0.3])
    first = held.advance(time_us, heading, np.array([50, 100, 150, 200]))
    np.testing.assert_array_equal(first, [np.nan, np.nan, 0.1, 0.1])
    assert held.advance(NONE, np.empty(0), np.array([200, 201, 10**12])).tolist() == [0.1, 0.3, 0.3]
    with pytest.raises(DataError, match="order of time"):
        held.advance(np.array([199]), np.array([0.0]), NONE)


@given(
    moments=st.lists(st.integers(0, 12), max_size=20),
    steps=st.lists(st.integers(0, 14), max_size=10),
    cuts=st.lists(st.integers(0, 14), max_size=5),
)
def test_held_headings_do_not_depend_on_cuts(moments, steps, cuts):
    # A cut before time c: headings and steps from c on come in the next block.
    time_us, told_us = np.sort(np.array(moments, int)), np.sort(np.array(steps, int))
    heading = np.arange(len(time_us)) * 0.1
    whole = HeldHeadings().advance(time_us, heading, told_us)
    live, parts = HeldHeadings(), []
    bounds = [-1, *sorted(cuts), 99]
    for begin, end in itertools.pairwise(bounds):
        rows = (time_us >= begin) & (time_us < end)
        told = told_us[(told_us >= begin) & (told_us < end)]
        parts.append(live.advance(time_us[rows], heading[rows], told))
    assert np.concatenate(parts).tobytes() == whole.tobytes()
