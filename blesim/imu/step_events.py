"""Step events as a phone reports them: the true steps, seen through a phone's estimates."""

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim.columns import LONGEST_STEP_M
from blesim.rng import Draws
from blesim.settings import Settings
from blesim.tables import Steps, StepTruth
from blesim.units import wrap_angle

# Steps whose headings differ by less belong to the same straight stretch.
_SAME_STRETCH_RAD = np.radians(10.0)


class StepSensor(Settings):
    """How well a phone reads steps.

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
    """

    length_scale_std: float = Field(default=0.05, ge=0, le=0.3)
    length_std_m: float = Field(default=0.03, ge=0, le=0.3)
    stretch_heading_std_deg: float = Field(default=12.0, ge=0, le=90)
    step_heading_std_deg: float = Field(default=5.8, ge=0, le=90)


def read_steps(truth: StepTruth, sensor: StepSensor, seed: int, walker: str) -> Steps:
    """Step events of a phone.

    Parameters
    ----------
    truth : StepTruth
        The steps taken.
    sensor : StepSensor
        How well the phone reads them.
    seed, walker : int, str
        Address of the draws.

    Returns
    -------
    Steps
        One for each true step, at its time; no length beyond what a recording holds.
    """
    ordinals = np.arange(len(truth))
    stretch = _stretch(truth.heading_rad)
    once = Draws(seed=seed, purpose="step length scale", walker=walker).normals(np.zeros(1, int))
    biases = Draws(seed=seed, purpose="stretch heading", walker=walker).normals(stretch)
    single = Draws(seed=seed, purpose="step reading", walker=walker).normals(ordinals)
    scale = 1.0 + sensor.length_scale_std * once[0, 0]
    heading_error_deg = (
        sensor.stretch_heading_std_deg * biases[:, 0] + sensor.step_heading_std_deg * single[:, 0]
    )
    return Steps(
        time_us=truth.time_us,
        length_m=np.clip(
            scale * truth.length_m + sensor.length_std_m * single[:, 1], 0.0, LONGEST_STEP_M
        ),
        heading_rad=wrap_angle(truth.heading_rad + np.radians(heading_error_deg)),
    )


def _stretch(heading_rad: NDArray[np.floating]) -> NDArray[np.int64]:
    """Number of the straight stretch each step belongs to, (n,)."""
    turned = np.abs(wrap_angle(np.diff(heading_rad))) > _SAME_STRETCH_RAD
    return np.concatenate([np.zeros(min(len(heading_rad), 1), int), np.cumsum(turned)])
