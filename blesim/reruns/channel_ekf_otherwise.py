"""The channel-separate filter [1]_ with other ranges, for what-if questions.

References
----------
.. [1] Channel-separate regression, fingerprints and EKF, 2016; digest "channel-separate-ekf".
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from blesim.errors import InvariantError
from blesim.estimators.base import fitted
from blesim.estimators.channel_ekf import ChannelEkf, ChannelRanges
from blesim.recording import Recording
from blesim.venue.venue import Venue

Array = NDArray[np.float64]
Ranged = Callable[[ChannelRanges], ChannelRanges]


@dataclass(frozen=True, slots=True, kw_only=True)
class OtherwiseRanged(ChannelEkf):
    """The proposed system with other ranges.

    Attributes
    ----------
    ranged : callable
        Makes them of those that were learned.
    """

    ranged: Ranged

    def fit(self, venue: Venue, surveys: Sequence[Recording]) -> Self:
        """Copy that has the polynomials and radio maps of the survey."""
        learned = ChannelEkf.fit(self, venue, surveys)
        if learned.ranges is None:
            raise InvariantError("channel-ekf was fitted, and has no ranges")
        return fitted(learned, ranges=self.ranged(learned.ranges))


def to_every_beacon(learned: ChannelRanges) -> ChannelRanges:
    """Fingerprint positions give a distance to every beacon: Eq 16 without its "observed"."""
    return _ToEveryBeacon(**_told(learned))


def by_polynomials_alone(learned: ChannelRanges) -> ChannelRanges:
    """Without distances by fingerprints, which still tell where to begin."""
    return _NoPlaces(**_told(learned))


def by_fingerprints_alone(learned: ChannelRanges) -> ChannelRanges:
    """Without distances by polynomials."""
    unknown = [replace(each, scaled=np.full_like(each.scaled, np.nan)) for each in learned.curves]
    return replace(learned, curves=tuple(unknown))


class _ToEveryBeacon(ChannelRanges):
    def _from_place(self, place_m: Array, heard: NDArray[np.bool_]) -> Array:
        return super()._from_place(place_m, np.ones_like(heard))


class _NoPlaces(ChannelRanges):
    def _from_place(self, place_m: Array, heard: NDArray[np.bool_]) -> Array:  # noqa: ARG002 (of none)
        return np.full(len(heard), np.nan)


def _told(learned: ChannelRanges) -> dict[str, Any]:
    return {each.name: getattr(learned, each.name) for each in fields(learned)}
