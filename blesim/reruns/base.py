"""What an experiment is: numbers of a seed, what was published of them, what should be less."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from blesim.venue.venue import Venue

Numbers = NDArray[np.float64]


class Key(NamedTuple):
    """Which number: a table or figure of the paper, its row, its column with the unit."""

    table: str
    row: str
    column: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Published:
    """A number as it was published.

    Attributes
    ----------
    key : Key
        Which number.
    value : float
        As printed.
    compared : bool
        Whether a ratio to it says something; not for a number that the scenario was set by.
    """

    key: Key
    value: float
    compared: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Expected:
    """An ordering that was published: the number of `better` is less than that of `worse`.

    Attributes
    ----------
    better, worse : Key
        Numbers of the same seed.
    condition : str
        Under which the two differ in nothing else.
    strong : bool
        Whether the quick form, with few seeds, must show it too.
    """

    better: Key
    worse: Key
    condition: str
    strong: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """One line of a picture: its label, and pairs of x and y, (n,).

    One of published numbers follows ours that it belongs to, and has its colour.
    """

    label: str
    x: Numbers
    y: Numbers
    published: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """A picture in the paper's form, of one seed or over all.

    Attributes
    ----------
    name : str
        Of the file, without its ending.
    title, x_label, y_label : str
        Labels with their units.
    kind : str
        ``line``; ``step``, as distributions are drawn; ``bars``; ``map``: over the floor plan.
    curves : tuple of Curve
        What is drawn.
    venue : Venue or None
        Floor plan of a map.
    x_names : tuple of str
        Of the places of the first curve's x, where they are no numbers.
    """

    name: str
    title: str
    x_label: str
    y_label: str
    kind: Literal["line", "step", "bars", "map"]
    curves: tuple[Curve, ...]
    venue: Venue | None = None
    x_names: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """What one seed gave: its numbers, and pictures if they were asked for."""

    numbers: Mapping[Key, float]
    pictures: tuple[Picture, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """An experiment with one thing otherwise, to see what hangs on it.

    Attributes
    ----------
    name : str
        What is otherwise, in a few words that begin a row of a table.
    why : str
        What the paper leaves open about it, or what it is to show; one sentence.
    experiment : Experiment
        With it.
    shown : tuple of Key
        The numbers to compare, which both experiments give.
    """

    name: str
    why: str
    experiment: "Experiment"
    shown: tuple[Key, ...]

    @property
    def short_name(self) -> str:
        """For a file: its name in small letters and digits."""
        return "-".join(re.findall(r"[a-z0-9.]+", self.name.lower()))


class Experiment(Protocol):
    """A published experiment."""

    @property
    def paper(self) -> str:
        """Its short name."""
        ...

    @property
    def title(self) -> str:
        """What it is, in one line."""
        ...

    @property
    def published(self) -> Sequence[Published]:
        """Every number of the paper that is rerun."""
        ...

    @property
    def expected(self) -> Sequence[Expected]:
        """Every ordering of the paper."""
        ...

    def trial(self, seed: int, *, pictures: bool = False) -> Trial:
        """Numbers of one seed, each key the same in every seed; pictures if asked for."""
        ...

    def overview(self, numbers: Mapping[Key, Numbers]) -> Sequence[Picture]:
        """Pictures over all seeds, from the numbers of each, (seeds,)."""
        ...
