"""What a row of the benchmark is, and how times are compared."""

import operator
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from statistics import median
from time import perf_counter

Work = Callable[[], object]

_COMPARISONS = {">=": operator.ge, "<=": operator.le, ">": operator.gt, "<": operator.lt}


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """One line of the table and one entry of the file; goal and met are None without a goal."""

    name: str
    value: float
    unit: str
    goal: str | None
    met: bool | None

    def as_json(self) -> dict[str, object]:
        """Return the entry of the file."""
        return asdict(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A number to measure.

    Attributes
    ----------
    name : str
        What `--only` calls it.
    unit : str
        Such as ``"s"``, or ``"x"`` for a ratio.
    measure : callable
        Returns the value.
    goal : str or None
        Comparison and number, such as ``">= 100"``.
    """

    name: str
    unit: str
    measure: Callable[[], float]
    goal: str | None = None

    def result(self) -> Result:
        """Measure, and hold the value against the goal."""
        value = float(self.measure())
        met = None if self.goal is None else meets(value, self.goal)
        return Result(name=self.name, value=value, unit=self.unit, goal=self.goal, met=met)


def meets(value: float, goal: str) -> bool:
    """Whether a value reaches a goal such as ``"< 0.3"``."""
    comparison, number = goal.split()
    return bool(_COMPARISONS[comparison](value, float(number)))


def seconds(work: Work, repeats: int = 1) -> float:
    """Mean duration of doing the work a few times. [s]."""
    start = perf_counter()
    for _ in range(repeats):
        work()
    return (perf_counter() - start) / repeats


def speed_ratio(
    ours: Work, theirs: Work, *, rounds: int, our_repeats: int = 1, their_repeats: int = 1
) -> float:
    """How many times faster we are: median over rounds in which both take turns. [-].

    Each does its work once before, so that compiling and first touches do not count.
    """
    ours()
    theirs()
    ratios = []
    for _ in range(rounds):
        our_s = seconds(ours, our_repeats)
        ratios.append(seconds(theirs, their_repeats) / our_s)
    return median(ratios)


def median_seconds(works: Sequence[Work], *, rounds: int) -> list[float]:
    """Median duration of each of several works that take turns, done once before. [s]."""
    for work in works:
        work()
    times = [[seconds(work) for work in works] for _ in range(rounds)]
    return [median(column) for column in zip(*times, strict=True)]
