"""People on the link: the carrier's own body, how a standing person sways, and the others."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim.kernels import kernel
from blesim.rng import Draws
from blesim.settings import Settings
from blesim.tables import Trajectory

SWAY_STEP_US = 100_000
CROWD_STEP_US = 500_000
PERSON_RADIUS_M = 0.25
PERSON_HEIGHT_M = 1.75


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
    """

    body_loss_db: float = Field(default=8.0, ge=0, le=40)
    sway_m: float = Field(default=0.015, ge=0, le=0.5)
    sway_s: float = Field(default=2.0, gt=0, le=60)
    crossing_db: float = Field(default=4.0, ge=0, le=40)


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Crowd:
    """Where everybody is, every half second: rows first[k] to first[k + 1] are there in step k."""

    first: NDArray[np.int64]
    walker: NDArray[np.int64]
    xy_m: NDArray[np.float64]
    row_of: Mapping[str, int]

    @classmethod
    def of(cls, trajectories: Mapping[str, Trajectory]) -> Self:
        """The crowd of some walkers by name; may be empty."""
        parts = [_present(row, trajectory) for row, trajectory in enumerate(trajectories.values())]
        step = np.concatenate([np.empty(0, np.int64), *(part[0] for part in parts)])
        walker = np.concatenate([np.empty(0, np.int64), *(part[1] for part in parts)])
        xy_m = np.concatenate([np.empty((0, 2)), *(part[2] for part in parts)])
        order = np.argsort(step, kind="stable")
        count = np.bincount(step) if len(step) else np.zeros(0, np.int64)
        return cls(
            first=np.concatenate([[0], np.cumsum(count)]).astype(np.int64),
            walker=walker[order],
            xy_m=xy_m[order],
            row_of={name: row for row, name in enumerate(trajectories)},
        )

    def crossings(
        self,
        time_us: NDArray[np.int64],
        phone_m: NDArray[np.float64],
        beacon_m: NDArray[np.float64],
        walker: str,
    ) -> NDArray[np.int64]:
        """How many others stand on each link.

        Parameters
        ----------
        time_us : ndarray of int64, (n,)
            [us]
        phone_m, beacon_m : ndarray of float64, (n, 3)
            Ends of the links: x, y, height. [m]
        walker : str
            Who carries the phone, and is not counted.

        Returns
        -------
        ndarray of int64, (n,)
        """
        out = np.zeros(len(time_us), np.int64)
        own = self.row_of.get(walker, -1)
        _count_people(time_us, phone_m, beacon_m, self.first, self.walker, self.xy_m, own, out)
        return out


def _present(
    row: int, trajectory: Trajectory
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Steps at which a walker is there, their row, and their places."""
    first, last = trajectory.time_us[0] // CROWD_STEP_US, trajectory.time_us[-1] // CROWD_STEP_US
    step = np.arange(first, last + 1)
    middle_us = step * CROWD_STEP_US + CROWD_STEP_US // 2
    poses = trajectory.at(np.clip(middle_us, trajectory.time_us[0], trajectory.time_us[-1]))
    return step, np.full(len(step), row), np.stack([poses.x_m, poses.y_m], axis=1)


@kernel
def _count_people(
    time_us: NDArray[np.int64],
    phone_m: NDArray[np.float64],
    beacon_m: NDArray[np.float64],
    first: NDArray[np.int64],
    walker: NDArray[np.int64],
    xy_m: NDArray[np.float64],
    own: int,
    out: NDArray[np.int64],
) -> None:
    for row in range(len(time_us)):
        step = time_us[row] // CROWD_STEP_US
        if step >= len(first) - 1:
            continue
        along_x, along_y = beacon_m[row, 0] - phone_m[row, 0], beacon_m[row, 1] - phone_m[row, 1]
        square = max(along_x * along_x + along_y * along_y, 1e-12)
        for person in range(first[step], first[step + 1]):
            if walker[person] == own:
                continue
            to_x, to_y = xy_m[person, 0] - phone_m[row, 0], xy_m[person, 1] - phone_m[row, 1]
            share = (to_x * along_x + to_y * along_y) / square
            aside = to_x * along_y - to_y * along_x
            height_m = phone_m[row, 2] + share * (beacon_m[row, 2] - phone_m[row, 2])
            near = aside * aside <= PERSON_RADIUS_M * PERSON_RADIUS_M * square
            if 0.0 < share < 1.0 and near and height_m < PERSON_HEIGHT_M:
                out[row] += 1
