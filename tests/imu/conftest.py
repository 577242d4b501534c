"""Walks, ways of carrying and perfect sensors that the tests of the phone's senses share."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from blesim import columns
from blesim.imu.feel import feel
from blesim.imu.magnetics import Magnetics
from blesim.imu.sensors import Accelerometer, Gyroscope, ImuSettings, Magnetometer
from blesim.tables import Carrying, Imu, StepTruth, Trajectory
from blesim.units import wrap_angle
from blesim.walkers.gait import Gait, steps_of

STATE = dict(columns.STATES)
CODE = dict(columns.CARRYINGS)
TURN_S = 0.8


def _trajectory(rows) -> Trajectory:
    time_s, x_m, y_m, heading_rad, speed_m_s, state = np.array(rows, dtype=float).T
    count = len(rows)
    return Trajectory(
        time_us=np.rint(time_s * 1e6).astype(int),
        x_m=x_m,
        y_m=y_m,
        level=np.zeros(count, int),
        heading_rad=wrap_angle(heading_rad),
        speed_m_s=speed_m_s,
        edge=np.full(count, -1),
        offset_m=np.full(count, np.nan),
        edge_speed_m_s=np.zeros(count),
        state=state.astype(int),
    )


def _route(places, speed_m_s=1.0, rest_s=4.0) -> Trajectory:
    """A walk from place to place, turning in between, resting before and after."""
    legs = [(np.subtract(b, a), a, b) for a, b in pairwise(np.array(places, dtype=float))]
    time_s, heading = rest_s, np.arctan2(legs[0][0][1], legs[0][0][0])
    rows = [(0.0, *places[0], heading, 0.0, STATE["standing"])] if rest_s else []
    for step, start, _ in legs:
        new = heading + wrap_angle(np.arctan2(step[1], step[0]) - heading)
        if abs(new - heading) > 1e-9:
            rows.append((time_s, *start, heading, 0.0, STATE["turning"]))
            time_s += TURN_S
        heading = new
        rows.append((time_s, *start, heading, speed_m_s, STATE["walking"]))
        time_s += np.hypot(*step) / speed_m_s
    rows.append((time_s, *places[-1], heading, 0.0, STATE["standing"]))
    rows.append((time_s + rest_s, *places[-1], heading, 0.0, STATE["standing"]))
    return _trajectory(rows)


@pytest.fixture(scope="session")
def route() -> Callable[..., Trajectory]:
    return _route


@pytest.fixture(scope="session")
def standing() -> Callable[[float], Trajectory]:
    """Somebody who stands for some seconds."""
    return lambda duration_s: _trajectory(
        [(t, 0.0, 0.0, 0.0, 0.0, STATE["standing"]) for t in (0.0, duration_s)]
    )


@pytest.fixture(scope="session")
def carried() -> Callable[..., Carrying]:
    """How the phone is carried: names, or pairs of seconds and names."""

    def build(*rows) -> Carrying:
        pairs = [row if isinstance(row, tuple) else (0.0, row) for row in rows]
        return Carrying(
            time_us=np.array([round(time_s * 1e6) for time_s, _ in pairs]),
            carrying=np.array([CODE[name] for _, name in pairs]),
        )

    return build


@pytest.fixture(scope="session")
def perfect() -> ImuSettings:
    """Sensors without any error."""
    same = {"scale_percent": 0.0, "misalignment_deg": 0.0}
    return ImuSettings(
        jitter_ms=0.0,
        accelerometer=Accelerometer(
            noise_ug_per_rthz=0, bias_mg=0, instability_ug=0, resolution_m_s2=0, range_m_s2=400,
            **same,
        ),
        gyroscope=Gyroscope(
            noise_mdps_per_rthz=0, bias_dps=0, instability_dph=0, resolution_rad_s=0,
            range_rad_s=100, **same,
        ),
        magnetometer=Magnetometer(
            noise_ut=0, hard_iron_ut=0, soft_iron_percent=0, instability_ut=0, resolution_ut=0,
            **same,
        ),
    )  # fmt: skip


@pytest.fixture(scope="session")
def felt(carried) -> Callable[..., tuple[Imu, StepTruth]]:
    """What a phone feels on a walk, and the steps taken."""

    def build(phone, trajectory, carrying="hand", seed=3, walker="w", gait=None, magnetics=None):
        steps = steps_of(trajectory, gait or Gait(), seed, walker)
        how = carrying if isinstance(carrying, Carrying) else carried(carrying)
        sensed = feel(phone, magnetics or Magnetics(), trajectory, steps, how, seed, walker)
        return sensed.imu, steps

    return build


@pytest.fixture(scope="session")
def axes() -> Callable[[Imu, str], np.ndarray]:
    """The three axes of one sensor, (n, 3), by the beginning of the columns' names."""

    def build(imu: Imu, name: str) -> np.ndarray:
        fields = [c.field for c in columns.IMU.columns if c.field.startswith(name)]
        return np.stack([getattr(imu, field).astype(float) for field in fields], axis=1)

    return build
