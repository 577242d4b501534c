"""Experiments by the short names of their papers."""

from importlib import import_module

from blesim.errors import UsageError
from blesim.reruns.base import Change, Experiment

# Imported only when asked for: each brings the simulator and its estimators.
_MODULES = {
    "aisle-graph": "aisle_graph",
    "pdr-fingerprint": "pdr_fingerprint",
    "map-ekf": "map_ekf",
    "channel-ekf": "channel_ekf",
    "proximity-pf": "proximity_pf",
}
PAPERS = tuple(_MODULES)


def experiment_of(paper: str) -> Experiment:
    """The experiment of a paper.

    Raises
    ------
    UsageError
        If there is none of that name.
    """
    if paper not in _MODULES:
        raise UsageError(f"there is no paper '{paper}'; there is {', '.join(PAPERS)}, or all")
    experiment: Experiment = import_module(f"blesim.reruns.{_MODULES[paper]}").EXPERIMENT
    return experiment


def changes_of(paper: str) -> tuple[Change, ...]:
    """What of a paper is run with one thing otherwise, to explain what differs.

    Raises
    ------
    UsageError
        If there is no such paper.
    """
    experiment_of(paper)
    changes: tuple[Change, ...] = import_module(f"blesim.reruns.{_MODULES[paper]}_changes").CHANGES
    return changes


def change_of(paper: str, name: str) -> Change:
    """One of them, by its short name.

    Raises
    ------
    UsageError
        If there is none of that name.
    """
    changes = {change.short_name: change for change in changes_of(paper)}
    if name not in changes:
        raise UsageError(f"{paper} has no change '{name}'; it has {', '.join(changes)}")
    return changes[name]
