"""Compass errors that depend on the direction: five coefficients, as the map-heading EKF has."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from blesim.settings import Settings
from blesim.tables import FloatArray
from blesim.units import azimuth_to_heading, heading_to_azimuth, wrap_angle

# Beyond this slope of the deviation two directions might read the same.
_STEEPEST = 0.9
# Each round divides what is left of the error by the slope, and more.
_ROUNDS = 60


class CompassErrors(Settings):
    """What must be added to a measured azimuth xi to have the true one.

    ``delta = A + B sin xi + C cos xi + D sin 2 xi + E cos 2 xi + w``: a constant and hard iron
    (once a turn) and soft iron (twice a turn), Eq 10 of the map-heading paper.

    Attributes
    ----------
    a_deg, b_deg, c_deg, d_deg, e_deg : float
        The coefficients. [degree]
    noise_deg : float
        Spread of w. [degree]
    """

    a_deg: float = Field(default=0.0, ge=-180, le=180)
    b_deg: float = Field(default=0.0, ge=-60, le=60)
    c_deg: float = Field(default=0.0, ge=-60, le=60)
    d_deg: float = Field(default=0.0, ge=-30, le=30)
    e_deg: float = Field(default=0.0, ge=-30, le=30)
    noise_deg: float = Field(default=0.0, ge=0, le=90)

    @model_validator(mode="after")
    def _one_reading_a_direction(self) -> "CompassErrors":
        once, twice = abs(self.b_deg) + abs(self.c_deg), abs(self.d_deg) + abs(self.e_deg)
        if np.radians(once + 2.0 * twice) > _STEEPEST:
            raise ValueError(
                "b_deg, c_deg, d_deg, e_deg are so large that two directions may read the same;"
                f" keep |b| + |c| + 2 |d| + 2 |e| below {np.degrees(_STEEPEST):.0f} degrees"
            )
        return self

    def deviation_rad(self, measured_azimuth_rad: NDArray[np.float64]) -> NDArray[np.float64]:
        """Deviation at measured azimuths, without noise, any shape. [rad]."""
        xi = np.asarray(measured_azimuth_rad, dtype=np.float64)
        degrees = (
            self.a_deg
            + self.b_deg * np.sin(xi)
            + self.c_deg * np.cos(xi)
            + self.d_deg * np.sin(2.0 * xi)
            + self.e_deg * np.cos(2.0 * xi)
        )
        return np.radians(degrees)

    def measured_heading_rad(
        self, heading_rad: FloatArray, deviates: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Headings that the compass tells.

        Parameters
        ----------
        heading_rad : ndarray of float64, (n,)
            True headings. [rad]
        deviates : ndarray of float64, (n,)
            Standard normal numbers, for the noise. [-]

        Returns
        -------
        ndarray of float64, (n,)
            In [-pi, pi): of the azimuths that, with their deviation, give the true ones. [rad]
        """
        true = heading_to_azimuth(heading_rad)
        measured = true
        for _ in range(_ROUNDS):
            measured = true - self.deviation_rad(measured)
        return azimuth_to_heading(wrap_angle(measured - np.radians(self.noise_deg) * deviates))


# Table 3 of the map-heading paper tells the mean magnitude of the raw azimuth's error in four
# corridors: 17.92, 5.84, 16.17 and 10.99 degrees at 90, 180, 270 and 305. Four numbers without
# signs leave five coefficients open: of all signs and coefficients that meet them, these have the
# smallest sum of squares (all four errors of one sign). The noise, 4 degrees, is assumed from the
# largest errors, 7 to 11 degrees beyond the mean; the mean magnitudes include it.
COMPASSES: Mapping[str, CompassErrors] = MappingProxyType(
    {
        "map-heading": CompassErrors(
            a_deg=-9.77, b_deg=-0.10, c_deg=2.73, d_deg=3.47, e_deg=6.39, noise_deg=4.0
        )
    }
)
