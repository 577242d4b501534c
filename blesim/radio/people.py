"""People on the link: the carrier's own body, and how a standing person sways."""

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim.kernels import kernel
from blesim.radio.carrying import WaysOfCarrying
from blesim.rng import Draws
from blesim.settings import Settings

SWAY_STEP_US = 100_000


class People(Settings):
    """What people do to a link.

    Attributes
    ----------
    body_loss_db : float
        Loss when the carrier's back is turned to the beacon, over that when facing it: 4 to 10
        measured in rooms, 17 to 20 in an anechoic chamber. [dB]
    sway_m : float
        Spread, along each axis, of the place of a phone whose carrier stands still. [m]
    sway_s : float
        Time after which the sway is forgotten to 1/e; the level of a standing person's link was
        measured to do so after 1.4 to 2.5. [s]
    crossing_db : float
        Loss of each other person on the line of sight; assumed. A dense crowd was measured to move
        the level by up to 16.5. [dB]
    carrying : WaysOfCarrying
        What carrying the phone otherwise than in the hand changes.
    """

    body_loss_db: float = Field(default=8.0, ge=0, le=40)
    sway_m: float = Field(default=0.015, ge=0, le=0.5)
    sway_s: float = Field(default=2.0, gt=0, le=60)
    crossing_db: float = Field(default=4.0, ge=0, le=40)
    carrying: WaysOfCarrying = WaysOfCarrying()


def body_loss_db(cosine_to_beacon: NDArray[np.float64], body_loss_db: float) -> NDArray[np.float64]:
    """Loss through the carrier's body: ``L (1 - cos(angle)) / 2``.

    Parameters
    ----------
    cosine_to_beacon : ndarray of float64, (n,)
        Of the angle between the carrier's heading and the direction to the beacon. [-]
    body_loss_db : float
        Loss at 180 degrees; none at 0. [dB]

    Returns
    -------
    ndarray of float64, (n,)
        [dB]
    """
    return 0.5 * body_loss_db * (1.0 - cosine_to_beacon)


def sway_m(
    people: People, seed: int, walker: str, start_us: int, end_us: int
) -> NDArray[np.float64]:
    """How far a carrier sways from their place, every 100 ms from `start_us` to after `end_us`.

    An Ornstein-Uhlenbeck process along each axis: spread ``sway_m``, autocorrelation
    ``exp(-t / sway_s)``.

    Returns
    -------
    ndarray of float64, (n, 2)
        [m]
    """
    count = (end_us - start_us) // SWAY_STEP_US + 2
    draws = Draws(seed=seed, purpose="sway", walker=walker)
    deviates = people.sway_m * draws.normals(np.arange(count))[:, :2]
    kept = np.exp(-SWAY_STEP_US * 1e-6 / people.sway_s)
    _remember(deviates, kept)
    return deviates


@kernel
def _remember(deviates: NDArray[np.float64], kept: float) -> None:
    """Turn independent deviates into a process that keeps a share of itself each step (kernel)."""
    new = np.sqrt(1.0 - kept * kept)
    for row in range(1, len(deviates)):
        for axis in range(deviates.shape[1]):
            deviates[row, axis] = kept * deviates[row - 1, axis] + new * deviates[row, axis]
