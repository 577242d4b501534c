"""The log-distance path loss model (PM), fitted on a survey.

After Eq 1 of [1]_ and of [2]_, ``RSSI = A - 10 n log10(d / 1 m) + N(0, spread)`` by least squares
of the RSSI.

References
----------
.. [1] The aisle-graph particle filter in a wholesale store, 2016;
   digest "aisle-graph-particle-filter".
.. [2] Channel-separate regression, fingerprints and EKF, 2016; digest "channel-separate-ekf".
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from blesim.errors import DataError, UsageError
from blesim.ranging.curves import CurveRows, CurvesBy, Enough, fit_curves
from blesim.ranging.survey_readings import SurveyReadings

Number = float | NDArray[np.float64]
# Closer than this the far field of an antenna is not one, and a place is not known as well.
_NEAREST_M = 0.1
# Under this RSSI hardly falls with distance, and a range made of it has no meaning: the
# corridor of ITU-R P.1238 still has 1.6, and real receivers were found from 0.8 on.
LOWEST_EXPONENT = 0.3
_ENOUGH = Enough()


@dataclass(frozen=True, slots=True, kw_only=True)
class PathLossFit:
    """RSSI and distance of one curve, or of n curves at once, each field (n,).

    Attributes
    ----------
    level_dbm : float or ndarray of float64
        RSSI at one metre. [dBm]
    exponent : float or ndarray of float64
        Path loss exponent. [-]
    spread_db : float or ndarray of float64
        Standard deviation of the readings about the curve. [dB]
    """

    level_dbm: Number
    exponent: Number
    spread_db: Number

    def rssi_dbm(self, distance_m: ArrayLike) -> NDArray[np.float64]:
        """RSSI expected at distances of any shape, those under 0.1 m taken as that. [dBm]."""
        far_m = np.maximum(np.asarray(distance_m, np.float64), _NEAREST_M)
        return np.asarray(self.level_dbm - 10.0 * self.exponent * np.log10(far_m))

    def distance_m(self, rssi_dbm: ArrayLike) -> NDArray[np.float64]:
        """Distance at which an RSSI of any shape is expected: ``10^((A - RSSI)/(10 n))``. [m]."""
        loss_db = self.level_dbm - np.asarray(rssi_dbm, np.float64)
        return np.asarray(np.power(10.0, loss_db / (10.0 * self.exponent)))

    def distance_spread_m(self, distance_m: ArrayLike) -> NDArray[np.float64]:
        """Standard deviation of a range to first order: ``ln(10)/(10 n) d spread``. [m]."""
        share = np.log(10.0) / 10.0 * self.spread_db / self.exponent
        return np.asarray(share * np.asarray(distance_m, np.float64))


def log_distance_fit(
    distance_m: NDArray[np.float64], rssi_dbm: NDArray[np.float64]
) -> PathLossFit | None:
    """One curve through readings, by least squares of the RSSI.

    Parameters
    ----------
    distance_m, rssi_dbm : ndarray of float64, (n,)
        [m], [dBm]

    Returns
    -------
    PathLossFit or None
        None where there are fewer than three readings, their distances are all alike, or the
        exponent is under `LOWEST_EXPONENT`. The spread has n - 2 degrees of freedom.
    """
    decades = np.log10(np.maximum(distance_m, _NEAREST_M))
    if len(decades) < 3 or np.ptp(decades) < 1e-9:
        return None
    design = np.stack([np.ones_like(decades), -10.0 * decades], axis=1)
    (level_dbm, exponent), residuals_db = _least_squares(design, rssi_dbm)
    if exponent < LOWEST_EXPONENT:
        return None
    spread_db = np.sqrt(np.sum(residuals_db**2) / (len(decades) - 2))
    return PathLossFit(level_dbm=level_dbm, exponent=exponent, spread_db=float(spread_db))


def _least_squares(
    design: NDArray[np.float64], rssi_dbm: NDArray[np.float64]
) -> tuple[list[float], NDArray[np.float64]]:
    solution = np.linalg.lstsq(design, rssi_dbm, rcond=None)[0]
    return solution.tolist(), rssi_dbm - design @ solution


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathLossCurves:
    """Curves of all beacons, and of each channel of theirs if it was asked for.

    Attributes
    ----------
    curves : PathLossFit
        The k curves, of all readings together first; each field (k,).
    rows : CurveRows
        Which of them holds for which beacon and channel.
    """

    curves: PathLossFit
    rows: CurveRows

    def of(
        self, beacon: NDArray[np.integer[Any]], channel: NDArray[np.integer[Any]]
    ) -> PathLossFit:
        """Curve of each reading, by beacon and channel (0 where not told), each (n,)."""
        row = self.rows.of(beacon, channel)
        level_dbm, exponent, spread_db = (
            np.asarray(values)[row]
            for values in (self.curves.level_dbm, self.curves.exponent, self.curves.spread_db)
        )
        return PathLossFit(level_dbm=level_dbm, exponent=exponent, spread_db=spread_db)


def fit_path_loss(
    survey: SurveyReadings,
    distance_m: NDArray[np.float64],
    *,
    by: CurvesBy = "beacon",
    enough: Enough = _ENOUGH,
) -> PathLossCurves:
    """Path loss curves of a survey.

    Parameters
    ----------
    survey : SurveyReadings
        n readings.
    distance_m : ndarray of float64, (n,)
        In space from the phone to the beacon, as of `SurveyReadings.distance_m`; readings at NaN
        are left out. [m]
    by : {"beacon", "beacon and channel", "all"}
        One curve for each beacon, for each channel of each beacon too, or one for all.
    enough : Enough
        What a curve of its own takes; a beacon with less, or that does not get weaker with
        distance, takes the curve of all readings.

    Raises
    ------
    DataError
        If not even all readings together make a curve.
    """
    found, rows = fit_curves(survey, distance_m, log_distance_fit, by, enough)
    curves = PathLossFit(
        level_dbm=np.array([curve.level_dbm for curve in found]),
        exponent=np.array([curve.exponent for curve in found]),
        spread_db=np.array([curve.spread_db for curve in found]),
    )
    return PathLossCurves(curves=curves, rows=rows)


@dataclass(frozen=True, slots=True, kw_only=True)
class PathLossByBranch:
    """One level at a metre, and an exponent for each of two kinds of links.

    Attributes
    ----------
    same, other : PathLossFit
        Of links within one branch of the aisle graph, and of those between two.
    """

    same: PathLossFit
    other: PathLossFit

    def of(self, same_branch: NDArray[np.bool_]) -> PathLossFit:
        """Curve of each link, (n,)."""
        pairs = (
            (self.same.level_dbm, self.other.level_dbm),
            (self.same.exponent, self.other.exponent),
            (self.same.spread_db, self.other.spread_db),
        )
        level_dbm, exponent, spread_db = (np.where(same_branch, *pair) for pair in pairs)
        return PathLossFit(level_dbm=level_dbm, exponent=exponent, spread_db=spread_db)


# Digest "aisle-graph": s_0 and n of Eq 1; the spreads are the sigma_p of its table 1.
AISLE_GRAPH = PathLossByBranch(
    same=PathLossFit(level_dbm=-77.0, exponent=1.0, spread_db=4.0),
    other=PathLossFit(level_dbm=-77.0, exponent=1.3, spread_db=6.0),
)


def fit_path_loss_by_branch(
    distance_m: NDArray[np.float64],
    rssi_dbm: NDArray[np.float64],
    same_branch: NDArray[np.bool_],
) -> PathLossByBranch:
    """Curves of links within and between branches that share their level at one metre.

    Parameters
    ----------
    distance_m, rssi_dbm : ndarray of float64, (n,)
        Readings of all beacons; those at NaN are left out. [m], [dBm]
    same_branch : ndarray of bool, (n,)
        Whether phone and beacon are on one branch, as of `SurveyReadings.same_branch`.

    Raises
    ------
    UsageError
        If the lengths differ.
    DataError
        If there are fewer than three readings of a kind, their distances are all alike, or an
        exponent is under `LOWEST_EXPONENT`.
    """
    if not len(distance_m) == len(rssi_dbm) == len(same_branch):
        raise UsageError("distances, RSSI and branches differ in number; give one a reading")
    known = np.isfinite(distance_m)
    distance_m, rssi_dbm, same = distance_m[known], rssi_dbm[known], same_branch[known]
    decades = -10.0 * np.log10(np.maximum(distance_m, _NEAREST_M))
    design = np.stack([np.ones_like(decades), decades * same, decades * ~same], axis=1)
    fewest = min(np.count_nonzero(same), np.count_nonzero(~same))
    if fewest < 3 or np.linalg.matrix_rank(design) < 3:
        raise DataError(
            "the survey has too few readings on the beacon's branch, or off it, or all at one"
            " distance; survey more places"
        )
    (level_dbm, *exponents), residuals_db = _least_squares(design, rssi_dbm)
    if min(exponents) < LOWEST_EXPONENT:
        raise DataError("RSSI does not fall with distance in the survey; survey more places")
    kinds = [
        PathLossFit(level_dbm=level_dbm, exponent=exponent, spread_db=float(np.std(left_db)))
        for exponent, left_db in zip(
            exponents, (residuals_db[same], residuals_db[~same]), strict=True
        )
    ]
    return PathLossByBranch(same=kinds[0], other=kinds[1])
