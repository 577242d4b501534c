"""Gaps of a radio map filled by Gaussian-process regression, beacon by beacon.

As the channel-separate paper does between its surveyed points [1]_. The process has a squared
exponential or a Matern 3/2 kernel plus white noise; RSSI is normalised to mean 0 and variance 1,
the kernel's parameters are those of the highest marginal likelihood [2]_.

References
----------
.. [1] Channel-separate regression, fingerprints and EKF, 2016; digest "channel-separate-ekf".
.. [2] C. E. Rasmussen, C. K. I. Williams, "Gaussian Processes for Machine Learning", MIT Press,
   2006, chapters 2 and 5.
"""

import warnings
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from blesim.errors import UsageError
from blesim.ranging.radio_map import RadioMap, joined_radio_maps

KernelName = Literal["squared exponential", "matern"]
Silence = Literal["weak", "left out"]
_SHORTEST_M, _LONGEST_M = 0.5, 100.0
_FEWEST_PLACES = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class GaussianProcessFill:
    """How gaps are filled.

    Attributes
    ----------
    kernel : {"squared exponential", "matern"}
        Smooth, or once differentiable.
    length_m : float
        Where the search for the length scale begins; it goes from 0.5 to 100 m. [m]
    silence : {"weak", "left out"}
        A place where a beacon was not heard counts as the map's value for what is missing, or is
        left out: then the process returns to the beacon's mean far from where it was heard.
    most_learned : int
        Places the kernel's parameters are learned from: the cost grows with their third power, for
        each of some twenty evaluations; 200 take about 0.2 s a beacon.
    most_places : int
        Places the map is filled from; also to the third power, once. Of more, as many are taken
        evenly from the rows of the map, three in four of them where the beacon was heard if there
        are so many.

    Raises
    ------
    UsageError
        If a value is out of its range.
    """

    kernel: KernelName = "squared exponential"
    length_m: float = 3.0
    silence: Silence = "weak"
    most_learned: int = 200
    most_places: int = 1000

    def __post_init__(self) -> None:
        if self.kernel not in get_args(KernelName):
            raise UsageError(
                f"kernel '{self.kernel}': use one of {', '.join(get_args(KernelName))}"
            )
        if self.silence not in get_args(Silence):
            raise UsageError(f"silence '{self.silence}': use one of {', '.join(get_args(Silence))}")
        if not _SHORTEST_M <= self.length_m <= _LONGEST_M:
            raise UsageError(f"length_m {self.length_m:g}: give {_SHORTEST_M} to {_LONGEST_M:g}")
        if not _FEWEST_PLACES <= self.most_learned <= self.most_places:
            raise UsageError(
                f"most_learned {self.most_learned}, most_places {self.most_places}: give"
                f" {_FEWEST_PLACES} or more, in this order"
            )


def filled_radio_map(
    surveyed: RadioMap, xy_m: NDArray[np.float64], level: int, fill: GaussianProcessFill
) -> RadioMap:
    """Fingerprints at the given points, for every direction of the map.

    Parameters
    ----------
    surveyed : RadioMap
        Of one channel or all together.
    xy_m : ndarray of float64, (p, 2)
        Where fingerprints are wanted, such as the crossings of a grid; surveyed places may be among
        them and are estimated as well. [m]
    level : int
        Level of all of them; only places surveyed there are learned from.
    fill : GaussianProcessFill
        How.

    Returns
    -------
    RadioMap
        ``mean_dbm`` is NaN for a beacon heard at fewer than three places of the level, and not
        under the map's value for what is missing. ``spread_db`` is that of a new fingerprint about
        the mean, white noise included; ``count`` is 0.

    Raises
    ------
    UsageError
        If the map has nothing on the level.
    """
    from threadpoolctl import threadpool_limits

    here = surveyed.rows(surveyed.level == level)
    # One thread is faster for matrices as small, and gives the same bytes on any number of cores.
    with threadpool_limits(limits=1, user_api="blas"):
        parts = [
            _filled(here.rows(here.direction == direction), xy_m, level, int(direction), fill)
            for direction in np.unique(here.direction)
        ]
    if not parts:
        raise UsageError(f"the radio map has nothing on level {level}; survey it, or fill another")
    return joined_radio_maps(parts)


def _filled(
    surveyed: RadioMap,
    xy_m: NDArray[np.float64],
    level: int,
    direction: int,
    fill: GaussianProcessFill,
) -> RadioMap:
    """Fingerprints at points, from those of one level and direction."""
    beacons = surveyed.mean_dbm.shape[1]
    mean_dbm, spread_db = np.full((2, len(xy_m), beacons), np.nan)
    places_m = np.stack([surveyed.x_m, surveyed.y_m], axis=1)
    lowest_dbm = surveyed.layout.missing_dbm
    for beacon in range(beacons):
        heard = ~np.isnan(surveyed.mean_dbm[:, beacon])
        if np.count_nonzero(heard) < _FEWEST_PLACES:
            continue
        used = heard if fill.silence == "left out" else np.ones_like(heard)
        process = _learned(
            places_m[used], surveyed.fingerprints_dbm[used, beacon], heard[used], fill
        )
        mean, spread_db[:, beacon] = process.predict(xy_m, return_std=True)
        mean_dbm[:, beacon] = np.maximum(mean, lowest_dbm)
    return RadioMap(
        layout=surveyed.layout,
        x_m=xy_m[:, 0].copy(),
        y_m=xy_m[:, 1].copy(),
        level=np.full(len(xy_m), level, np.int64),
        direction=np.full(len(xy_m), direction, np.int64),
        mean_dbm=mean_dbm,
        spread_db=spread_db,
        count=np.zeros((len(xy_m), beacons), np.int64),
    )


def _learned(
    places_m: NDArray[np.float64],
    rssi_dbm: NDArray[np.float64],
    heard: NDArray[np.bool_],
    fill: GaussianProcessFill,
) -> Any:
    """Process with its parameters learned, that knows the places."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor

    few, many = (_chosen(heard, most) for most in (fill.most_learned, fill.most_places))
    # No restarts from random places: the same survey gives the same map.
    process = GaussianProcessRegressor(_kernel(fill), normalize_y=True)
    with warnings.catch_warnings():
        # A parameter at the end of its range, such as no noise at all, is an answer as well.
        warnings.simplefilter("ignore", ConvergenceWarning)
        process.fit(places_m[few], rssi_dbm[few])
    if len(many) == len(few):
        return process
    known = GaussianProcessRegressor(process.kernel_, normalize_y=True, optimizer=None)
    return known.fit(places_m[many], rssi_dbm[many])


def _kernel(fill: GaussianProcessFill) -> Any:
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Matern, WhiteKernel

    limits_m = (_SHORTEST_M, _LONGEST_M)
    smooth = (
        RBF(fill.length_m, limits_m)
        if fill.kernel == "squared exponential"
        else Matern(fill.length_m, limits_m, nu=1.5)
    )
    return ConstantKernel(1.0, (1e-2, 1e2)) * smooth + WhiteKernel(0.1, (1e-6, 1.0))


def _chosen(heard: NDArray[np.bool_], most: int) -> NDArray[np.int64]:
    """At most so many of the rows, the heard ones first."""
    loud, silent = np.flatnonzero(heard), np.flatnonzero(~heard)
    loud = _spread_out(loud, max(most * 3 // 4, most - len(silent)))
    return np.sort(np.append(loud, _spread_out(silent, most - len(loud))))


def _spread_out(rows: NDArray[np.int64], most: int) -> NDArray[np.int64]:
    """At most so many of the rows, evenly spread."""
    if len(rows) <= most:
        return rows
    return rows[np.linspace(0, len(rows) - 1, most).round().astype(np.int64)]
