"""The proximity experiment with one thing otherwise: what explains its figures, and what does not.

What the paper [1]_ leaves open stands in the scenario ``h-floor`` as assumed.

References
----------
.. [1] Particle filter on beacon proximity and a floor map; digest "proximity-particle-filter".
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from blesim.reruns.base import Change
from blesim.reruns.proximity_pf import PROXIMITY, TRILATERATION, ProximityExperiment
from blesim.reruns.proximity_pf_numbers import (
    IMMEDIATE,
    INTERCEPT,
    LEAST,
    MEAN,
    MOST,
    OURS,
    SLOPE,
    A,
    B,
    C,
    less_key,
    penalty_key,
    point_key,
    share_key,
    summary_key,
)

_CELLS = (INTERCEPT, SLOPE, share_key(0.3), share_key(2.4), IMMEDIATE)
_OURS = (
    summary_key(OURS, MEAN),
    summary_key(OURS, MOST),
    summary_key(C, MOST),
    summary_key(C, LEAST),
    point_key(OURS, 1),
    penalty_key(-10.0),
)
_BESIDE = (
    less_key(A),
    less_key(B),
    less_key(C),
    point_key(OURS, 2),
    point_key(C, 2),
    point_key(A, 2),
)
_OTHERS = (
    summary_key(A, MEAN),
    summary_key(A, LEAST),
    summary_key(A, MOST),
    summary_key(B, MOST),
    point_key(A, 2),
    summary_key(B, LEAST),
)
_NO_ANOMALIES = {"magnetics.anomaly_ut": 0.0, "magnetics.clutter_ut": 0.0}
_BY_EVENTS: dict[str, Any] = {
    "proximity": replace(PROXIMITY, source="system"),
    "trilateration": replace(TRILATERATION, source="system"),
}


def _changes() -> tuple[Change, ...]:
    return (*_of_cells(), *_of_ours(), *_of_all_four(), *_of_trilateration())


def _of_cells() -> Iterator[Change]:
    def change(name: str, why: str, **values: Any) -> Change:
        return Change(
            name=name, why=why, experiment=ProximityExperiment(values=values), shown=_CELLS
        )

    yield change(
        "no multipath",
        "Interference varies within a few centimetres, so that cells may be weak beside the beacon;"
        " how much of it there was is not told.",
        **{"radio.fading.model": "none"},
    )
    yield change(
        "no shadowing",
        "One field of shadows lies over all cells, and the paper has one such field.",
        **{"radio.shadowing.standard_deviation_db": 0.0},
    )
    yield change(
        "no body shadow",
        "The paper does not tell which way the tester looked, so that it is not known which cells"
        " the body shadowed.",
        **{"radio.people.body_loss_db": 0.0},
    )


def _of_ours() -> Iterator[Change]:
    def change(name: str, why: str, experiment: ProximityExperiment) -> Change:
        return Change(name=name, why=why, experiment=experiment, shown=_OURS)

    yield change(
        "true headings",
        "How good the compass was is not published; here it is perfect, on the same steps.",
        ProximityExperiment(true_headings=True, **_BY_EVENTS),
    )
    yield change(
        "true headings and Near by Eq 5",
        "What the algorithm does on this course if all that it believes is true.",
        ProximityExperiment(true_headings=True, near_by_chance=True, **_BY_EVENTS),
    )
    yield change(
        "Near by Eq 5",
        "Near is told as the algorithm believes, each time by itself, and the compass remains.",
        ProximityExperiment(near_by_chance=True),
    )
    yield change(
        "10 cm and 15 degrees as standard deviations",
        "The paper writes +- and leaves open whether that is a width or a deviation.",
        ProximityExperiment(
            proximity=replace(PROXIMITY, spread="gaussian"),
            trilateration=replace(TRILATERATION, spread="gaussian"),
        ),
    )
    yield change(
        "penalty -100",
        "If -10 takes the likelihood of too many particles, this must be worse still.",
        ProximityExperiment(proximity=replace(PROXIMITY, penalty=-100.0)),
    )
    yield change(
        "a phone that loses 74 % of the packets",
        "How many packets a Nexus 9 loses is not known.",
        ProximityExperiment(values={"phones.nexus-9.receiver.random_loss": 0.74}),
    )


def _of_all_four() -> Iterator[Change]:
    def change(name: str, why: str, experiment: ProximityExperiment) -> Change:
        return Change(name=name, why=why, experiment=experiment, shown=_BESIDE)

    yield change(
        "all four with true headings",
        "What the four owe to the compass.",
        ProximityExperiment(true_headings=True, **_BY_EVENTS),
    )
    yield change(
        "no magnetic anomalies",
        "How much steel there is in the building is not published.",
        ProximityExperiment(values=_NO_ANOMALIES),
    )
    yield change(
        "no survey",
        "The paper does not say whether the compass was aligned with the map, nor whence A and B"
        " have their path loss; here the survey tells neither.",
        ProximityExperiment(surveyed=False),
    )


def _of_trilateration() -> Iterator[Change]:
    def change(name: str, why: str, experiment: ProximityExperiment) -> Change:
        return Change(name=name, why=why, experiment=experiment, shown=_OTHERS)

    yield change(
        "three strongest beacons",
        "The paper does not say from how many beacons it laterates; here up to eight.",
        ProximityExperiment(trilateration=replace(TRILATERATION, most=3)),
    )
    yield change(
        "announced power",
        "The simplest reading of trilateration has no survey: the power that beacons announce, the"
        " exponent of free space, three beacons, the last reading of each, and a compass as it is.",
        ProximityExperiment(trilateration=replace(TRILATERATION, most=3, rate=1.0), surveyed=False),
    )


CHANGES = _changes()
