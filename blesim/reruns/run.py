"""Experiments over many seeds, shared by processes, resumed where they stopped."""

import hashlib
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from blesim import __version__
from blesim.errors import DataError, UsageError
from blesim.reruns.base import Experiment, Key, Numbers, Picture
from blesim.reruns.registry import change_of, changes_of, experiment_of
from blesim.reruns.sites import scenario_files
from blesim.reruns.statistics import (
    Changed,
    Figure,
    Ordering,
    changed_of,
    figures_of,
    orderings_of,
    stacked,
)
from blesim.reruns.trials_on_disk import Task, TrialStore
from blesim.workers import shared

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
    changed: tuple[Changed, ...] = ()


def tasks_of(papers: Sequence[str], seeds: int, *, what_if: bool = False) -> list[Task]:
    """All trials: the first seed of every paper first, so that faults show early.

    With `what_if` those with one thing otherwise too, after all the others.

    Raises
    ------
    UsageError
        If a paper is unknown or there is no seed.
    """
    if seeds < 1:
        raise UsageError(f"seeds {seeds}: at least one is needed")
    batches = [[(experiment_of(paper).paper, "") for paper in papers]]
    if what_if:
        batches.append(
            [(paper, change.short_name) for paper in papers for change in changes_of(paper)]
        )
    return [
        Task(paper, seed, change)
        for batch in batches
        for seed in _seeds(seeds)
        for paper, change in batch
    ]


def _seeds(count: int) -> range:
    return range(FIRST_SEED, FIRST_SEED + count)


def trials(
    tasks: Sequence[Task], store: TrialStore, jobs: int = 1, scheduler: str | None = None
) -> Generator[Task, None, None]:
    """Trials as they are done and saved; what is there already comes first.

    Parameters
    ----------
    tasks : sequence of Task
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
        If there is no such scheduler, or trials cannot be kept there.
    """
    store.make_room(tasks)
    left = []
    for task in tasks:
        if store.load(task) is None:
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
        store.save(task, numbers)
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
    experiment = experiment_of(task.paper)
    if task.change:
        experiment = change_of(task.paper, task.change).experiment
    return dict(experiment.trial(task.seed).numbers)


def summarised(
    paper: str, seeds: int, store: TrialStore, *, pictures: bool = True, what_if: bool = False
) -> Rerun:
    """An experiment whose trials are all done, beside what was published.

    Raises
    ------
    DataError
        If a trial is missing or gave no number for something published or compared.
    """
    experiment = experiment_of(paper)
    ordered = [key for each in experiment.expected for key in (each.better, each.worse)]
    wanted = list(dict.fromkeys([*(each.key for each in experiment.published), *ordered]))
    numbers = _numbers_of([Task(paper, seed) for seed in _seeds(seeds)], wanted, store)
    drawn = experiment.trial(FIRST_SEED, pictures=True).pictures if pictures else ()
    return Rerun(
        experiment=experiment,
        seeds=seeds,
        figures=figures_of(experiment, numbers),
        orderings=orderings_of(experiment, numbers),
        pictures=(*drawn, *(experiment.overview(numbers) if pictures else ())),
        changed=tuple(_changed(experiment, numbers, seeds, store)) if what_if else (),
    )


def _numbers_of(
    tasks: Sequence[Task], wanted: Sequence[Key], store: TrialStore
) -> Mapping[Key, Numbers]:
    """What trials gave, by key, (seeds,)."""
    found = [store.load(task) for task in tasks]
    done = [numbers for numbers in found if numbers is not None]
    what = " / ".join(filter(None, (tasks[0].paper, tasks[0].change)))
    if len(done) < len(tasks):
        raise DataError(f"{store.folder}: {len(tasks) - len(done)} trials of {what} are missing")
    for task, numbers in zip(tasks, done, strict=True):
        missing = [key for key in wanted if not np.isfinite(numbers.get(key, np.nan))]
        if missing:
            told = ", ".join(map(" / ".join, missing))
            raise DataError(f"{what}, seed {task.seed}: no number for {told}")
    return stacked(done)


def _changed(
    experiment: Experiment, numbers: Mapping[Key, Numbers], seeds: int, store: TrialStore
) -> Iterator[Changed]:
    for change in changes_of(experiment.paper):
        tasks = [Task(experiment.paper, seed, change.short_name) for seed in _seeds(seeds)]
        yield changed_of(change, numbers, _numbers_of(tasks, change.shown, store))


def version_text() -> str:
    """What numbers are made with: versions, and a digest of the package and its scenarios."""
    package = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for path in sorted((*package.rglob("*.py"), *scenario_files())):
        digest.update(path.read_bytes())
    return f"blesim {__version__} {digest.hexdigest()[:16]}, numpy {np.__version__}"
