"""Experiments over many seeds, shared by processes, resumed where they stopped."""

import hashlib
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from blesim import __version__
from blesim.errors import DataError, UsageError
from blesim.reruns.base import Experiment, Key, Picture
from blesim.reruns.registry import experiment_of
from blesim.reruns.sites import scenario_files
from blesim.reruns.statistics import Figure, Ordering, figures_of, orderings_of, stacked
from blesim.reruns.trials_on_disk import TrialStore
from blesim.workers import shared

# A trial: the short name of the paper, and the seed.
Task = tuple[str, int]
FIRST_SEED = 1
_CONNECT_S = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Rerun:
    """What the seeds of one experiment gave, beside what was published."""

    experiment: Experiment
    seeds: int
    figures: tuple[Figure, ...]
    orderings: tuple[Ordering, ...]
    pictures: tuple[Picture, ...]


def tasks_of(papers: Sequence[str], seeds: int) -> list[Task]:
    """All trials: the first seed of every paper first, so that faults show early.

    Raises
    ------
    UsageError
        If a paper is unknown or there is no seed.
    """
    if seeds < 1:
        raise UsageError(f"seeds {seeds}: at least one is needed")
    for paper in papers:
        experiment_of(paper)
    return [(paper, FIRST_SEED + number) for number in range(seeds) for paper in papers]


def trials(
    tasks: Sequence[Task], store: TrialStore, jobs: int = 1, scheduler: str | None = None
) -> Generator[Task, None, None]:
    """Trials as they are done and saved; what is there already comes first.

    Parameters
    ----------
    tasks : sequence of (str, int)
        From `tasks_of`.
    store : TrialStore
        Where they are kept.
    jobs : int
        Processes to share the work; the numbers are the same for any number.
    scheduler : str or None
        Address of a dask scheduler whose workers do the work instead.

    Raises
    ------
    UsageError
        If there is no such scheduler.
    """
    left = []
    for task in tasks:
        if store.load(*task) is None:
            left.append(task)
        else:
            yield task
    if scheduler is not None:
        yield from _saved(left, _on_dask(left, scheduler), store)
        return
    with closing(shared(_experimenter, (), left, jobs)) as results:
        yield from _saved(left, results, store)


def _saved(
    tasks: Sequence[Task], results: Iterable[dict[Key, float]], store: TrialStore
) -> Generator[Task, None, None]:
    for task, numbers in zip(tasks, results, strict=True):
        store.save(*task, numbers)
        yield task


def _on_dask(tasks: Sequence[Task], scheduler: str) -> Iterator[dict[Key, float]]:
    try:
        from distributed import Client
    except ImportError as fault:
        raise UsageError("a scheduler needs dask: pip install 'blesim[cluster]'") from fault
    try:
        client = Client(scheduler, timeout=_CONNECT_S)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as fault:
        raise UsageError(f"no dask scheduler answers at '{scheduler}'") from fault
    with client:
        yield from (future.result() for future in client.map(_numbers, tasks, pure=False))


def _experimenter() -> Callable[[Task], dict[Key, float]]:
    """What does a trial; a process imports an experiment when its first trial comes."""
    return _numbers


def _numbers(task: Task) -> dict[Key, float]:
    paper, seed = task
    return dict(experiment_of(paper).trial(seed).numbers)


def summarised(paper: str, seeds: int, store: TrialStore, *, pictures: bool = True) -> Rerun:
    """An experiment whose trials are all done, beside what was published.

    Raises
    ------
    DataError
        If a trial is missing or gave no number for something published.
    """
    experiment = experiment_of(paper)
    found = [store.load(paper, FIRST_SEED + number) for number in range(seeds)]
    done = [numbers for numbers in found if numbers is not None]
    if len(done) < seeds:
        raise DataError(f"{store.folder}: {seeds - len(done)} trials of {paper} are missing")
    numbers = stacked(done)
    missing = [each.key for each in experiment.published if each.key not in numbers]
    if missing:
        raise DataError(f"{paper}: no trial gave {', '.join(map(' / '.join, missing))}")
    drawn = experiment.trial(FIRST_SEED, pictures=True).pictures if pictures else ()
    return Rerun(
        experiment=experiment,
        seeds=seeds,
        figures=figures_of(experiment, numbers),
        orderings=orderings_of(experiment, numbers),
        pictures=(*drawn, *(experiment.overview(numbers) if pictures else ())),
    )


def version_text() -> str:
    """What numbers are made with: versions, and a digest of the package and its scenarios."""
    package = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for path in sorted((*package.rglob("*.py"), *scenario_files())):
        digest.update(path.read_bytes())
    return f"blesim {__version__} {digest.hexdigest()[:16]}, numpy {np.__version__}"
