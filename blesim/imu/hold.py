"""How the phone is held over a walk: the attitude of each hold, and the way to the next."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from blesim.imu.carriage import ATTITUDES, HEIGHT, MODES, ORDERED, SWITCH_S
from blesim.rng import Draws
from blesim.tables import Carrying
from blesim.units import MICROSECONDS_PER_SECOND

# Columns of a hold: when it begins, how long the switch to it takes, its mode, the axis (3) and
# angle of the rotation from the one before, how much higher it is, its attitude (9), and that of
# the one before (9).
HOLD_BEGIN, SWITCH, MODE, AXIS, ANGLE, RISE, ATTITUDE, EARLIER = 0, 1, 2, 3, 6, 7, 8, 17
_COLUMNS = 26


def holds(carrying: Carrying, start_us: int, seed: int, walker: str) -> NDArray[np.float64]:
    """One row for each hold of the phone.

    Parameters
    ----------
    carrying : Carrying
        One row or more, the first not after `start_us`.
    start_us : int
        Time from which times are counted. [us]
    seed, walker : int, str
        Address of the draws.

    Returns
    -------
    ndarray of float64, (n, 26)
        See the names of the columns. [s], [-], [rad], [m]
    """
    rows = np.zeros((len(carrying), _COLUMNS))
    begin_s = (carrying.time_us - start_us) / MICROSECONDS_PER_SECOND
    rows[:, HOLD_BEGIN], rows[:, MODE] = begin_s, carrying.carrying
    # A hold that is given up at once is reached in the time there is.
    rows[:, SWITCH] = np.minimum(SWITCH_S, np.append(np.diff(begin_s), np.inf))
    attitudes = _attitudes(carrying, seed, walker)
    rows[:, ATTITUDE : ATTITUDE + 9] = attitudes.reshape(-1, 9)
    if len(rows) > 1:
        _add_switches(rows, attitudes)
    return rows


def _attitudes(carrying: Carrying, seed: int, walker: str) -> NDArray[np.float64]:
    """Rotation of each hold from the phone's frame to the walker's, (n, 3, 3). [-]."""
    draws = Draws(seed=seed, purpose="hold", walker=walker).normals(np.arange(len(carrying)))
    spread_rad = np.radians([ORDERED[mode].hold_deg for mode in carrying.carrying])
    turned = Rotation.from_rotvec(spread_rad[:, None] * draws[:, :3]).as_matrix()
    return turned @ ATTITUDES[carrying.carrying]


def _add_switches(rows: NDArray[np.float64], attitudes: NDArray[np.float64]) -> None:
    """Fill in the rotation from each hold to the next: about one axis, the shortest way."""
    between = np.swapaxes(attitudes[:-1], 1, 2) @ attitudes[1:]
    vector = Rotation.from_matrix(between).as_rotvec()
    angle = np.linalg.norm(vector, axis=1)
    rows[1:, AXIS : AXIS + 3] = vector / np.where(angle > 0, angle, 1.0)[:, None]
    rows[1:, ANGLE] = angle
    rows[1:, RISE] = np.diff(MODES[rows[:, MODE].astype(int), HEIGHT])
    rows[1:, EARLIER : EARLIER + 9] = attitudes[:-1].reshape(-1, 9)
