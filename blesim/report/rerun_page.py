"""Reruns as files: JSON for programs, Markdown, and one self-contained page with all pictures."""

import json
from base64 import b64encode
from collections.abc import Iterator, Sequence
from html import escape
from importlib.resources import files
from math import isfinite
from pathlib import Path
from typing import Any

from blesim.report.figure_file import save
from blesim.report.picture_figure import draw
from blesim.reruns.base import Key
from blesim.reruns.run import Rerun
from blesim.reruns.statistics import Figure, Ordering
from blesim.whole_file import write_whole

_FIGURE_HEADER = ("table", "row", "column", "simulated", "95 % interval", "published", "ratio")
_ORDERING_HEADER = ("less", "than", "condition", "published", "simulated", "95 % interval", "held")
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
    """All numbers for a program: ``figures`` and ``orderings``, one flat object each."""
    return {
        "figures": [_figure_dict(figure) for rerun in reruns for figure in rerun.figures],
        "orderings": [_ordering_dict(each) for rerun in reruns for each in rerun.orderings],
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
        "yes" if ordering.held else "NO",
    ]


def _number(value: float) -> str:
    return f"{value:.3g}" if isfinite(value) else "-"


def _interval(low: float, high: float) -> str:
    return f"{low:.3g} to {high:.3g}" if isfinite(low) and isfinite(high) else "-"


def summary(rerun: Rerun) -> str:
    """How many figures agree and how many orderings hold, in one line."""
    agree = [figure.agrees for figure in rerun.figures if figure.agrees is not None]
    held = [ordering.held for ordering in rerun.orderings]
    return (
        f"{sum(agree)} of {len(agree)} figures within a factor 1.5;"
        f" {sum(held)} of {len(held)} orderings hold; {rerun.seeds} seeds"
    )


def _markdown(
    reruns: Sequence[Rerun], pictures: dict[str, list[tuple[str, Path]]]
) -> Iterator[str]:
    yield "# Published experiments, rerun\n"
    for rerun in reruns:
        yield f"## {rerun.experiment.paper}: {rerun.experiment.title}\n"
        yield f"{summary(rerun)}.\n"
        yield from _rows_of(_FIGURE_HEADER, map(_figure_cells, rerun.figures))
        yield from _rows_of(_ORDERING_HEADER, map(_ordering_cells, rerun.orderings))
        for title, path in pictures[rerun.experiment.paper]:
            yield f"![{title}]({path.name})\n"
        yield _why(rerun)


def _rows_of(header: Sequence[str], rows: Iterator[list[str]] | Any) -> Iterator[str]:
    yield f"| {' | '.join(header)} |"
    yield f"|{' --- |' * len(header)}"
    for cells in rows:
        yield f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |"
    yield ""


def _why(rerun: Rerun) -> str:
    """What the documentation says about where and why ours differs."""
    page = files("blesim") / "docs" / "reruns" / f"{rerun.experiment.paper}.md"
    return page.read_text(encoding="utf-8") if page.is_file() else ""


def _page(reruns: Sequence[Rerun], pictures: dict[str, list[tuple[str, Path]]]) -> Iterator[str]:
    yield "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'>"
    yield f"<title>Published experiments, rerun</title><style>{_STYLE}</style></head><body>"
    yield "<h1>Published experiments, rerun</h1>"
    for rerun in reruns:
        experiment = rerun.experiment
        yield f"<h2>{escape(experiment.paper)}: {escape(experiment.title)}</h2>"
        yield f"<p>{escape(summary(rerun))}.</p>"
        off = [figure.agrees is False for figure in rerun.figures]
        yield _html_table(_FIGURE_HEADER, [_figure_cells(f) for f in rerun.figures], off)
        off = [not ordering.held for ordering in rerun.orderings]
        yield _html_table(_ORDERING_HEADER, [_ordering_cells(o) for o in rerun.orderings], off)
        for title, path in pictures[experiment.paper]:
            image = b64encode(path.read_bytes()).decode()
            yield f"<img alt='{escape(title, quote=True)}' src='data:image/png;base64,{image}'>"
        for paragraph in _why(rerun).split("\n\n"):
            yield f"<p>{escape(paragraph)}</p>" if paragraph.strip() else ""
    yield "</body></html>\n"


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
