"""How commands speak: results on standard output, everything else on standard error."""

import json
import sys
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, TypeVar

T = TypeVar("T")


def report_fault(message: str) -> None:
    """Print a fault, one line for each it has."""
    for line in message.splitlines():
        print(f"blesim: {line}", file=sys.stderr)  # noqa: T201  # this is where commands speak


def say(message: str) -> None:
    """Print a line of news for a person."""
    print(message, file=sys.stderr)  # noqa: T201  # this is where commands speak


def answer(text: str) -> None:
    """Print a result."""
    print(text)  # noqa: T201  # this is where commands speak


def answer_json(value: Any) -> None:
    """Print a result for a program; a number that is not finite is refused, not written."""
    answer(json.dumps(value, indent=2, allow_nan=False))


def answer_table(title: str, header: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table: text to the left, numbers (every column but the first) to the right."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title=title, title_justify="left", header_style="bold")
    for number, name in enumerate(header):
        table.add_column(name, justify="right" if number else "left", no_wrap=True)
    for row in rows:
        table.add_row(*row)
    # Into a file or a pipe no column may be cut off for want of a terminal's width.
    width = None if sys.stdout.isatty() else 200
    Console(width=width).print(table)


def progress(items: Iterable[T], total: int, what: str) -> Iterator[T]:
    """The items, with a bar on a terminal and a line each elsewhere, on standard error."""
    if not sys.stderr.isatty():
        for number, item in enumerate(items, start=1):
            yield item
            say(f"{what} {number}/{total}")
        return
    from rich.console import Console
    from rich.progress import track

    yield from track(items, total=total, description=what, console=Console(stderr=True))
