"""However a walk is cut into blocks, steps have the same lengths, headings, turns and places."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from blesim.estimators.events import cut, event_order
from blesim.pdr.attitude import Leveller, Levelling
from blesim.pdr.compass import CompassCorrection, CompassCorrector
from blesim.pdr.dead_reckoning import DeadReckoning, StepErrors
from blesim.pdr.features import StepFeatureReader, StepFelt
from blesim.pdr.heading import (
    Complementary,
    ComplementaryFilter,
    HeldHeadings,
    StepHeadings,
    compass_heading_rad,
)
from blesim.pdr.multi_threshold import MultiThreshold, MultiThresholdDetector
from blesim.pdr.step_length import PeriodPeak
from blesim.pdr.steps import step_signal_m_s2
from blesim.pdr.turns import TurnDetector, Turning
from blesim.recording import Observations
from blesim.tables import Headings, Imu, Steps
from blesim.units import azimuth_to_heading, heading_to_azimuth

CORRIDOR_RAD = 0.4


class Phone:
    """All blocks of this room, one fed by the other."""

    def __init__(self):
        self.leveller = Leveller(Levelling())
        self.filter = ComplementaryFilter(Complementary())
        self.detector = MultiThresholdDetector(MultiThreshold())
        self.features = StepFeatureReader(StepFelt())
        self.headings = StepHeadings()
        self.turns = TurnDetector(Turning())
        self.corrector = CompassCorrector(CompassCorrection(training_steps=3))
        self.held = HeldHeadings()
        self.reckoning = DeadReckoning(x_m=0.0, y_m=0.0, errors=StepErrors())
        self.told = []

    def advance(self, block):
        steps = self.detector.advance(block.imu.time_us, step_signal_m_s2(block.imu))
        self.follow(block.imu, steps.time_us, steps.told_us)
        system = block.headings
        self.told.append(self.held.advance(system.time_us, system.heading_rad, block.steps.time_us))

    def follow(self, imu, step_us, told_us):
        level = self.leveller.advance(imu)
        compass = compass_heading_rad(level.azimuth_rad, 0.1)
        heading = self.filter.advance(level.time_us, level.turn_rate_rad_s, compass)
        felt = self.features.advance(level.time_us, step_signal_m_s2(imu), step_us, told_us)
        mean = self.headings.advance(level.time_us, heading, told_us)
        turned = self.turns.advance(level.time_us, level.turn_rate_rad_s, told_us)
        azimuth = self.corrector.advance(
            heading_to_azimuth(mean), np.full(len(mean), CORRIDOR_RAD), turned.turning
        )
        length = PeriodPeak().length_m(felt)
        place = self.reckoning.advance(length, azimuth_to_heading(azimuth))
        self.told += [level.vertical_m_s2, heading, felt.variance_m2_s4, felt.lowest_m_s2]
        self.told += [felt.period_s, felt.mean_absolute_m_s2, mean, turned.angle_rad]
        self.told += [length, azimuth, place.x_m, place.y_m, place.covariance_xy_m2]


KINDS = 14


def joined(told):
    return [np.concatenate(told[kind::KINDS]).tobytes() for kind in range(KINDS)]


@pytest.fixture(scope="module")
def walk():
    # Two corridors, a pause, twice the same moment now and then, and step events of the system.
    rng = np.random.default_rng(2)
    now_s = np.round(np.arange(1000) * 0.02 / 0.03) * 0.03
    yaw = 1.5 * np.clip(now_s - 8, 0, 1) + 0.1 * np.sin(2 * np.pi * 0.9 * now_s)
    walking = (now_s < 12) | (now_s > 15)
    bounce = np.where(walking, 3 * np.sin(2 * np.pi * 1.8 * now_s), 0.0)
    noise = rng.normal(0, 0.3, (9, len(now_s)))
    clean = np.zeros((9, len(now_s)))
    clean[2], clean[5] = 9.81 + bounce, np.gradient(yaw, 0.02)
    clean[6:] = [30 * np.sin(yaw), 30 * np.cos(yaw), np.full(len(yaw), -40.0)]
    time_us = np.round(now_s * 1e6).astype(np.int64)
    names = [column.field for column in Imu.STREAM.columns]
    imu = Imu(**dict(zip(names, [time_us, *(clean + noise)], strict=True)))
    rows = np.arange(5, len(time_us), 10)
    events = time_us[np.arange(20, len(time_us), 25)]
    return Observations(
        imu=imu,
        headings=Headings(time_us=time_us[rows], heading_rad=yaw[rows]),
        steps=Steps(
            time_us=events, length_m=np.full(len(events), 0.6), heading_rad=np.zeros(len(events))
        ),
    )


def told_of(blocks):
    phone = Phone()
    for block in blocks:
        phone.advance(block)
    return joined(phone.told)


def test_the_walk_has_steps_turns_and_moments_that_fall_together(walk):
    phone = Phone()
    phone.advance(walk)
    assert np.any(np.diff(walk.imu.time_us) == 0)
    assert len(phone.told[8]) > 25
    assert np.any(np.abs(phone.told[7]) > Turning().band_rad)
    assert phone.corrector.trained


@settings(max_examples=25)
@given(st.lists(st.integers(0, 1200), max_size=12))
def test_cuts_between_events_change_no_bit(walk, cuts):
    count = len(event_order(walk)[0])
    ends = sorted(min(end, count) for end in cuts)
    assert told_of(cut(walk, ends)) == told_of([walk])


def test_one_event_at_a_time_changes_no_bit(walk):
    count = len(event_order(walk)[0])
    assert told_of(cut(walk, range(1, count))) == told_of([walk])
