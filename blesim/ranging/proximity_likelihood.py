"""How likely a proximity class is at a distance: published, or learned from a survey.

The proximity paper [1]_ counts the share of places that report Near at each distance on the map and
draws a line through the shares: Eq 5, ``P(d) = 1.1077 - 0.3053 d``, from 0 to 2.4 m.

References
----------
.. [1] Particle filter on beacon proximity and a floor map, about 2017;
   digest "proximity-particle-filter".
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from blesim.errors import DataError, UsageError


@dataclass(frozen=True, slots=True, kw_only=True)
class DistanceShares:
    """Share of readings of a class in bins of distance, all arrays (k,).

    Attributes
    ----------
    distance_m : ndarray of float64
        Mean distance of the readings of a bin. [m]
    share : ndarray of float64
        How many of them are of the class. [-]
    count : ndarray of int64
        How many there are.
    """

    distance_m: NDArray[np.float64]
    share: NDArray[np.float64]
    count: NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class ProximityLikelihood:
    """Probability of a class that falls linearly with the distance on the map.

    Attributes
    ----------
    intercept : float
        At distance 0. [-]
    slope_per_m : float
        Negative. [1/m]
    clipped : bool
        Keep to 0 .. 1. The printed line leaves it below 0.35 m and beyond 3.63 m, and the paper
        does not say what it does there; unclipped, far particles lose likelihood.
    shares : DistanceShares or None
        What it was learned from.
    """

    intercept: float
    slope_per_m: float
    clipped: bool = True
    shares: DistanceShares | None = field(default=None, compare=False, repr=False)

    def share(self, distance_m: ArrayLike) -> NDArray[np.float64]:
        """Probability of the class at distances of any shape. [-]."""
        line = self.intercept + self.slope_per_m * np.asarray(distance_m, np.float64)
        return np.clip(line, 0.0, 1.0) if self.clipped else line


# Digest "proximity-pf", Eq 5: a tablet at the chest, 1.0 m above a beacon on the floor.
PUBLISHED_NEAR = ProximityLikelihood(intercept=1.1077, slope_per_m=-0.3053)


def distance_shares(
    distance_m: NDArray[np.float64],
    of_class: NDArray[np.bool_],
    *,
    bin_m: float = 0.3,
    fewest: int = 5,
) -> DistanceShares:
    """Shares of a class in bins of distance.

    Parameters
    ----------
    distance_m : ndarray of float64, (n,)
        On the map, from the phone to the beacon; readings at NaN are left out. [m]
    of_class : ndarray of bool, (n,)
        Whether each reading is of the class, as of
        ``surveyed_classes(...) == Proximity.NEAR``.
    bin_m : float
        Width of a bin; the paper's cells are 0.3 m. [m]
    fewest : int
        Bins with fewer readings are left out.

    Raises
    ------
    UsageError
        If a value is out of its range.
    """
    if not bin_m > 0 or fewest < 1:
        raise UsageError(f"bin_m {bin_m:g}, fewest {fewest}: give a positive width, 1 or more")
    known = np.isfinite(distance_m)
    near_m, hits = distance_m[known], of_class[known].astype(np.float64)
    number = np.floor(near_m / bin_m).astype(np.int64)
    count = np.bincount(number)
    used = count >= fewest
    return DistanceShares(
        distance_m=np.bincount(number, near_m)[used] / count[used],
        share=np.bincount(number, hits)[used] / count[used],
        count=count[used],
    )


def fit_proximity_likelihood(
    shares: DistanceShares, *, by_count: bool = True, clipped: bool = True
) -> ProximityLikelihood:
    """Line through the shares of a class, by least squares.

    Parameters
    ----------
    shares : DistanceShares
        Ascending; those beyond the first without a reading of the class are left out, as there the
        line would be bent by distances that have nothing to tell.
    by_count : bool
        Weigh bins by their readings, or all alike as the paper does.
    clipped : bool
        Whether the line keeps to 0 .. 1.

    Raises
    ------
    DataError
        If there are fewer than two bins, or the class does not get rarer with distance.
    """
    none = np.flatnonzero(shares.share == 0)
    used = slice(0, int(none[0]) + 1 if len(none) else None)
    distance_m, share = shares.distance_m[used], shares.share[used]
    weight = np.sqrt(shares.count[used]) if by_count else np.ones(len(share))
    if len(distance_m) < 2:
        raise DataError(
            "the survey has the class at fewer than two distances; survey more places near beacons"
        )
    design = np.stack([np.ones_like(distance_m), distance_m], axis=1) * weight[:, None]
    intercept, slope_per_m = np.linalg.lstsq(design, share * weight, rcond=None)[0].tolist()
    if slope_per_m >= 0:
        raise DataError(
            "the class does not get rarer with distance in the survey; survey more places near"
            " beacons, or look at the powers they announce"
        )
    return ProximityLikelihood(
        intercept=intercept, slope_per_m=slope_per_m, clipped=clipped, shares=shares
    )
