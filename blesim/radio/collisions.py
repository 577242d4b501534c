"""Collisions: packets of two beacons on the same channel at the same time."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim.kernels import kernel
from blesim.settings import Settings


class Collisions(Settings):
    """Whether packets that overlap destroy each other.

    Attributes
    ----------
    model : str
        ``capture``: a packet survives if every other one that overlaps it on its channel is weaker
        by the threshold; ``none``. A packet that is cut off by the edge of a scan window takes no
        part.
    capture_db : float
        The threshold; receivers' data sheets give a co-channel rejection of 13 to 14, and 10 leaves
        room for its spread. [dB]
    """

    model: Literal["capture", "none"] = "capture"
    capture_db: float = Field(default=10.0, ge=0, le=60)


def collided(
    time_us: NDArray[np.int64],
    duration_us: NDArray[np.int64],
    channel: NDArray[np.int64],
    power_dbm: NDArray[np.float64],
    capture_db: float,
) -> NDArray[np.bool_]:
    """Which packets a phone loses to others.

    Parameters
    ----------
    time_us, duration_us : ndarray of int64, (n,)
        Start, in ascending order, and length of the packets. [us]
    channel : ndarray of int64, (n,)
    power_dbm : ndarray of float64, (n,)
        At the phone. [dBm]
    capture_db : float
        By how much a packet must be the stronger one. [dB]

    Returns
    -------
    ndarray of bool, (n,)
    """
    out = np.zeros(len(time_us), bool)
    _mark(time_us, duration_us, channel, power_dbm, capture_db, out)
    return out


@kernel
def _mark(
    time_us: NDArray[np.int64],
    duration_us: NDArray[np.int64],
    channel: NDArray[np.int64],
    power_dbm: NDArray[np.float64],
    capture_db: float,
    out: NDArray[np.bool_],
) -> None:
    for early in range(len(time_us)):
        late = early + 1
        while late < len(time_us) and time_us[late] < time_us[early] + duration_us[early]:
            if channel[late] == channel[early]:
                lead_db = power_dbm[early] - power_dbm[late]
                out[early] |= lead_db < capture_db
                out[late] |= -lead_db < capture_db
            late += 1
