"""Six recorded walks through a mall, phone in hand, beside what the phone's system made of them.

The system's rotation vector fuses the same sensors, so it bounds what a compass or a gyroscope may
be off, not how right either is.
"""

import gzip
from dataclasses import dataclass, fields

import numpy as np
import pytest

from blesim.pdr.attitude import Leveller, Levelling, LevelSamples
from blesim.pdr.band_pass import BandPass, BandPassDetector
from blesim.pdr.features import StepFeatureReader, StepFeatures, StepFelt
from blesim.pdr.heading import Complementary, ComplementaryFilter, compass_heading_rad
from blesim.pdr.step_length import (
    FrequencyVariance,
    Kim,
    KnownWalk,
    PeriodPeak,
    Weinberg,
    fit_step_length,
)
from blesim.pdr.steps import DetectedSteps, step_signal_m_s2
from blesim.pdr.turns import TurnDetector, Turning
from blesim.tables import Imu
from blesim.units import azimuth_to_heading, wrap_angle

SENSORS = ("TYPE_ACCELEROMETER", "TYPE_GYROSCOPE", "TYPE_MAGNETIC_FIELD", "TYPE_ROTATION_VECTOR")


@dataclass(frozen=True)
class Trace:
    imu: Imu
    azimuth_rad: np.ndarray
    marks: np.ndarray
    level: LevelSamples
    steps: DetectedSteps


def read(path):
    rows = {name: [] for name in (*SENSORS, "TYPE_WAYPOINT")}
    with gzip.open(path, "rt", encoding="utf-8") as lines:
        for line in lines:
            cells = line.split("\t")
            if len(cells) > 1 and cells[1] in rows:
                rows[cells[1]].append([float(cell) for cell in (cells[0], *cells[2:5])])
    return {name: np.array(values) for name, values in rows.items()}


def trace_of(path):
    rows = read(path)
    begin_ms = rows[SENSORS[0]][0, 0]
    time_us = np.round((rows[SENSORS[0]][:, 0] - begin_ms) * 1000).astype(np.int64)
    sensed = np.hstack([rows[name][:, 1:] for name in SENSORS[:3]])
    names = [column.field for column in Imu.STREAM.columns]
    imu = Imu(**dict(zip(names, [time_us, *sensed.T], strict=True)))
    x, y, z = rows[SENSORS[3]][:, 1:].T
    w = np.sqrt(np.maximum(1 - x**2 - y**2 - z**2, 0))
    # East and north of the phone's y axis, of the rotation matrix of the quaternion.
    azimuth = np.arctan2(2 * (x * y - z * w), 1 - 2 * (x**2 + z**2))
    marks = rows["TYPE_WAYPOINT"] - [begin_ms, 0, 0]
    return Trace(
        imu=imu,
        azimuth_rad=azimuth,
        marks=marks * [1000, 1, 1],
        level=Leveller(Levelling()).advance(imu),
        steps=BandPassDetector(BandPass()).advance(time_us, step_signal_m_s2(imu)),
    )


@pytest.fixture(scope="module")
def traces(data_dir):
    paths = sorted((data_dir("ilc20") / "site1_B1").glob("*.txt.gz"))
    assert len(paths) == 6
    return [trace_of(path) for path in paths]


def rms_deg(difference_rad):
    return np.degrees(np.sqrt(np.mean(wrap_angle(difference_rad) ** 2)))


def test_compass_stays_near_the_rotation_vector(traces):
    # Stated bounds: 10 deg rms, 6 deg median, 2 deg mean on each walk; they are 8.4, 5.1 and 1.2.
    for trace in traces:
        error = wrap_angle(trace.level.azimuth_rad - trace.azimuth_rad)
        assert rms_deg(error) < 10
        assert np.degrees(np.median(np.abs(error))) < 6
        assert abs(np.degrees(error.mean())) < 2


def test_complementary_filter_is_nearer_than_compass_or_gyroscope(traces):
    for trace in traces:
        level, truth = trace.level, azimuth_to_heading(trace.azimuth_rad)
        compass = compass_heading_rad(level.azimuth_rad)
        rms = {
            weight: rms_deg(
                ComplementaryFilter(Complementary(weight=weight), float(truth[0])).advance(
                    level.time_us, level.turn_rate_rad_s, compass
                )
                - truth
            )
            for weight in (0.0, 0.02, 1.0)
        }
        assert rms[0.02] < 5
        assert rms[0.02] < min(rms[0.0], rms[1.0])


def test_turns_are_those_of_the_rotation_vector(traces):
    agree = []
    for trace in traces:
        told_us = trace.steps.told_us
        turns = TurnDetector(Turning()).advance(
            trace.level.time_us, trace.level.turn_rate_rad_s, told_us
        )
        yaw = np.unwrap(azimuth_to_heading(trace.azimuth_rad))
        rows = np.searchsorted(trace.level.time_us, told_us) - 1
        turned = np.diff(yaw[rows])
        assert rms_deg(turns.angle_rad[1:] - turned) < 2
        agree.append(turns.turning[1:] == (np.abs(turned) > Turning().band_rad))
    assert np.concatenate(agree).mean() > 0.97


def known_walk(trace):
    """Steps between the first and the last way point, and the way along all of them."""
    steps = trace.steps
    felt = StepFeatureReader(StepFelt()).advance(
        trace.imu.time_us, step_signal_m_s2(trace.imu), steps.time_us, steps.told_us
    )
    begin_us, end_us = trace.marks[[0, -1], 0]
    inside = (steps.time_us >= begin_us) & (steps.time_us <= end_us)
    columns = {each.name: getattr(felt, each.name)[inside] for each in fields(StepFeatures)}
    way_m = np.hypot(*np.diff(trace.marks[:, 1:], axis=0).T).sum()
    return KnownWalk(features=StepFeatures(**columns), distance_m=float(way_m))


@pytest.mark.parametrize(
    ("model", "limit"),
    [(FrequencyVariance(), 0.10), (PeriodPeak(), 0.10), (Weinberg(), 0.10), (Kim(), 0.06)],
    ids=["frequency-variance", "period-peak", "weinberg", "kim"],
)
def test_a_walk_is_as_long_as_the_others_teach(traces, model, limit):
    # Several people and phones: mean absolute error of the length of the walk left out.
    walks = [known_walk(trace) for trace in traces]
    shares = []
    for i, left_out in enumerate(walks):
        fitted = fit_step_length(model, walks[:i] + walks[i + 1 :], ridge=1e-3)
        shares.append(fitted.length_m(left_out.features).sum() / left_out.distance_m - 1)
    assert np.abs(shares).mean() < limit


def test_weinberg_of_recorded_walks(traces):
    fitted = fit_step_length(Weinberg(), [known_walk(trace) for trace in traces])
    assert 0.33 < fitted.k < 0.43
