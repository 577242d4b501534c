"""What is run with one thing otherwise, to see what the figures and orderings hang on.

What stands of 30 s beside every beacon and the choices "together" combine is left open by the
paper, each for itself; they are to show that several of them make up what one does not.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from blesim.reruns import pdr_fingerprint_numbers as paper
from blesim.reruns.base import Change, Key
from blesim.reruns.pdr_fingerprint import ESTIMATOR, PdrFingerprintExperiment, TakenAt
from blesim.scenario.reading import NOTHING_ELSE

# With longer stands the first walk lasts 270 s at most; the survey follows the second.
_LATER = {"walks.1.start_s": 300.0, "surveys.0.start_s": 700.0}
# Stops of the scenario's two routes at which the tester stands.
_STANDS = {0: (1, 4, 7), 1: (3, 6, 10)}

# Places 0.6 m in front of the four beacons, in the order of the way past them.
_BEFORE_BEACONS: tuple[Mapping[str, Any], ...] = (
    {"x_m": 2.1, "y_m": 0.6},
    {"node": "d1"},
    {"node": "d3"},
    {"x_m": 14.1, "y_m": 4.2},
)
_COMPLEX = ("a1", "a3", "b3", "b1", "c1", "c3", "d3", "d1", "e1", "e3", "f3", "f1", "g1", "g3")
# Nodes within 1.4 m of a beacon.
_NEAR = ("a1", "b1", "d1", "d3", "f3", "g3")


def _longer_stands(pause_s: float) -> dict[str, Any]:
    """Values of the scenario: the stands there are, of another length."""
    pauses = {
        f"walks.{walk}.route.{stop}.pause_s": pause_s
        for walk, stops in _STANDS.items()
        for stop in stops
    }
    return {**_LATER, **pauses}


def _beside_beacons(pause_s: float) -> dict[str, Any]:
    """Values of the scenario: a stand beside each beacon that either path passes.

    The simple path goes from beacon to beacon and back; the complex one keeps its route.
    """
    there_and_back = (*_BEFORE_BEACONS, *_BEFORE_BEACONS[-2::-1])
    return {
        **_LATER,
        "walks.0.route": [{**place, "pause_s": pause_s} for place in there_and_back],
        "walks.1.route": [
            {"node": node, "pause_s": pause_s if node in _NEAR else 0.0} for node in _COMPLEX
        ],
        # The first place of the simple path is no node, and a mark there tells where it begins.
        "walks.0.marks": "stops",
    }


def _otherwise(
    values: Mapping[str, Any] = NOTHING_ELSE,
    taken_at: TakenAt = "readings",
    settings: Mapping[str, Any] = NOTHING_ELSE,
) -> PdrFingerprintExperiment:
    """The experiment with other values in the scenario, or other settings of the estimator."""
    return PdrFingerprintExperiment(
        values=values, estimator=replace(ESTIMATOR, **settings), taken_at=taken_at
    )


# Fingerprints hardly move a filter that begins so: after 60 steps they have a fifth of the weight.
_FOUR_CHOICES = _otherwise(
    values=_beside_beacons(30.0),
    settings={"source": "system", "begin": "mark", "start_m": 0.1, "step_variance_m2": 0.0002},
)

# What the correction is to make small, what is large without it, and what the body does.
_CORRECTED = (
    paper.error_key("simple", paper.WITHOUT, paper.VARIANCE),
    paper.error_key("simple", paper.WITH, paper.VARIANCE),
    paper.error_key("simple", paper.WITH, paper.MEAN),
    paper.error_key("complex", paper.WITHOUT, paper.VARIANCE),
    paper.error_key("complex", paper.WITH, paper.VARIANCE),
    paper.error_key("complex", paper.WITH, paper.MEAN),
)
_LARGEST = (
    paper.error_key("simple", paper.WITH, paper.MAX),
    paper.error_key("simple", paper.WITHOUT, paper.VARIANCE),
    paper.error_key("complex", paper.WITHOUT, paper.MAX),
    paper.error_key("complex", paper.WITH, paper.MAX),
    paper.error_key("complex", paper.WITHOUT, paper.VARIANCE),
    paper.error_key("complex", paper.WITHOUT, paper.MSE),
)
_TURNED = (
    paper.TURNED,
    paper.error_key("complex", paper.WITHOUT, paper.MAX),
    paper.error_key("complex", paper.WITHOUT, paper.VARIANCE),
    paper.error_key("complex", paper.WITHOUT, paper.MSE),
)


def _table(
    shown: tuple[Key, ...], *rows: tuple[str, str, PdrFingerprintExperiment]
) -> Iterator[Change]:
    for name, why, experiment in rows:
        yield Change(name=name, why=why, experiment=experiment, shown=shown)


CHANGES = (
    *_table(
        _CORRECTED,
        (
            "errors where the tester stood",
            "The paper does not tell when errors are taken; here at the end of each stand.",
            _otherwise(taken_at="stands"),
        ),
        (
            "stands of 30 s",
            "The paper does not tell how long the tester stands; 8 s are assumed.",
            _otherwise(values=_longer_stands(30.0)),
        ),
        (
            "stands beside every beacon",
            "The routes are assumed; here the simple path leads from beacon to beacon and back, and"
            " on both paths the tester stands for 8 s beside every beacon.",
            _otherwise(values=_beside_beacons(8.0)),
        ),
        (
            "stands of 30 s beside every beacon",
            "Both together: much of such a walk is spent where the correction acts.",
            _otherwise(values=_beside_beacons(30.0)),
        ),
        (
            "Q of 0.0002 m2",
            "Q is not published, and with less of it the filter keeps a correction longer.",
            _otherwise(settings={"step_variance_m2": 0.0002}),
        ),
        (
            "n of 3",
            "The number of readings in the moving average is not published; 10 are assumed.",
            _otherwise(settings={"last": 3}),
        ),
        (
            "correction with every reading",
            "The paper leaves open whether a stand is corrected once or all the time.",
            _otherwise(settings={"every_reading": True}),
        ),
        (
            "no multipath",
            "It is to show whether fingerprints are spoilt by multipath.",
            _otherwise(values={"radio.fading.model": "none"}),
        ),
        (
            "no magnetic anomalies",
            "It is to show what headings that are wrong by the place cost.",
            _otherwise(values={"magnetics.anomaly_ut": 0.0, "magnetics.clutter_ut": 0.0}),
        ),
        (
            "three choices together",
            "Stands of 8 s beside every beacon, Q of 0.1 m2 and errors where the tester stood are"
            " all left open.",
            _otherwise(
                values=_beside_beacons(8.0),
                settings={"step_variance_m2": 0.1},
                taken_at="stands",
            ),
        ),
        (
            "four choices together",
            "Stands of 30 s beside every beacon, steps and headings of the system, a start known to"
            " 0.1 m and Q of 0.0002 m2 are all left open.",
            _FOUR_CHOICES,
        ),
    ),
    *_table(
        _LARGEST,
        (
            "start known",
            "The paper does not tell how the filter begins; the first fingerprint is assumed.",
            _otherwise(settings={"begin": "mark"}),
        ),
        (
            "Q of 0.1 m2",
            "Q is not published, and with more of it the filter follows fingerprints sooner.",
            _otherwise(settings={"step_variance_m2": 0.1}),
        ),
        (
            "steps and headings of the system",
            "The paper reads what the phone's system has filtered; assumed are steps and headings"
            " from the raw samples.",
            _otherwise(settings={"source": "system"}),
        ),
        (
            "four choices together, largest errors",
            "The experiment of that name in the table before.",
            _FOUR_CHOICES,
        ),
    ),
    *_table(
        _TURNED,
        (
            "body loss of 12 dB",
            "The body of the paper's tester is unknown; 8 dB are the office's, fitted elsewhere.",
            _otherwise(values={"radio.people.body_loss_db": 12.0}),
        ),
        (
            "stands of 20 s in the survey",
            "The length of the survey is not published; 5 s in each direction are assumed.",
            _otherwise(values={"surveys.0.stand_s": 20.0}),
        ),
    ),
)
