"""How commands speak: results on standard output, everything else on standard error."""

import errno
import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from io import TextIOWrapper
from typing import Any, TypeVar

from blesim.report.printable import printable
from blesim.stopping import refuse_if_stopped

T = TypeVar("T")
# A cell of a table: one line, or several.
Cell = str | tuple[str, ...]


def prepare_streams() -> None:
    """Let every command print, whatever its streams are: closed, or unable to show a letter."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115  # stays
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")


def report_fault(message: str) -> None:
    """Print a fault, one line for each it has; nothing if nobody can be told."""
    with suppress(OSError):
        for line in message.split("\n"):
            say(f"blesim: {line}")


def report_lost_output(fault: OSError) -> None:
    """Say that output could not be written, unless its reader has gone, and write no more."""
    if fault.errno != errno.EPIPE:
        report_fault(f"output cannot be written: {fault.strerror}")
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            # What is still held back would fail once more when the interpreter ends.
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def say(message: str) -> None:
    """Print a line of news for a person."""
    print(printable(message), file=sys.stderr)  # noqa: T201  # this is where commands speak


def answer(text: str) -> None:
    """Print a result of one or more lines."""
    for line in text.split("\n"):
        print(printable(line))  # noqa: T201  # this is where commands speak


def answer_json(value: Any) -> None:
    """Print a result for a program; a number that is not finite is refused, not written."""
    answer(json.dumps(value, indent=2, allow_nan=False))


def answer_table(title: str, header: Sequence[str], rows: Iterable[Sequence[Cell]]) -> None:
    """Print a table: text to the left, numbers (every column but the first) to the right."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title=title, title_justify="left", header_style="bold")
    for number, name in enumerate(header):
        table.add_column(name, justify="right" if number else "left", no_wrap=True)
    for row in rows:
        table.add_row(*map(_as_it_is, row))
    # Into a file or a pipe no column may be cut off for want of a terminal's width.
    width = None if sys.stdout.isatty() else 200
    Console(width=width).print(table)


def _as_it_is(cell: Cell) -> Any:
    """Text of a cell; square brackets in a name are letters, not markup."""
    from rich.text import Text

    lines = (cell,) if isinstance(cell, str) else cell
    return Text("\n".join(map(printable, lines)))


def progress(items: Iterable[T], total: int, what: str) -> Iterator[T]:
    """The items, with a bar on a terminal and a line each elsewhere, on standard error.

    Raises
    ------
    Stopped
        After an item, if somebody wished it meanwhile.
    """
    shown = _bar if sys.stderr.isatty() else _lines
    for item in shown(items, total, what):
        yield item
        refuse_if_stopped()


@contextmanager
def day_progress() -> Iterator[Callable[[int, int], None]]:
    """What to tell how far a simulated day has come: how many people are gone, and of how many.

    A bar on a terminal and a line for each tenth elsewhere, on standard error. Raises `Stopped`
    out of the day if somebody wished it.
    """
    told = _DayBar() if sys.stderr.isatty() else _DayLines()
    try:
        yield told.tell
    finally:
        told.end()


class _DayLines:
    """One line for each tenth of the people of a day."""

    def __init__(self) -> None:
        self._tenths = 0

    def tell(self, gone: int, people: int) -> None:
        refuse_if_stopped()
        tenths = 10 * gone // max(people, 1)
        if tenths > self._tenths:
            self._tenths = tenths
            say(f"day: {gone}/{people} people have left")

    def end(self) -> None:
        """Do nothing more."""


class _DayBar:
    """A bar that fills as a day goes by."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.progress import Progress

        self._bar = Progress(console=Console(stderr=True), transient=True)
        self._task = self._bar.add_task("trading day")
        self._bar.start()

    def tell(self, gone: int, people: int) -> None:
        refuse_if_stopped()
        self._bar.update(self._task, completed=gone, total=people)

    def end(self) -> None:
        self._bar.stop()


def _lines(items: Iterable[T], total: int, what: str) -> Iterator[T]:
    for number, item in enumerate(items, start=1):
        yield item
        say(f"{what} {number}/{total}")


def _bar(items: Iterable[T], total: int, what: str) -> Iterator[T]:
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import track

    description = escape(printable(what))
    yield from track(items, total=total, description=description, console=Console(stderr=True))
