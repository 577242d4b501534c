"""The hall's parameters from set 1 of its fixed points."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from blesim.fidelity.correlation import correlation_between_places
from blesim.fidelity.levels import level_deviation_db
from blesim.fidelity.links import Link
from blesim.fidelity.path_fit import PathFit, fit_path
from blesim.rng import Draws

Numbers = NDArray[np.float64]

# How many places the spread of three Rician levels is computed over.
_PLACES = 20_000
_RICE_FACTORS_DB = (-20.0, 20.0)
_APART_M = (1.2, 1.9, 2.6, 3.5, 5.0)
_DECORRELATIONS_M = np.round(np.arange(0.2, 10.0, 0.05), 2)


class HallFit(NamedTuple):
    """What the fixed points of a hall say about its parameters.

    Attributes
    ----------
    path_loss_exponent : float
        Common to all receivers, each with a level of its own. [-]
    rice_factor_db : float
        That gives links the spread between channels that they have. [dB]
    shadowing_db : float
        What neither distance nor the mean of three channels explains. [dB]
    decorrelation_m : float
        Of the shadowing. [m]
    """

    path_loss_exponent: float
    rice_factor_db: float
    shadowing_db: float
    decorrelation_m: float


def fit_hall(points: Sequence[Link], channel_correlation: float) -> HallFit:
    """Path loss, multipath and shadowing from links that stand still.

    Parameters
    ----------
    points : sequence of Link
        Links of all points, in three levels each.
    channel_correlation : float
        Of the multipath between channels, which links that stand still do not tell. [-]

    Returns
    -------
    HallFit
    """
    fit = fit_with_offsets(points)
    deviation_db = float(np.median([level_deviation_db(link.rssi_dbm) for link in points]))
    rice_db = rice_factor_db(deviation_db, channel_correlation)
    multipath_db = channel_levels_db(rice_db, channel_correlation).mean(axis=1).std()
    shadowing_db = float(np.sqrt(max(fit.deviation_db**2 - multipath_db**2, 0.0)))
    share = (shadowing_db / fit.deviation_db) ** 2
    return HallFit(
        path_loss_exponent=fit.exponent,
        rice_factor_db=rice_db,
        shadowing_db=shadowing_db,
        decorrelation_m=_decorrelation_m(points, fit.residuals_db, share),
    )


def fit_with_offsets(points: Sequence[Link]) -> PathFit:
    """One exponent for all receivers, a level for each: a fit to what differs from its mean."""
    beacon = np.array([link.beacon for link in points])
    distance_db = np.array([np.log10(link.distance_m.mean()) for link in points])
    level_dbm = np.array([link.level_dbm for link in points])
    for row in np.unique(beacon).tolist():
        mine = beacon == row
        distance_db[mine] -= distance_db[mine].mean()
        level_dbm[mine] -= level_dbm[mine].mean()
    return fit_path(10.0**distance_db, level_dbm)


def _decorrelation_m(points: Sequence[Link], residuals_db: Numbers, share: float) -> float:
    """Least squares of ``share exp(-d / D)`` over the correlation at several distances. [m]."""
    beacon = np.array([link.beacon for link in points])
    places_m = np.array([link.place_m[0] for link in points])
    means = np.array(
        [
            np.nanmean(
                [
                    correlation_between_places(
                        places_m[beacon == row], residuals_db[beacon == row], *limits
                    )
                    for row in np.unique(beacon).tolist()
                ]
            )
            for limits in pairwise(_APART_M)
        ]
    )
    middle_m = np.array([(low + high) / 2.0 for low, high in pairwise(_APART_M)])
    errors = [np.sum((share * np.exp(-middle_m / d) - means) ** 2) for d in _DECORRELATIONS_M]
    return float(_DECORRELATIONS_M[int(np.argmin(errors))])


def rice_factor_db(deviation_db: float, channel_correlation: float) -> float:
    """Rice factor whose three levels have a median standard deviation. [dB].

    Parameters
    ----------
    deviation_db : float
        Median over places of the deviation of the three levels. [dB]
    channel_correlation : float
        [-]
    """

    def excess_db(rice_db: float) -> float:
        levels_db = channel_levels_db(rice_db, channel_correlation)
        return float(np.median(levels_db.std(axis=1))) - deviation_db

    low, high = _RICE_FACTORS_DB
    if excess_db(low) <= 0:
        return low
    return float(brentq(excess_db, low, high, xtol=0.01))


def channel_levels_db(rice_db: float, channel_correlation: float) -> Numbers:
    """Levels of three channels at many places, (n, 3): Rician, correlated in scattered power. [dB].

    ``20 log10 |sqrt(K/(K+1)) + sqrt(1/(K+1)) (sqrt(r) g_0 + sqrt(1-r) g_c)|``, r the root of the
    power correlation, g circular complex normal deviates.
    """
    draws = Draws(seed=0, purpose="levels of a fit")
    numbers = np.concatenate(
        [draws.normals(np.arange(_PLACES) + part * _PLACES) for part in range(2)], axis=1
    )
    scattered = (numbers[:, :4] + 1j * numbers[:, 4:]) / np.sqrt(2.0)
    rice, shared = 10.0 ** (rice_db / 10.0), np.sqrt(channel_correlation)
    mixed = np.sqrt(shared) * scattered[:, :1] + np.sqrt(1.0 - shared) * scattered[:, 1:]
    levels_db: Numbers = 20.0 * np.log10(np.abs(np.sqrt(rice) + mixed) / np.sqrt(rice + 1.0))
    return levels_db
