"""Several estimators on one recording: any number of processes, faults stay where they are."""

from dataclasses import dataclass, field
from typing import ClassVar

import pytest

from blesim.errors import UsageError
from blesim.estimators.base import Need
from blesim.estimators.nearest_beacon import NearestBeacon
from blesim.estimators.practice import practice_recording
from blesim.estimators.run import run
from blesim.estimators.trials import Trials
from blesim.recording import Failure


@dataclass(frozen=True)
class Breaks:
    """An estimator that breaks on one walk."""

    fits: bool = True
    needs: ClassVar[frozenset[Need]] = frozenset()
    venue: object = field(default=None, init=False)

    def fit(self, venue, surveys):  # noqa: ARG002 (the contract has them)
        if not self.fits:
            raise ValueError("cannot learn this")
        return self

    def start(self, start, rng):  # noqa: ARG002 (the contract has them)
        raise RuntimeError("lost the phone")


@pytest.fixture(scope="module")
def recording():
    return practice_recording()


def trials(recording, **made):
    return Trials(estimators=made, recording=recording, seed=3)


def test_each_estimator_on_each_walk_in_order(recording):
    both = trials(recording, near=NearestBeacon(), averaged=NearestBeacon(signal="averaged"))
    results = dict(both.results())
    assert list(results) == [
        (label, walk) for label in ("near", "averaged") for walk in ("there", "back")
    ]
    assert len(both) == 4
    for (label, walk), track in results.items():
        estimator = both.estimators[label]
        alone = run(estimator, recording, recording.by_name[walk], seed=3, label=label)
        assert track == alone


def test_the_same_with_two_processes(recording):
    made = {"near": NearestBeacon(), "graph": NearestBeacon(window_s=1.0)}
    both = Trials(estimators=made, recording=recording, seed=3)
    assert dict(both.results(jobs=2)) == dict(both.results(jobs=1))


@pytest.mark.parametrize(
    ("breaks", "reason"),
    [
        (Breaks(), "RuntimeError: lost the phone"),
        (Breaks(fits=False), "fit: ValueError: cannot learn this"),
    ],
)
def test_one_that_breaks_does_not_stop_the_others(recording, breaks, reason):
    results = dict(trials(recording, broken=breaks, near=NearestBeacon()).results())
    assert results["broken", "there"] == Failure(reason=reason)
    assert not isinstance(results["near", "back"], Failure)


def test_what_is_missing_is_told_before_the_work(recording):
    @dataclass(frozen=True)
    class Channels(Breaks):
        needs: ClassVar[frozenset[Need]] = frozenset({Need.SURVEY})

    bare = type(recording)(
        venue=recording.venue,
        walks=tuple(walk for walk in recording.walks if walk.name != "survey")[-1:],
        provenance=recording.provenance,
    )
    with pytest.raises(UsageError, match="estimator 'picky' needs a survey walk"):
        trials(bare, picky=Channels())


def test_at_least_one_process(recording):
    with pytest.raises(UsageError, match="at least one process"):
        next(trials(recording, near=NearestBeacon()).results(jobs=0))
