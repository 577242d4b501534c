"""`blesim score`: tracks against the truth."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from blesim.cli.console import answer_json, answer_table, say
from blesim.cli.output import output_path

if TYPE_CHECKING:
    from blesim.metrics.score import Tracks
    from blesim.recording import Recording, Truth

_HEADER = ("estimator", "walk", "n", "mean", "std", "rmse", "median", "75 %", "90 %", "CE95", "max")
_FIGURES = ("mean_m", "std_m", "rmse_m", "median_m", "p75_m", "p90_m", "ce95_m", "max_m")


def score(
    recording: Annotated[Path, typer.Argument(help="Recording (HDF5), with its truth.")],
    tracks: Annotated[Path, typer.Argument(help="Tracks made from it (HDF5).")],
    as_json: Annotated[bool, typer.Option("--json", help="Print a JSON list of rows.")] = False,
    plot: Annotated[
        Path | None,
        typer.Option(help="Draw floor plan, tracks and error distribution (.png, .svg, .pdf)."),
    ] = None,
    plot_walk: Annotated[
        str | None, typer.Option(help="Walk to draw over the plan (default: the first).")
    ] = None,
) -> None:
    """Print the error table: position error in metres after every reading, walk by walk.

    Exit code 1 if an estimator has no track of a walk.
    """
    from blesim.dataset.reader import read_recording, read_truth
    from blesim.dataset.tracks import read_tracks, sha256_of
    from blesim.errors import DataError
    from blesim.metrics.score import score as score_tracks

    # A damaged recording has another digest as well; that it is damaged is the better news.
    observed, truth = read_recording(recording), read_truth(recording)
    found = read_tracks(tracks)
    if found.recording_sha256 != sha256_of(recording):
        raise DataError(f"{tracks}: made from another recording than {recording}; estimate again")
    drawn = None if plot is None else _to_draw(observed, plot, plot_walk)
    rows = score_tracks(observed, truth, found.runs)
    if plot is not None and drawn is not None:
        _draw(observed, truth, found.runs, drawn, output_path(plot, ""))
        say(f"{plot}: drawn")
    if as_json:
        answer_json([row.as_dict() for row in rows])
    else:
        answer_table(
            "Position error [m]", (*_HEADER, "wrong aisle"), [_cells(r.as_dict()) for r in rows]
        )
    for row in rows:
        if row.summary.unmatched:
            say(
                f"{row.estimator}, {row.walk}: {row.summary.unmatched} readings before the first"
                " estimate are not in the table"
            )
        if row.failure is not None:
            say(f"{row.estimator}, {row.walk}: {row.failure}")
    if any(row.failure is not None for row in rows):
        raise typer.Exit(1)


def _cells(row: dict[str, Any]) -> list[str]:
    figures = ["-" if row[key] is None else f"{row[key]:.2f}" for key in _FIGURES]
    wrong = row["wrong_aisle"]
    share = "-" if wrong is None else f"{100 * wrong:.1f} %"
    return [row["estimator"], row["walk"], str(row["n"]), *figures, share]


def _to_draw(recording: "Recording", plot: Path, walk_name: str | None) -> str:
    """Name of the walk to draw; what cannot be drawn is refused before the work."""
    from blesim.errors import DataError, UsageError
    from blesim.metrics.score import scored_walks
    from blesim.report.figure_file import refuse_unknown_format

    refuse_unknown_format(plot)
    names = [walk.name for walk in scored_walks(recording)]
    if not names:
        raise DataError("the recording has no walk to draw, only surveys")
    if walk_name is not None and walk_name not in names:
        raise UsageError(f"no walk '{walk_name}' to draw; there is {', '.join(names)}")
    return names[0] if walk_name is None else walk_name


def _draw(recording: "Recording", truth: "Truth", runs: "Tracks", name: str, plot: Path) -> None:
    from blesim.metrics.position_error import pooled
    from blesim.metrics.score import scored_walks, track_errors
    from blesim.report.figure_file import save
    from blesim.report.track_figure import draw_tracks
    from blesim.tables import Track

    labels = dict.fromkeys(label for label, _ in runs)
    results = {key: run for key, run in runs.items() if isinstance(run, Track)}
    errors = {
        label: pooled(
            [
                track_errors(recording, truth, walk, results[label, walk.name])
                for walk in scored_walks(recording)
                if (label, walk.name) in results
            ]
        ).error_m
        for label in labels
    }
    drawn = {label: results[label, name] for label in labels if (label, name) in results}
    save(draw_tracks(truth.venue, name, truth.walks[name].trajectory, drawn, errors), plot)
