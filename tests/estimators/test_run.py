# ruff: noqa: ARG001, ARG002, ARG005 (the contract names the arguments)
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

from blesim.errors import DataError, UsageError
from blesim.estimators.base import Need, StartInfo, make_track
from blesim.estimators.nearest_beacon import NearestBeacon
from blesim.estimators.practice import practice_recording
from blesim.estimators.run import run, start_of, surveys_of
from blesim.recording import Failure, Observations, WalkKind
from blesim.tables import Imu, Marks, Readings, Steps

RECORDING = practice_recording()
WALK = RECORDING.by_name["there"]


@dataclass(frozen=True)
class Scripted:
    """Does what a test tells it; writes down what it was given."""

    answer: object
    log: list
    needs: frozenset = frozenset()
    sure_m2: ClassVar[dict] = {"variance_x_m2": 1.0, "variance_y_m2": 1.0}

    def fit(self, venue, surveys):
        self.log.append((venue, surveys))
        return self

    def start(self, start, rng):
        self.log.append((start, rng.random(3)))
        return self

    def advance(self, block):
        self.log.append(block)
        return self.answer(block)


def nothing(block):
    return make_track(time_us=[], x_m=[], y_m=[], **Scripted.sure_m2)


def at(time_us, x_m=1.0, **columns):
    return lambda block: make_track(
        time_us=[time_us], x_m=[x_m], y_m=[1.0], **{**Scripted.sure_m2, **columns}
    )


def attempt(answer, **how):
    log = []
    result = run(Scripted(answer, log, **how), RECORDING, WALK, seed=1, label="scripted")
    return result, log


def test_nearest_beacon_follows_a_walk():
    track = run(NearestBeacon(), RECORDING, WALK, seed=1, label="nearest-beacon")
    assert track.time_us.tolist() == WALK.observations.readings.time_us.tolist()


def test_fit_is_given_the_survey_walks_and_nothing_else():
    _, log = attempt(nothing)
    venue, surveys = log[0]
    assert venue is RECORDING.venue
    assert [[walk.name for walk in survey.walks] for survey in surveys] == [["survey"]]
    assert len(surveys[0].walks[0].observations.marks)


def test_surveys_tell_neither_scenario_nor_seed():
    origin = replace(RECORDING.provenance, scenario="walks: [...]", seed=7)
    (survey,) = surveys_of(replace(RECORDING, provenance=origin))
    assert (survey.provenance.scenario, survey.provenance.seed) == ("", None)
    assert survey.provenance.title == origin.title


def test_a_tracker_sees_all_but_the_marks():
    _, log = attempt(nothing)
    assert log[2] == replace(WALK.observations, marks=Marks.empty())


def test_the_start_is_given_to_those_who_ask():
    assert attempt(nothing)[1][1][0] is None
    _, log = attempt(nothing, needs=frozenset({Need.START}))
    assert log[1][0] == StartInfo(x_m=2.0, y_m=2.0, level=0, heading_rad=None)


def test_a_mark_pressed_later_tells_no_start():
    late = WALK.observations.marks.rows(slice(1, None))
    walk = replace(WALK, observations=replace(WALK.observations, marks=late))
    assert start_of(walk) is None
    assert start_of(replace(WALK, observations=Observations())) is None


def test_random_numbers_are_named_by_seed_label_and_walk():
    def drawn(seed, label, walk):
        log = []
        run(Scripted(nothing, log), RECORDING, RECORDING.by_name[walk], seed=seed, label=label)
        return tuple(log[1][1])

    first = drawn(1, "a", "there")
    assert drawn(1, "a", "there") == first
    others = {drawn(2, "a", "there"), drawn(1, "b", "there"), drawn(1, "a", "back")}
    assert len(others | {first}) == 4


def fails(block):
    raise ZeroDivisionError("no\nbeacon")


def explains(block):
    raise DataError("beacon B7 was never surveyed")


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        (fails, "ZeroDivisionError: no beacon"),
        (explains, "beacon B7 was never surveyed"),
        (lambda block: None, "no Track but a NoneType"),
        (at(1_000_000, x_m=np.nan), "x_m is not a finite number at 1000000 us"),
        (at(1_000_000, variance_x_m2=np.inf), "variance_x_m2 is not a finite number"),
        (at(99_000_000), "outside the walk, which lasts from 0 to 32000000 us"),
        (at(1_000_000, level=3), "level that the venue does not have"),
        (at(1_000_000, edge=4, offset_m=0.0), "edge that the aisle graph does not have"),
        (at(1_000_000, edge=0, offset_m=12.1), "offset lies beyond its edge"),
        (at(1_000_000, edge=0), "offset lies beyond its edge"),
        (lambda block: at(2_000_000)(block).rows(np.array([0, 0])), None),
        (
            lambda block: make_track(time_us=[2, 1], x_m=1.0, y_m=1.0, **Scripted.sure_m2),
            "times go backwards",
        ),
    ],
)
def test_an_estimator_fails_its_own_track_with_the_reason(answer, reason):
    result, _ = attempt(answer)
    if reason is None:
        assert not isinstance(result, Failure)
    else:
        assert isinstance(result, Failure)
        assert reason in result.reason
        assert "\n" not in result.reason


@dataclass(frozen=True)
class Unfit(Scripted):
    def fit(self, venue, surveys):
        raise ValueError("too few points")


def test_a_failed_fit_fails_the_track():
    result = run(Unfit(nothing, []), RECORDING, WALK, seed=1, label="unfit")
    assert result == Failure(reason="fit: ValueError: too few points")


def test_an_empty_track_of_an_empty_walk_is_one():
    walk = replace(WALK, observations=Observations())
    assert len(run(NearestBeacon(), RECORDING, walk, seed=1, label="nearest-beacon")) == 0


def without(**streams):
    return replace(WALK, observations=replace(WALK.observations, **streams))


UNTOLD = replace(
    WALK.observations.readings, channel=np.zeros(len(WALK.observations.readings), np.uint8)
)
TRIALS = tuple(walk for walk in RECORDING.walks if walk.kind == WalkKind.WALK)
PLAIN = replace(RECORDING, venue=replace(RECORDING.venue, graph=None))


@pytest.mark.parametrize(
    ("need", "recording", "walk", "says"),
    [
        (Need.SURVEY, replace(RECORDING, walks=TRIALS), WALK, "a survey walk"),
        (Need.IMU, RECORDING, without(imu=Imu.empty()), "IMU samples"),
        (Need.STEPS, RECORDING, without(steps=Steps.empty()), "step events"),
        (
            Need.CHANNELS,
            RECORDING,
            without(readings=UNTOLD),
            "readings that tell their advertising channel",
        ),
        (Need.GRAPH, PLAIN, WALK, "an aisle graph"),
        (Need.START, RECORDING, without(marks=Marks.empty()), "a mark at the start"),
    ],
)
def test_what_is_missing_is_named_before_the_run(need, recording, walk, says):
    log = []
    asks, modest = Scripted(nothing, log, frozenset({need})), Scripted(nothing, [])
    with pytest.raises(UsageError, match=f"'picky' needs {says}.*walk 'there'"):
        run(asks, recording, walk, seed=1, label="picky")
    assert log == []
    assert len(run(modest, recording, walk, seed=1, label="modest")) == 0
    assert len(run(asks, RECORDING, WALK, seed=1, label="picky")) == 0


def test_all_that_is_missing_is_named_at_once():
    walk = without(imu=Imu.empty(), steps=Steps.empty(), readings=Readings.empty())
    with pytest.raises(UsageError, match="IMU samples and step events"):
        run(Scripted(nothing, [], frozenset(Need)), RECORDING, walk, seed=1, label="picky")
