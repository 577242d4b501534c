"""Reruns as files: JSON for programs, Markdown, and one self-contained page with all pictures."""

import json
from base64 import b64encode
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from importlib.resources import files
from itertools import groupby
from math import isfinite
from pathlib import Path
from typing import Any

from blesim.report.figure_file import save
from blesim.report.picture_figure import draw
from blesim.reruns.base import Change, Key
from blesim.reruns.run import Rerun
from blesim.reruns.statistics import ChangedFigure, Figure, Ordering
from blesim.whole_file import write_whole

_FIGURE_HEADER = ("table", "row", "column", "simulated", "95 % interval", "published", "ratio")
_ORDERING_HEADER = (
    "less",
    "than",
    "condition",
    "published",
    "simulated",
    "95 % interval",
    "p",
    "held",
)
_READING = (
    "Simulated is the mean over the seeds with its 95 % interval, and the ratio is simulated over"
    " published, in brackets where the two do not say the same. A figure agrees within a factor of"
    " 1.5 either way; an ordering holds if the difference has the published sign, and p is of the"
    " paired t test. What does not agree is explained below the tables."
)
_UNCHANGED = "Tables of what is named in quotes, with one thing otherwise, come with --what-if."
_CHANGED = (
    "With one thing otherwise: the mean, and the 95 % interval of the difference that it makes, by"
    " seed."
)
_STYLE = """
body { font-family: sans-serif; margin: 2em auto; max-width: 62em; padding: 0 1em; color: #222; }
table { border-collapse: collapse; margin: 1em 0; font-size: 0.9em; }
th, td { padding: 0.25em 0.7em; border-bottom: 1px solid #ddd; text-align: left; }
td.number { text-align: right; font-variant-numeric: tabular-nums; }
tr.off td { background: #fbeee6; }
img { max-width: 100%; margin: 0.5em 0 1.5em; }
"""


def write_reruns(reruns: Sequence[Rerun], folder: Path) -> None:
    """Write ``reruns.json``, ``reruns.md``, ``index.html`` and the pictures into a folder.

    Raises
    ------
    UsageError, DataError
        If they cannot be written.
    """
    pictures = {rerun.experiment.paper: list(_saved_pictures(rerun, folder)) for rerun in reruns}
    told = json.dumps(as_dict(reruns), indent=2, allow_nan=False) + "\n"
    write_whole(folder / "reruns.json", told.encode())
    write_whole(folder / "reruns.md", "\n".join(_markdown(reruns, pictures)).encode())
    write_whole(folder / "index.html", "\n".join(_page(reruns, pictures)).encode())


def as_dict(reruns: Sequence[Rerun]) -> dict[str, Any]:
    """All numbers for a program: ``figures``, ``orderings``, ``changes``, one flat object each."""
    return {
        "figures": [_figure_dict(figure) for rerun in reruns for figure in rerun.figures],
        "orderings": [_ordering_dict(each) for rerun in reruns for each in rerun.orderings],
        "changes": [
            _changed_dict(rerun.experiment.paper, changed.change, figure)
            for rerun in reruns
            for changed in rerun.changed
            for figure in changed.figures
        ],
    }


def _figure_dict(figure: Figure) -> dict[str, Any]:
    return {
        "paper": figure.paper,
        **figure.key._asdict(),
        "simulated": _finite(figure.simulated),
        "low": _finite(figure.low),
        "high": _finite(figure.high),
        "published": figure.published,
        "ratio": figure.ratio,
        "compared": figure.compared,
    }


def _ordering_dict(ordering: Ordering) -> dict[str, Any]:
    return {
        "paper": ordering.paper,
        "better": _name(ordering.better),
        "worse": _name(ordering.worse),
        "condition": ordering.condition,
        "published_difference": ordering.published_difference,
        "simulated_difference": _finite(ordering.simulated_difference),
        "low": _finite(ordering.low),
        "high": _finite(ordering.high),
        "p_value": _finite(ordering.p_value),
        "held": ordering.held,
    }


def _changed_dict(paper: str, change: Change, figure: ChangedFigure) -> dict[str, Any]:
    return {
        "paper": paper,
        "change": change.name,
        "why": change.why,
        **figure.key._asdict(),
        "simulated": _finite(figure.simulated),
        "low": _finite(figure.low),
        "high": _finite(figure.high),
        "difference": _finite(figure.difference),
        "difference_low": _finite(figure.difference_low),
        "difference_high": _finite(figure.difference_high),
    }


def _finite(value: float) -> float | None:
    return value if isfinite(value) else None


def _name(key: Key) -> str:
    return " / ".join(key)


def _saved_pictures(rerun: Rerun, folder: Path) -> Iterator[tuple[str, Path]]:
    """Title and file of each picture."""
    for picture in rerun.pictures:
        path = folder / f"{rerun.experiment.paper}-{picture.name}.png"
        save(draw(picture), path)
        yield picture.title, path


def _figure_cells(figure: Figure) -> list[str]:
    published = "-" if figure.published is None else f"{figure.published:g}"
    ratio = "-" if figure.ratio is None else f"{figure.ratio:.2f}"
    if not figure.compared and figure.published is not None:
        ratio = f"({ratio})"
    spread = _interval(figure.low, figure.high)
    return [*figure.key, _number(figure.simulated), spread, published, ratio]


def _ordering_cells(ordering: Ordering) -> list[str]:
    published = ordering.published_difference
    return [
        _name(ordering.better),
        _name(ordering.worse),
        ordering.condition,
        "-" if published is None else f"{published:+.3g}",
        f"{ordering.simulated_difference:+.3g}",
        _interval(ordering.low, ordering.high),
        _number(ordering.p_value),
        "yes" if ordering.held else "NO",
    ]


def _number(value: float) -> str:
    return f"{value:.3g}" if isfinite(value) else "-"


def _interval(low: float, high: float) -> str:
    return f"{low:.3g} to {high:.3g}" if isfinite(low) and isfinite(high) else "-"


def _changed_tables(rerun: Rerun) -> Iterator[tuple[list[str], list[list[str]]]]:
    """Header and rows of what changed: a table for each set of numbers that changes show."""
    figures = {figure.key: figure for figure in rerun.figures}
    for shown, group in groupby(rerun.changed, key=lambda changed: changed.change.shown):
        header = ["otherwise", "why", *(f"{key.table}: {key.row}, {key.column}" for key in shown)]
        printed = [figures[key].published for key in shown]
        rows = [
            ["published", "", *("-" if value is None else f"{value:g}" for value in printed)],
            ["nothing", "", *(_number(figures[key].simulated) for key in shown)],
        ]
        rows += [
            [changed.change.name, changed.change.why, *map(_changed_cell, changed.figures)]
            for changed in group
        ]
        yield header, rows


def _changed_cell(figure: ChangedFigure) -> str:
    difference = _interval(figure.difference_low, figure.difference_high)
    return f"{_number(figure.simulated)} ({difference})"


def summary(rerun: Rerun) -> str:
    """How many figures agree and how many orderings hold, in one line."""
    agree = [figure.agrees for figure in rerun.figures if figure.agrees is not None]
    held = [ordering.held for ordering in rerun.orderings]
    return (
        f"{sum(agree)} of {len(agree)} figures within a factor 1.5;"
        f" {sum(held)} of {len(held)} orderings hold; {rerun.seeds} seeds"
    )


def _title(rerun: Rerun) -> str:
    return f"{rerun.experiment.paper}: {rerun.experiment.title}"


def _markdown(
    reruns: Sequence[Rerun], pictures: dict[str, list[tuple[str, Path]]]
) -> Iterator[str]:
    yield "# Published experiments, rerun\n"
    yield f"{_READING}\n"
    for rerun in reruns:
        yield f"## {_title(rerun)}\n"
        yield from _compared(rerun)
        for title, path in pictures[rerun.experiment.paper]:
            yield f"![{title}]({path.name})\n"
        yield _why(rerun)
        yield from _otherwise(rerun)


def tables_page(reruns: Sequence[Rerun]) -> str:
    """All tables as Markdown, for the documentation, whose text stands on pages of its own."""
    lines = ["# Published experiments, rerun: all tables\n", f"{_READING}\n"]
    for rerun in reruns:
        page = _page_name(rerun)
        lines += [f"## {_title(rerun)}\n", f"Explained in [{page}]({page}).\n"]
        lines += [*_compared(rerun), *_otherwise(rerun)]
    return "\n".join(lines)


def _compared(rerun: Rerun) -> Iterator[str]:
    yield f"{summary(rerun)}.\n"
    yield from _rows_of(_FIGURE_HEADER, map(_figure_cells, rerun.figures))
    yield from _rows_of(_ORDERING_HEADER, map(_ordering_cells, rerun.orderings))


def _otherwise(rerun: Rerun) -> Iterator[str]:
    yield f"{_CHANGED if rerun.changed else _UNCHANGED}\n"
    for header, rows in _changed_tables(rerun):
        yield from _rows_of(header, rows)


def _rows_of(header: Sequence[str], rows: Iterable[list[str]]) -> Iterator[str]:
    yield f"| {' | '.join(header)} |"
    yield f"|{' --- |' * len(header)}"
    for cells in rows:
        yield f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |"
    yield ""


def _page_name(rerun: Rerun) -> str:
    return f"{rerun.experiment.paper}.md"


def _why(rerun: Rerun) -> str:
    """What the documentation says about where and why ours differs."""
    page = files("blesim") / "docs" / "reruns" / _page_name(rerun)
    return page.read_text(encoding="utf-8") if page.is_file() else ""


def _page(reruns: Sequence[Rerun], pictures: dict[str, list[tuple[str, Path]]]) -> Iterator[str]:
    yield "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'>"
    yield f"<title>Published experiments, rerun</title><style>{_STYLE}</style></head><body>"
    yield "<h1>Published experiments, rerun</h1>"
    yield f"<p>{_READING} Its rows are shaded.</p><ul>"
    for rerun in reruns:
        paper = escape(rerun.experiment.paper)
        yield f"<li><a href='#{paper}'>{paper}</a>: {escape(summary(rerun))}</li>"
    yield "</ul>"
    for rerun in reruns:
        experiment = rerun.experiment
        yield f"<h2 id='{escape(experiment.paper)}'>{escape(_title(rerun))}</h2>"
        yield f"<p>{escape(summary(rerun))}.</p>"
        off = [figure.agrees is False for figure in rerun.figures]
        yield _html_table(_FIGURE_HEADER, [_figure_cells(f) for f in rerun.figures], off)
        off = [not ordering.held for ordering in rerun.orderings]
        yield _html_table(_ORDERING_HEADER, [_ordering_cells(o) for o in rerun.orderings], off)
        for title, path in pictures[experiment.paper]:
            image = b64encode(path.read_bytes()).decode()
            yield f"<img alt='{escape(title, quote=True)}' src='data:image/png;base64,{image}'>"
        yield from map(_html_paragraph, _why(rerun).split("\n\n"))
        yield f"<p>{_CHANGED if rerun.changed else _UNCHANGED}</p>"
        for header, rows in _changed_tables(rerun):
            yield _html_table(header, rows, [False] * len(rows))
    yield "</body></html>\n"


def _html_paragraph(text: str) -> str:
    """A paragraph or a heading of the documentation."""
    heading = text.strip().removeprefix("### ")
    if heading != text.strip():
        return f"<h3>{escape(heading)}</h3>"
    return f"<p>{escape(heading)}</p>" if heading else ""


def _html_table(header: Sequence[str], rows: Sequence[list[str]], off: Sequence[bool]) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in header)
    body = [
        f"<tr{' class=off' if is_off else ''}>{''.join(map(_html_cell, cells))}</tr>"
        for cells, is_off in zip(rows, off, strict=True)
    ]
    return f"<table><tr>{head}</tr>{''.join(body)}</table>"


def _html_cell(cell: str) -> str:
    number = cell[:1].isdigit() or cell[:1] in "+-("
    return f"<td{' class=number' if number else ''}>{escape(cell)}</td>"
