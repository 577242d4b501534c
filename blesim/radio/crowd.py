"""The other people on a link: where everybody is, and how many stand between phone and beacon."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from blesim.kernels import kernel
from blesim.radio.places import fill_steps
from blesim.tables import Trajectory

CROWD_STEP_US = 500_000
# Of a person as an upright cylinder, shoulders and head alike; assumed.
PERSON_RADIUS_M = 0.25
PERSON_HEIGHT_M = 1.75


@dataclass(frozen=True, slots=True, kw_only=True)
class Crowd:
    """Everybody on one level, by name, and when each comes and goes, (n, 2). [us].

    Places are taken every half second, and worked out only for the time that is asked about: a day
    of thousands of people takes no more memory than their trajectories.
    """

    trajectories: Mapping[str, Trajectory]
    stay_us: NDArray[np.int64]

    @classmethod
    def of(cls, trajectories: Mapping[str, Trajectory]) -> Self:
        """The crowd of some walkers by name; may be empty."""
        stays = [(walk.time_us[0], walk.time_us[-1]) for walk in trajectories.values()]
        return cls(
            trajectories=trajectories, stay_us=np.array(stays, dtype=np.int64).reshape(-1, 2)
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
            In any order; memory grows with the time between the first and the last. [us]
        phone_m, beacon_m : ndarray of float64, (n, 3)
            Ends of the links: x, y, height. [m]
        walker : str
            Who carries the phone, and is not counted.

        Returns
        -------
        ndarray of int64, (n,)
        """
        out = np.zeros(len(time_us), np.int64)
        if len(time_us):
            first = int(time_us.min()) // CROWD_STEP_US
            steps = int(time_us.max()) // CROWD_STEP_US - first + 1
            x_m, y_m = self._places(first, steps, walker)
            _count_people(time_us, phone_m, beacon_m, first, x_m, y_m, out)
        return out

    def _places(
        self, first: int, steps: int, walker: str
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Places of the others in some steps, two (steps, people), NaN for who is not there."""
        arrives, leaves = (self.stay_us // CROWD_STEP_US).T
        there = np.flatnonzero((arrives < first + steps) & (leaves >= first))
        names = list(self.trajectories)
        others = [names[row] for row in there if names[row] != walker]
        x_m, y_m = np.full((2, steps, len(others)), np.nan)
        for column, name in enumerate(others):
            here = (x_m[:, column], y_m[:, column])
            fill_steps(self.trajectories[name], first, CROWD_STEP_US, *here)
        return x_m, y_m


@kernel
def _count_people(
    time_us: NDArray[np.int64],
    phone_m: NDArray[np.float64],
    beacon_m: NDArray[np.float64],
    first_step: int,
    x_m: NDArray[np.float64],
    y_m: NDArray[np.float64],
    out: NDArray[np.int64],
) -> None:
    for row in range(len(time_us)):
        phone_x, phone_y = phone_m[row, 0], phone_m[row, 1]
        along_x, along_y = beacon_m[row, 0] - phone_x, beacon_m[row, 1] - phone_y
        square = max(along_x * along_x + along_y * along_y, 1e-12)
        low, high = _below_heads(phone_m[row, 2], beacon_m[row, 2])
        nearest, farthest = low * square, high * square
        widest = PERSON_RADIUS_M * PERSON_RADIUS_M * square
        step = time_us[row] // CROWD_STEP_US - first_step
        count = 0
        for person in range(x_m.shape[1]):
            to_x, to_y = x_m[step, person] - phone_x, y_m[step, person] - phone_y
            way = to_x * along_x + to_y * along_y
            aside = to_x * along_y - to_y * along_x
            # Without branches the machine takes several people at a time; NaN is on no link.
            count += (way > nearest) & (way < farthest) & (aside * aside <= widest)
        out[row] = count


@kernel
def _below_heads(phone: float, beacon: float) -> tuple[float, float]:
    """Part of a link, as shares, on which somebody would be in the way (kernel)."""
    if phone < PERSON_HEIGHT_M:
        rise = beacon - phone
        above = beacon > PERSON_HEIGHT_M
        return 0.0, (PERSON_HEIGHT_M - phone) / rise if above else 1.0
    if beacon < PERSON_HEIGHT_M:
        return (PERSON_HEIGHT_M - phone) / (beacon - phone), 1.0
    return 1.0, 0.0
