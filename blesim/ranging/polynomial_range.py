"""Polynomial regression of distance on RSSI (PRM), fitted on a survey.

After Eq 2 to 9 of [1]_: ``d = sum over i of c_i RSS^i``, i = 0 to the degree, c by least squares of
the distance. Powers of RSSI in dBm are nearly collinear, so the fit is made in the RSSI scaled to
-1 .. 1 over what the survey heard: the same polynomial, better conditioned.

References
----------
.. [1] Channel-separate regression, fingerprints and EKF, 2016; digest "channel-separate-ekf".
"""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from blesim.errors import UsageError
from blesim.ranging.curves import CurveRows, CurvesBy, Enough, fit_curves
from blesim.ranging.survey_readings import SurveyReadings

_ENOUGH = Enough()
HIGHEST_DEGREE = 9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PolynomialRange:
    """Distance as a polynomial of RSSI: one curve, or n curves at once.

    Attributes
    ----------
    scaled : ndarray of float64, (degree + 1,) or (n, degree + 1)
        Coefficients in the scaled RSSI, lowest power first. [m]
    lowest_dbm, highest_dbm : ndarray of float64, () or (n,)
        RSSI heard in the survey, scaled to -1 and 1. Beyond them the curve is not known: weaker
        and stronger readings are taken as these. [dBm]
    spread_m : ndarray of float64, () or (n,)
        Standard deviation of the surveyed distances about the curve. [m]
    """

    scaled: NDArray[np.float64]
    lowest_dbm: NDArray[np.float64]
    highest_dbm: NDArray[np.float64]
    spread_m: NDArray[np.float64]

    def distance_m(self, rssi_dbm: ArrayLike) -> NDArray[np.float64]:
        """Distance of RSSI readings, never negative: any shape for one curve, (n,) for n. [m]."""
        heard_dbm = np.clip(np.asarray(rssi_dbm, np.float64), self.lowest_dbm, self.highest_dbm)
        scaled = _scaled(heard_dbm, self.lowest_dbm, self.highest_dbm)
        distance_m = np.zeros_like(scaled)
        for power in range(self.scaled.shape[-1] - 1, -1, -1):
            distance_m = distance_m * scaled + self.scaled[..., power]
        return np.maximum(distance_m, 0.0)

    def coefficients(self) -> NDArray[np.float64]:
        """Coefficients c_i of Eq 2, of one curve, lowest power first. [m/dBm^i]."""
        half_db = (self.highest_dbm - self.lowest_dbm) / 2.0
        middle_dbm = (self.highest_dbm + self.lowest_dbm) / 2.0
        scale = np.polynomial.Polynomial([-middle_dbm / half_db, 1.0 / half_db])
        powers = np.polynomial.Polynomial(self.scaled)(scale)
        return np.asarray(powers.coef, np.float64)


def _scaled(
    rssi_dbm: NDArray[np.float64], lowest_dbm: ArrayLike, highest_dbm: ArrayLike
) -> NDArray[np.float64]:
    low_dbm, high_dbm = np.asarray(lowest_dbm), np.asarray(highest_dbm)
    return np.asarray((2.0 * rssi_dbm - low_dbm - high_dbm) / (high_dbm - low_dbm))


def polynomial_fit(
    distance_m: NDArray[np.float64], rssi_dbm: NDArray[np.float64], *, degree: int = 2
) -> PolynomialRange | None:
    """One polynomial through readings, by least squares of the distance.

    Parameters
    ----------
    distance_m, rssi_dbm : ndarray of float64, (n,)
        [m], [dBm]
    degree : int
        0 to `HIGHEST_DEGREE`; the paper tries 1 to 5 and takes 2.

    Returns
    -------
    PolynomialRange or None
        None unless there are more different RSSI values than the degree, two at least, and more
        readings than coefficients. The spread has n - degree - 1 degrees of freedom.

    Raises
    ------
    UsageError
        If the degree is out of its range.
    """
    refuse_bad_degree(degree)
    values = len(np.unique(rssi_dbm))
    if values < max(degree + 1, 2) or len(rssi_dbm) <= degree + 1:
        return None
    lowest_dbm, highest_dbm = rssi_dbm.min(), rssi_dbm.max()
    design = np.vander(_scaled(rssi_dbm, lowest_dbm, highest_dbm), degree + 1, increasing=True)
    coefficients = np.linalg.lstsq(design, distance_m, rcond=None)[0]
    left_m = distance_m - design @ coefficients
    return PolynomialRange(
        scaled=coefficients.astype(np.float64),
        lowest_dbm=lowest_dbm,
        highest_dbm=highest_dbm,
        spread_m=np.sqrt(np.sum(left_m**2) / (len(left_m) - degree - 1)),
    )


def refuse_bad_degree(degree: int) -> None:
    """Raise `UsageError` if a degree is out of its range."""
    if not 0 <= degree <= HIGHEST_DEGREE:
        raise UsageError(f"degree {degree}: give a whole number from 0 to {HIGHEST_DEGREE}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PolynomialRanges:
    """Polynomials of all beacons, and of each channel of theirs if it was asked for.

    Attributes
    ----------
    curves : PolynomialRange
        The k polynomials, that of all readings together first.
    rows : CurveRows
        Which of them holds for which beacon and channel.
    """

    curves: PolynomialRange
    rows: CurveRows

    def of(
        self, beacon: NDArray[np.integer[Any]], channel: NDArray[np.integer[Any]]
    ) -> PolynomialRange:
        """Polynomial of each reading, by beacon and channel (0 where not told), each (n,)."""
        row = self.rows.of(beacon, channel)
        return PolynomialRange(
            scaled=self.curves.scaled[row],
            lowest_dbm=self.curves.lowest_dbm[row],
            highest_dbm=self.curves.highest_dbm[row],
            spread_m=self.curves.spread_m[row],
        )


def fit_polynomial_ranges(
    survey: SurveyReadings,
    distance_m: NDArray[np.float64],
    *,
    degree: int = 2,
    by: CurvesBy = "beacon and channel",
    enough: Enough = _ENOUGH,
) -> PolynomialRanges:
    """Polynomials of a survey.

    Parameters
    ----------
    survey : SurveyReadings
        n readings.
    distance_m : ndarray of float64, (n,)
        In space from the phone to the beacon; readings at NaN are left out. [m]
    degree : int
        0 to `HIGHEST_DEGREE`.
    by : {"beacon and channel", "beacon", "all"}
        The paper's separate mode, its aggregate mode, or one polynomial for all.
    enough : Enough
        What a polynomial of its own takes; a channel with less takes that of its beacon, a beacon
        with less that of all readings.

    Raises
    ------
    UsageError
        If the degree is out of its range.
    DataError
        If not even all readings together make a polynomial.
    """
    refuse_bad_degree(degree)
    fit = partial(polynomial_fit, degree=degree)
    found, rows = fit_curves(survey, distance_m, fit, by, enough)
    curves = PolynomialRange(
        scaled=np.array([curve.scaled for curve in found]),
        lowest_dbm=np.array([curve.lowest_dbm for curve in found]),
        highest_dbm=np.array([curve.highest_dbm for curve in found]),
        spread_m=np.array([curve.spread_m for curve in found]),
    )
    return PolynomialRanges(curves=curves, rows=rows)
