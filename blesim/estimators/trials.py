"""Several estimators on all walks of a recording, shared by processes."""

from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass

from blesim.estimators.base import Estimator
from blesim.estimators.run import fit, follow, refuse_missing
from blesim.recording import Failure, Recording, Walk, WalkKind
from blesim.tables import Track
from blesim.workers import shared

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
        pairs = [(label, walk.name) for label in self.estimators for walk in self._walks()]
        yield from shared(_desk, (self,), pairs, jobs)

    def _walks(self) -> list[Walk]:
        return [walk for walk in self.recording.walks if walk.kind == WalkKind.WALK]


def _desk(trials: Trials) -> Callable[[tuple[str, str]], Trial]:
    """What tries one estimator on one walk; each is fitted once, when its turn comes."""
    recording = trials.recording
    learned: dict[str, Estimator | Failure] = {}

    def tried(pair: tuple[str, str]) -> Trial:
        label, name = pair
        if label not in learned:
            learned[label] = fit(trials.estimators[label], recording)
        fitted = learned[label]
        if isinstance(fitted, Failure):
            return pair, fitted
        walk = recording.by_name[name]
        return pair, follow(fitted, recording.venue, walk, seed=trials.seed, label=label)

    return tried
