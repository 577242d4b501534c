"""Trials of experiments on disk: one small file a seed, so that a run resumes where it stopped."""

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from blesim.errors import DataError, UsageError
from blesim.reruns.base import Key
from blesim.whole_file import write_whole


class Task(NamedTuple):
    """A trial: of which paper, with which seed, and with what otherwise (nothing if empty)."""

    paper: str
    seed: int
    change: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialStore:
    """Where the trials of a run lie.

    Attributes
    ----------
    folder : Path
        Of the run.
    version : str
        What the numbers were made with; those of another version do not count.
    """

    folder: Path
    version: str

    def load(self, task: Task) -> dict[Key, float] | None:
        """Numbers of a trial; none if it has not been done with this version.

        Raises
        ------
        DataError
            If the file is damaged.
        """
        path = self._path(task)
        try:
            told = json.loads(path.read_text(encoding="utf-8"))
            if told["version"] != self.version:
                return None
            if Task(told["paper"], told["seed"], told["change"]) != task:
                raise ValueError("of another trial")
            return {Key(*each["key"]): _number(each["value"]) for each in told["numbers"]}
        except FileNotFoundError:
            return None
        except (OSError, ValueError, TypeError, LookupError) as fault:
            raise DataError(f"{path}: damaged ({fault}); delete it to do it again") from fault

    def make_room(self, tasks: Iterable[Task]) -> None:
        """Make the folders of trials, before the work of the first of them is done.

        Raises
        ------
        UsageError
            If they cannot be made or written to.
        """
        for folder in sorted({self._path(task).parent for task in tasks}):
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError as fault:
                raise UsageError(f"{folder}: cannot be made: {fault.strerror}") from fault
            if not os.access(folder, os.W_OK):
                raise UsageError(f"{folder}: cannot be written to; give another folder")

    def save(self, task: Task, numbers: Mapping[Key, float]) -> None:
        """Write the numbers of a trial, whole or not at all; its folder was made before."""
        path = self._path(task)
        told = {
            **task._asdict(),
            "version": self.version,
            "numbers": [
                {"key": list(key), "value": value if value == value else None}
                for key, value in numbers.items()
            ],
        }
        write_whole(path, (json.dumps(told, indent=1) + "\n").encode())

    def _path(self, task: Task) -> Path:
        folder = self.folder / "trials" / task.paper / task.change
        return folder / f"seed-{task.seed:04d}.json"


def _number(value: object) -> float:
    if value is None:
        return float("nan")
    if not isinstance(value, int | float):
        raise TypeError(f"no number: {value}")
    return float(value)
