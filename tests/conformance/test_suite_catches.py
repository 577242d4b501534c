"""The conformance suite is itself tried: on an honest estimator, and on one liar for each rule."""

# ruff: noqa: ARG002 (the contract names the arguments)
import random
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
import pytest

from blesim.columns import CHANNEL_NOT_TOLD
from blesim.errors import ConformanceError
from blesim.estimators.base import Need, fitted, make_track
from blesim.estimators.check import RULES, check_estimator
from blesim.estimators.practice import practice_recording
from blesim.recording import WalkKind


class Tracker:
    """Half way between the last two beacons heard."""

    def __init__(self, estimator, rng):
        self.estimator, self.rng, self.last = estimator, rng, None

    def advance(self, block):
        rows = [self.row(*row) for row in self.readings(block)]
        return self.track(*np.array(rows).reshape(-1, 3).T)

    def readings(self, block):
        return list(zip(block.readings.time_us, block.readings.beacon, strict=True))

    def row(self, time_us, beacon):
        here = self.estimator.places[beacon]
        before, self.last = here if self.last is None else self.last, here
        return time_us, *(here + before) / 2

    def track(self, time_us, x_m, y_m, **columns):
        sure = {"variance_x_m2": 9.0, "variance_y_m2": 9.0}
        return make_track(time_us=time_us, x_m=x_m, y_m=y_m, **{**sure, **columns})


@dataclass(frozen=True)
class Honest:
    tracker: ClassVar[type] = Tracker
    places: object = field(default=None, init=False)
    needs: ClassVar[frozenset[Need]] = frozenset()

    def fit(self, venue, surveys):
        return fitted(self, places=venue.beacon_xyz_m[:, :2])

    def start(self, start, rng):
        return self.tracker(self, rng)


def liar(tracker=Tracker, base=Honest, **members):
    """Estimator that behaves as the given tracker and members say."""
    return dataclass(frozen=True)(type("Liar", (base,), {"tracker": tracker, **members}))()


@dataclass
class Thawed:
    needs: ClassVar[frozenset[Need]] = frozenset()
    fit, start = Honest.fit, Honest.start


class Rewritable(Honest):
    """Frozen by name, thawed by hand."""

    __setattr__ = object.__setattr__


class FitsInPlace(Honest):
    def fit(self, venue, surveys):
        object.__setattr__(self, "places", venue.beacon_xyz_m[:, :2])
        return self


class FitsBoth(Honest):
    def fit(self, venue, surveys):
        object.__setattr__(self, "radio_map", len(surveys))
        return super().fit(venue, surveys)


class Forgetful(Honest):
    def fit(self, venue, surveys):
        return None


class Raising(Tracker):
    def row(self, time_us, beacon):
        raise KeyError(beacon)


class NotANumber(Tracker):
    def row(self, time_us, beacon):
        return time_us, np.nan, 0.0


class Untyped(Tracker):
    def advance(self, block):
        return list(super().advance(block).arrays())


class Mute(Tracker):
    def readings(self, block):
        return []


class DrawsFromNumpy(Tracker):
    def row(self, time_us, beacon):
        return time_us, np.random.rand(), 0.0  # noqa: NPY002 (that is the lie)


class DrawsFromPython(Tracker):
    def row(self, time_us, beacon):
        return time_us, random.random(), 0.0


class Unrepeatable(Tracker):
    def row(self, time_us, beacon):
        return time_us, np.random.default_rng().random(), 0.0


class Overwriting(Tracker):
    def advance(self, block):
        times = block.readings.rssi_dbm
        base = times if times.base is None else times.base
        base.flags.writeable = True
        base[:] = -50
        base.flags.writeable = False
        return super().advance(block)


class MovesBeacons(Tracker):
    def row(self, time_us, beacon):
        self.estimator.places.base[beacon] += 0.001  # past the protection of the view
        return super().row(time_us, beacon)


class Unlocking(Tracker):
    def advance(self, block):
        block.readings.rssi_dbm.flags.writeable = True
        return super().advance(block)


class Shared(Honest):
    """All phones are one phone."""

    def fit(self, venue, surveys):
        return fitted(self, places=(venue.beacon_xyz_m[:, :2], []))

    def start(self, start, rng):
        places, memory = self.places
        memory.clear()
        return SharedTracker(places, memory)


class SharedTracker(Tracker):
    def __init__(self, places, memory):
        self.places, self.memory = places, memory

    def row(self, time_us, beacon):
        self.memory.append(self.places[beacon])
        return time_us, *np.mean(self.memory[-2:], axis=0)


class LooksAhead(Tracker):
    def readings(self, block):
        rows = super().readings(block)
        return [(time, beacon) for (time, _), (_, beacon) in zip(rows, [*rows[1:], *rows[-1:]])]  # noqa: B905


class Smoother(Tracker):
    def advance(self, block):
        track = super().advance(block)
        return replace(track, x_m=np.full(len(track), np.mean(track.x_m))) if len(track) else track


class ForgetsBetweenBlocks(Tracker):
    def advance(self, block):
        self.last = None
        return super().advance(block)


class AfraidOfNothing(Tracker):
    def advance(self, block):
        _ = block.readings.time_us[0]
        return super().advance(block)


class CountsBlocks(Tracker):
    def advance(self, block):
        if not len(block.readings):
            self.last = None
        return super().advance(block)


class AlwaysAnswers(Tracker):
    def advance(self, block):
        track = super().advance(block)
        return track if len(track) else self.track([0], 1.0, 1.0)


class Late(Tracker):
    """Emits each estimate with the time of the reading before."""

    before_us = 0

    def row(self, time_us, beacon):
        old_us, self.before_us, self.older_us = self.older_us, time_us, self.before_us
        return old_us, *super().row(time_us, beacon)[1:]

    older_us = 0


class OverSure(Tracker):
    def track(self, *columns):
        return super().track(*columns, variance_x_m2=-1.0)


class OverCorrelated(Tracker):
    def track(self, *columns):
        return super().track(*columns, covariance_xy_m2=9.1)


class UsesStepsInSecret(Tracker):
    def advance(self, block):
        if len(block.readings) > 200 and not len(block.steps):
            raise IndexError("no step")
        return super().advance(block)


class UsesTheGraphInSecret(Honest):
    def fit(self, venue, surveys):
        return fitted(self, places=np.repeat(venue.graph.node_xy_m, 2, axis=0))


class UsesTheSurveyInSecret(Honest):
    def fit(self, venue, surveys):
        marks = surveys[0].walks[0].observations.marks
        return fitted(self, places=venue.beacon_xyz_m[:, :2] + marks.x_m[0])


class UsesChannelsInSecret(Tracker):
    def advance(self, block):
        if np.any(block.readings.channel == CHANNEL_NOT_TOLD):
            raise LookupError("which channel?")
        return super().advance(block)


LIARS = {
    "declared: settings belong into a frozen": Thawed(),
    "declared: setting 'places' can be changed": Rewritable(),
    "declared: 'needs' must be a frozenset of Need": liar(needs={"survey"}),
    "fit returns a copy: fit must return a copy": liar(base=FitsInPlace),
    "fit returns a copy: fit changed the estimator": liar(base=FitsBoth),
    "fit returns a copy: fit must return the estimator's own type": liar(base=Forgetful),
    "valid track: it raises KeyError": liar(Raising),
    "valid track: x_m is not a finite number": liar(NotANumber),
    "valid track: no Track but a list": liar(Untyped),
    "valid track: it gave no estimate": liar(Mute),
    "no global randomness: it draws": (liar(DrawsFromNumpy), liar(DrawsFromPython)),
    "inputs untouched: it changed its observations": (liar(Overwriting), liar(MovesBeacons)),
    "inputs untouched: it made the arrays": liar(Unlocking),
    "repeatable: the same seed gave another": liar(Unrepeatable),
    "trackers of their own: two trackers": liar(base=Shared),
    "no peeking ahead: estimates up to": (liar(LooksAhead), liar(Smoother)),
    "empty input: it raises IndexError": liar(AfraidOfNothing),
    "empty input: an empty block gave": liar(AlwaysAnswers),
    "empty input: an empty block in between": liar(CountsBlocks),
    "blocks do not matter: one reading at a time": liar(ForgetsBetweenBlocks),
    "times: an estimate lies outside": liar(Late),
    "covariance: negative": liar(OverSure),
    "covariance: .covariance. exceeds": liar(OverCorrelated),
    "needs are complete: it raises": (
        liar(UsesStepsInSecret),
        liar(UsesChannelsInSecret),
        liar(base=UsesTheGraphInSecret),
        liar(base=UsesTheSurveyInSecret),
    ),
}
PAIRS = [
    (says, one)
    for says, several in LIARS.items()
    for one in (several if isinstance(several, tuple) else (several,))
]


def names_of_rules(says):
    return says.partition(":")[0]


def test_an_honest_estimator_passes():
    check_estimator(Honest())


def test_every_rule_has_its_liar():
    assert {names_of_rules(says) for says in LIARS} == {"declared", *RULES}


@pytest.mark.parametrize(("says", "estimator"), PAIRS)
def test_each_liar_is_caught_and_told_which_rule_it_breaks(says, estimator):
    with pytest.raises(ConformanceError, match=says):
        check_estimator(estimator, practice_recording())


def test_a_recording_of_the_callers_must_have_what_is_needed():
    recording = practice_recording()
    trials = tuple(walk for walk in recording.walks if walk.kind == WalkKind.WALK)
    needy = liar(needs=frozenset({Need.SURVEY}))
    check_estimator(needy, recording)
    with pytest.raises(ConformanceError, match="declared: no walk of the recording has"):
        check_estimator(needy, replace(recording, walks=trials))
