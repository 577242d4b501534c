"""What is run with one thing otherwise in the rerun of the channel-separate paper [1]_.

The filters are compared with sparse beacons, where the published ordering fails; signals, distances
and places without a filter in the dense office, as in the paper.

References
----------
.. [1] Channel-separate regression, fingerprints and EKF, 2016; digest "channel-separate-ekf".
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from blesim.estimators.base import Estimator
from blesim.estimators.channel_ekf import ChannelEkf
from blesim.estimators.fingerprint_ekf import FingerprintEkf
from blesim.estimators.path_loss_ekf import PathLossEkf
from blesim.reruns import channel_ekf_numbers as paper
from blesim.reruns.base import Change, Key
from blesim.reruns.channel_ekf import ESTIMATORS, EXPERIMENT
from blesim.reruns.channel_ekf_numbers import FP, PM, PROPOSED
from blesim.reruns.channel_ekf_otherwise import (
    OtherwiseRanged,
    Ranged,
    by_fingerprints_alone,
    by_polynomials_alone,
    to_every_beacon,
)

_BOTH_OFFICES = (
    *(paper.reduction_key("dense", method) for method in (PM, FP)),
    *(paper.reduction_key("sparse", method) for method in (PM, FP)),
    *(paper.both_key("sparse", method) for method in (FP, PROPOSED)),
)
_FILTERS = (
    *(paper.both_key("sparse", method) for method in paper.METHODS),
    paper.reduction_key("sparse", FP),
)
_DISTANCES = (
    *(paper.spread_key(model) for model in ("PM", paper.poly(2))),
    *(paper.example_key(model) for model in ("PM", paper.poly(2))),
    *(paper.beacon_key(mode) for mode in (paper.CHANNEL_NAMES[0], paper.AGGREGATE)),
)
_PLACES = tuple(paper.place_key(mode) for mode in (*paper.CHANNEL_NAMES, paper.AGGREGATE))
_STILL = tuple(paper.still_key(name, paper.RSSI_SPREAD) for name in paper.CHANNEL_NAMES)

_RECEIVER = "phones.iphone-4s.receiver"
_QUIET = {
    "radio.people.body_loss_db": 0.0,
    "radio.shadowing.standard_deviation_db": 0.0,
    "radio.fading.model": "none",
}
# Of figure 1, less the mean of the three, and less those of the scenario's beacons.
_GAINS_DB = [1.0 - 0.7, 4.8 - 0.5, -5.8 + 1.2]


def _filters(
    name: str,
    why: str,
    values: Mapping[str, Any] | None = None,
    **otherwise: Estimator,
) -> Change:
    """With sparse beacons alone."""
    methods = {"pm": PM, "fp": FP, "proposed": PROPOSED}
    estimators = {methods[each]: estimator for each, estimator in otherwise.items()}
    experiment = replace(
        EXPERIMENT,
        values=values or {},
        estimators={**ESTIMATORS, **estimators},
        deployments=("sparse",),
    )
    return Change(name=name, why=why, experiment=experiment, shown=_FILTERS)


def _ranged(name: str, why: str, ranged: Ranged) -> Change:
    return _filters(name, why, proposed=OtherwiseRanged(ranged=ranged, cell_m=None))


def _signals(
    name: str,
    why: str,
    shown: tuple[Key, ...],
    values: Mapping[str, Any] | None = None,
    **otherwise: Any,
) -> Change:
    """With dense beacons, and without a filter."""
    experiment = replace(
        EXPERIMENT, values=values or {}, estimators={}, deployments=("dense",), **otherwise
    )
    return Change(name=name, why=why, experiment=experiment, shown=shown)


def _to_every_beacon(name: str, why: str, **otherwise: Any) -> Change:
    """In both offices."""
    proposed = OtherwiseRanged(ranged=to_every_beacon, cell_m=None, **otherwise)
    experiment = replace(EXPERIMENT, estimators={**ESTIMATORS, PROPOSED: proposed})
    return Change(name=name, why=why, experiment=experiment, shown=_BOTH_OFFICES)


CHANGES = (
    _to_every_beacon(
        "fingerprint distances to every beacon",
        "Eq 16 has them for each observed beacon; to one or two beacons they keep of a position"
        " only how far it is from these.",
    ),
    _to_every_beacon(
        "fingerprint distances to every beacon, no search ellipse",
        "Distances from one position are taken as independent, which makes the ellipse of Eq 10 to"
        " 12 small.",
        search_scale=None,
    ),
    _ranged(
        "fingerprint distances alone",
        "To tell what the polynomials do from what the distances lose.",
        by_fingerprints_alone,
    ),
    _ranged(
        "polynomial distances alone",
        "To tell what the polynomials do from what the distances lose.",
        by_polynomials_alone,
    ),
    _filters(
        "FP + EKF searches everywhere",
        "The paper calls its baseline classical, and has the search ellipse in its own system.",
        fp=FingerprintEkf(cell_m=None, search_scale=None),
    ),
    _filters(
        "velocity noise of 0.3 m/s",
        "The noises of the filters are not published; 0.5 m/s in a second is assumed in all.",
        pm=PathLossEkf(velocity_change_m_s=0.3),
        fp=FingerprintEkf(cell_m=None, velocity_change_m_s=0.3),
        proposed=ChannelEkf(cell_m=None, velocity_change_m_s=0.3),
    ),
    _filters(
        "beacons of -66 dBm at 1 m",
        "So that more are heard at a time than figure 11 has.",
        {f"{_RECEIVER}.offset_db": 7.0},
    ),
    _filters(
        "no body",
        "Fingerprints are means over four directions, and who walks looks one way; how much a body"
        " takes of the RSSI is measured elsewhere.",
        {"radio.people.body_loss_db": 0.0},
    ),
    _filters(
        "neither body, shadowing nor multipath",
        "To see whether ranges as good as radio allows bring the published ordering.",
        _QUIET,
    ),
    _signals(
        "points within 15 m of the beacon",
        "The paper measured at several points, which ones it does not say.",
        _DISTANCES,
        farthest_m=15.0,
    ),
    _signals(
        "a quiet dense office",
        "Without body, shadowing and multipath: what distance errors are left by walls.",
        _DISTANCES,
        _QUIET,
    ),
    _signals(
        "no multipath",
        "It is independent from channel to channel, so that all together average it.",
        _PLACES,
        {"radio.fading.model": "none"},
    ),
    _signals(
        "channel gains of figure 1",
        "There the channels of a beacon differ by 10.7 dB, in the scenario by 1.9 dB.",
        _PLACES,
        {f"{_RECEIVER}.channel_gain_db": _GAINS_DB},
    ),
    _signals(
        "tester holds the phone",
        "The paper says static, not whether on a stand or in a hand.",
        _STILL,
        phone_held=True,
    ),
)
