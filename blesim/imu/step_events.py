"""Step events as a phone reports them: the true steps, seen through a phone's estimates."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim.columns import CARRYINGS, LONGEST_STEP_M
from blesim.imu.compass import CompassErrors
from blesim.rng import Draws
from blesim.settings import Settings
from blesim.tables import Carrying, Steps, StepTruth
from blesim.units import to_us, wrap_angle

# Steps whose headings differ by less belong to the same straight stretch.
_SAME_STRETCH_RAD = np.radians(10.0)
_TROLLEY = dict(CARRYINGS)["trolley"]
# Extra steps come within this time after the phone has been taken up.
_HANDLING_US = to_us(1.0)


class StepSensor(Settings):
    """How well a phone reads steps, and the heading of each.

    Without further settings every step is told at once. No phone feels steps in a trolley.

    Attributes
    ----------
    length_scale_std : float
        Spread between walkers of the ratio of read to true step length; assumed. [-]
    length_std_m : float
        Spread of single readings of the length; assumed. [m]
    stretch_heading_std_deg : float
        Spread between straight stretches of the heading error, which is a bias within each:
        11 to 14 measured. [degree]
    step_heading_std_deg : float
        Spread of the heading error within a stretch: 5.8 measured. [degree]
    compass : CompassErrors or None
        In place of both: an error that depends on the direction.
    delay_s, delay_std_s : float
        Mean and spread of the time after which a step is told. [s]
    batch_s : float
        Events are handed over together, every so often; 0 for at once. [s]
    missed : float
        Share of the steps that are not told. [-]
    extra_steps : float
        Mean number of steps told that were none, each time the phone is carried in another way.
        [-]
    """

    length_scale_std: float = Field(default=0.05, ge=0, le=0.3)
    length_std_m: float = Field(default=0.03, ge=0, le=0.3)
    stretch_heading_std_deg: float = Field(default=12.0, ge=0, le=90)
    step_heading_std_deg: float = Field(default=5.8, ge=0, le=90)
    compass: CompassErrors | None = None
    delay_s: float = Field(default=0.0, ge=0, le=10)
    delay_std_s: float = Field(default=0.0, ge=0, le=5)
    batch_s: float = Field(default=0.0, ge=0, le=60)
    missed: float = Field(default=0.0, ge=0, le=1)
    extra_steps: float = Field(default=0.0, ge=0, le=10)


# Android asks of a step detector that it answers within 2 s (its documentation of sensor types).
# Apple's pedometer was seen to call back about every 2.5 s (field reports). Delays and shares
# within these: assumed; step counts of phones are off by a few per cent.
STEP_SENSORS: Mapping[str, StepSensor] = MappingProxyType(
    {
        "android": StepSensor(delay_s=0.6, delay_std_s=0.2, missed=0.02, extra_steps=0.5),
        "ios": StepSensor(delay_s=0.3, delay_std_s=0.1, batch_s=2.5, missed=0.02, extra_steps=0.3),
    }
)


def read_steps(
    truth: StepTruth,
    sensor: StepSensor,
    seed: int,
    walker: str,
    carrying: Carrying | None = None,
    until_us: int | None = None,
) -> Steps:
    """Step events of a phone.

    Parameters
    ----------
    truth : StepTruth
        The steps taken.
    sensor : StepSensor
        How well the phone reads them.
    seed, walker : int, str
        Address of the draws.
    carrying : Carrying or None
        How the phone is carried; without it, so that it feels every step.
    until_us : int or None
        Time after which nothing is told: the end of the walk. [us]

    Returns
    -------
    Steps
        In the order in which they are told; no length beyond what a recording holds.
    """
    estimated = _estimated(truth, sensor, seed, walker)
    felt = _detected(truth, sensor, seed, walker)
    if carrying is not None:
        felt &= carrying.at(truth.time_us) != _TROLLEY
    extra_us, like = _extra(truth, sensor, carrying, seed, walker)
    rows = np.concatenate([np.flatnonzero(felt), like])
    happened_us = np.concatenate([truth.time_us[felt], extra_us])
    told_us = _told(happened_us, rows, sensor, seed, walker)
    order = np.argsort(told_us, kind="stable")
    if until_us is not None:
        order = order[told_us[order] <= until_us]
    rows = rows[order]
    return Steps(
        time_us=told_us[order],
        length_m=estimated.length_m[rows],
        heading_rad=estimated.heading_rad[rows],
    )


def _estimated(truth: StepTruth, sensor: StepSensor, seed: int, walker: str) -> Steps:
    """What the phone makes of every step, at its time."""
    once = Draws(seed=seed, purpose="step length scale", walker=walker).normals(np.zeros(1, int))
    single = Draws(seed=seed, purpose="step reading", walker=walker).normals(np.arange(len(truth)))
    scale = 1.0 + sensor.length_scale_std * once[0, 0]
    if sensor.compass is not None:
        heading_rad = sensor.compass.measured_heading_rad(truth.heading_rad, single[:, 0])
    else:
        error_deg = stretch_biases_deg(truth, sensor, seed, walker)
        error_deg = error_deg + sensor.step_heading_std_deg * single[:, 0]
        heading_rad = wrap_angle(truth.heading_rad + np.radians(error_deg))
    return Steps(
        time_us=truth.time_us,
        length_m=np.clip(
            scale * truth.length_m + sensor.length_std_m * single[:, 1], 0.0, LONGEST_STEP_M
        ),
        heading_rad=heading_rad,
    )


def stretch_biases_deg(
    truth: StepTruth, sensor: StepSensor, seed: int, walker: str
) -> NDArray[np.float64]:
    """Heading error of the straight stretch that each step belongs to, (n,). [degree]."""
    draws = Draws(seed=seed, purpose="stretch heading", walker=walker)
    return sensor.stretch_heading_std_deg * draws.normals(_stretch(truth.heading_rad))[:, 0]


def _stretch(heading_rad: NDArray[np.floating]) -> NDArray[np.int64]:
    """Number of the straight stretch each step belongs to, (n,)."""
    turned = np.abs(wrap_angle(np.diff(heading_rad))) > _SAME_STRETCH_RAD
    return np.concatenate([np.zeros(min(len(heading_rad), 1), int), np.cumsum(turned)])


def _detected(truth: StepTruth, sensor: StepSensor, seed: int, walker: str) -> NDArray[np.bool_]:
    """Whether each step is felt at all, (n,)."""
    draws = Draws(seed=seed, purpose="step detection", walker=walker)
    return draws.uniforms(np.arange(len(truth)))[:, 0] >= sensor.missed


def _told(
    happened_us: NDArray[np.int64],
    rows: NDArray[np.int64],
    sensor: StepSensor,
    seed: int,
    walker: str,
) -> NDArray[np.int64]:
    """When each event reaches the application, (n,). [us]."""
    draws = Draws(seed=seed, purpose="step delay", walker=walker).normals(rows)[:, 0]
    delay_s = np.maximum(sensor.delay_s + sensor.delay_std_s * draws, 0.0)
    told_us = happened_us + np.rint(delay_s * 1e6).astype(np.int64)
    if sensor.batch_s > 0:
        batch_us = to_us(sensor.batch_s)
        told_us = -(-told_us // batch_us) * batch_us
    return told_us


def _extra(
    truth: StepTruth, sensor: StepSensor, carrying: Carrying | None, seed: int, walker: str
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Times of steps that were none, and the true steps that they are taken for."""
    if carrying is None or sensor.extra_steps == 0 or len(truth) == 0:
        return np.empty(0, np.int64), np.empty(0, np.int64)
    switches_us = carrying.time_us[1:]
    draws = Draws(seed=seed, purpose="extra step", walker=walker)
    generator = draws.uniforms(np.arange(len(switches_us)))
    # Whole steps of the mean, and one more with the probability of the rest.
    count = np.floor(sensor.extra_steps + generator[:, 0]).astype(np.int64)
    number = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    share = (number + np.repeat(generator[:, 1], count)) / np.repeat(np.maximum(count, 1), count)
    time_us = np.repeat(switches_us, count) + (share * _HANDLING_US).astype(np.int64)
    return time_us, np.minimum(np.searchsorted(truth.time_us, time_us), len(truth) - 1)
