"""The heading that a phone's system fuses from gyroscope, accelerometer and magnetometer."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim.columns import CARRYINGS
from blesim.imu.drift import drift
from blesim.imu.step_events import StepSensor, stretch_biases_deg
from blesim.kernels import kernel
from blesim.rng import Draws
from blesim.settings import Settings
from blesim.tables import Carrying, Headings, StepTruth, Trajectory
from blesim.units import MICROSECONDS_PER_SECOND, to_us, wrap_angle

_LOOSE = [dict(CARRYINGS)[name] for name in ("swinging", "pocket", "bag", "trolley")]


class HeadingSensor(Settings):
    """How the system tells headings; how wrong they are, the `StepSensor` says.

    Attributes
    ----------
    rate_hz : float
        Headings a second. [Hz]
    lag_s : float
        Age of what is told; assumed. [s]
    settling_s : float
        Time in which the fusion takes up the magnetic bias of a new stretch, to 1/e; assumed. [s]
    memory_s : float
        Time after which the error within a stretch is forgotten to 1/e; assumed. [s]
    loose_deg : float
        Spread, from one hold to the next, of the angle between phone and walker where the phone is
        not held ahead: in a swinging hand, a pocket, a bag, a trolley; assumed. [degree]
    """

    rate_hz: float = Field(default=10.0, ge=0.1, le=200)
    lag_s: float = Field(default=0.1, ge=0, le=5)
    settling_s: float = Field(default=1.0, ge=0, le=60)
    memory_s: float = Field(default=2.0, gt=0, le=600)
    loose_deg: float = Field(default=20.0, ge=0, le=180)


# Both systems hand over fused headings as fast as an application asks; that Apple's settles more
# slowly, and is smoother, is assumed.
HEADING_SENSORS: Mapping[str, HeadingSensor] = MappingProxyType(
    {
        "android": HeadingSensor(rate_hz=10.0, lag_s=0.1, settling_s=1.0),
        "ios": HeadingSensor(rate_hz=10.0, lag_s=0.15, settling_s=2.0, memory_s=4.0),
    }
)


def fused_heading(
    trajectory: Trajectory,
    steps: StepTruth,
    carrying: Carrying,
    heading: HeadingSensor,
    sensor: StepSensor,
    seed: int,
    walker: str,
) -> Headings:
    """Headings as the system tells them.

    The heading of a moment ago, plus the bias of the stretch, plus an error within it. The biases
    are those of the step events; with a compass in the step sensor, its error stands in their
    place.

    Parameters
    ----------
    trajectory : Trajectory
        The walk.
    steps : StepTruth
        The steps taken, which tell the straight stretches.
    carrying : Carrying
        How the phone is carried.
    heading, sensor : HeadingSensor, StepSensor
        How the system tells headings, and how wrong it is.
    seed, walker : int, str
        Address of the draws.

    Returns
    -------
    Headings
        At a regular rate from the first to the last time of the walk.
    """
    start_us, end_us = int(trajectory.time_us[0]), int(trajectory.time_us[-1])
    period_us = MICROSECONDS_PER_SECOND / heading.rate_hz
    count = int((end_us - start_us) / period_us + 1e-6) + 1
    time_us = start_us + np.rint(np.arange(count) * period_us).astype(np.int64)
    seen_us = np.maximum(time_us - to_us(heading.lag_s), start_us)
    kept = float(np.exp(-1.0 / (heading.rate_hz * heading.memory_s)))
    within = drift(Draws(seed=seed, purpose="fused heading", walker=walker), count, kept)[:, 0]
    true_rad = trajectory.at(seen_us).heading_rad
    if sensor.compass is not None:
        told_rad = sensor.compass.measured_heading_rad(true_rad, within)
    else:
        bias_deg = _bias_deg(seen_us, steps, sensor, seed, walker)
        _settle(bias_deg, _share_kept(heading))
        error_deg = bias_deg + sensor.step_heading_std_deg * within
        told_rad = true_rad + np.radians(error_deg)
    loose_rad = np.radians(_loose_deg(seen_us, carrying, heading, seed, walker))
    return Headings(time_us=time_us, heading_rad=wrap_angle(told_rad + loose_rad))


def _share_kept(heading: HeadingSensor) -> float:
    """Share of the earlier bias that remains after one period. [-]."""
    if heading.settling_s == 0:
        return 0.0
    return float(np.exp(-1.0 / (heading.rate_hz * heading.settling_s)))


def _bias_deg(
    time_us: NDArray[np.int64], steps: StepTruth, sensor: StepSensor, seed: int, walker: str
) -> NDArray[np.float64]:
    """Bias of the stretch at some times, (n,): that of the next step. [degree]."""
    if len(steps) == 0:
        return np.zeros(len(time_us))
    following = np.minimum(np.searchsorted(steps.time_us, time_us), len(steps) - 1)
    return stretch_biases_deg(steps, sensor, seed, walker)[following]


def _loose_deg(
    time_us: NDArray[np.int64], carrying: Carrying, heading: HeadingSensor, seed: int, walker: str
) -> NDArray[np.float64]:
    """Angle between phone and walker at some times, (n,). [degree]."""
    row = np.maximum(np.searchsorted(carrying.time_us, time_us, side="right") - 1, 0)
    draws = Draws(seed=seed, purpose="loose heading", walker=walker)
    angle_deg = heading.loose_deg * draws.normals(np.arange(len(carrying)))[:, 0]
    return np.where(np.isin(carrying.at(time_us), _LOOSE), angle_deg[row], 0.0)


@kernel
def _settle(values: NDArray[np.float64], kept: float) -> None:
    """Let each value approach the one asked for, in place (kernel)."""
    for row in range(1, len(values)):
        values[row] += kept * (values[row - 1] - values[row])
