"""Several estimators on all walks of a recording, shared by processes."""

from collections.abc import Generator, Mapping
from dataclasses import dataclass, field

from blesim.errors import InvariantError, UsageError
from blesim.estimators.base import Estimator
from blesim.estimators.run import fit, follow, refuse_missing
from blesim.recording import Failure, Recording, Walk, WalkKind
from blesim.tables import Track
from blesim.workers import workers

Trial = tuple[tuple[str, str], Track | Failure]


@dataclass(frozen=True, slots=True, kw_only=True)
class Trials:
    """Estimators that are to position the walks of a recording.

    Attributes
    ----------
    estimators : mapping of str to Estimator
        By label; not yet fitted.
    recording : Recording
        Whose walks they position; its surveys they learn from.
    seed : int
        With label and walk, it addresses the random numbers.

    Raises
    ------
    UsageError
        If the recording lacks what an estimator needs.
    """

    estimators: Mapping[str, Estimator]
    recording: Recording
    seed: int

    def __post_init__(self) -> None:
        for label, estimator in self.estimators.items():
            for walk in self._walks():
                refuse_missing(estimator, self.recording, walk, label)

    def __len__(self) -> int:
        """How many pairs of estimator and walk."""
        return len(self.estimators) * len(self._walks())

    def results(self, jobs: int = 1) -> Generator[Trial, None, None]:
        """Tracks by label and walk, or why there is none, estimator after estimator.

        Who does not take them all closes the generator, which ends its processes.

        Parameters
        ----------
        jobs : int
            Processes to share the work; the tracks are the same for any number.

        Raises
        ------
        BlesimError
            If one of several processes dies.
        """
        if jobs < 1:
            raise UsageError(f"jobs {jobs}: at least one process is needed")
        pairs = [(label, walk.name) for label in self.estimators for walk in self._walks()]
        if jobs == 1 or len(pairs) < 2:
            desk = _Desk(trials=self)
            yield from (desk.tried(pair) for pair in pairs)
            return
        with workers(min(jobs, len(pairs)), _sit_down, (self,)) as crew:
            yield from crew.results(_tried_by_worker, pairs)

    def _walks(self) -> list[Walk]:
        return [walk for walk in self.recording.walks if walk.kind == WalkKind.WALK]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Desk:
    """Where one process works: each estimator is fitted there once, when its turn comes."""

    trials: Trials
    fitted: dict[str, Estimator | Failure] = field(default_factory=dict)

    def tried(self, pair: tuple[str, str]) -> Trial:
        label, name = pair
        if label not in self.fitted:
            self.fitted[label] = fit(self.trials.estimators[label], self.trials.recording)
        learned, recording = self.fitted[label], self.trials.recording
        if isinstance(learned, Failure):
            return pair, learned
        walk = recording.by_name[name]
        return pair, follow(learned, recording.venue, walk, seed=self.trials.seed, label=label)


_desk: _Desk | None = None


def _sit_down(trials: Trials) -> None:
    global _desk
    _desk = _Desk(trials=trials)


def _tried_by_worker(pair: tuple[str, str]) -> Trial:
    if _desk is None:
        raise InvariantError("a worker was asked for a track before it knew the recording")
    return _desk.tried(pair)
