"""`blesim estimate`: a recording becomes tracks."""

import os
from contextlib import closing
from pathlib import Path
from typing import Annotated

import typer

from blesim.cli.console import progress, say
from blesim.cli.output import output_path


def estimate(
    recording: Annotated[Path, typer.Argument(help="Recording (HDF5).")],
    estimator: Annotated[
        list[str],
        typer.Option("-e", "--estimator", help="NAME or NAME:key=value,...; may be repeated."),
    ],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Tracks (default: output/NAME-tracks.h5)."),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(help="Seed of estimators that draw (default: from the recording's digest)."),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(min=1, help="Processes; the tracks are the same (default: as many as fit)."),
    ] = None,
) -> None:
    """Position the walks of a recording with one or more estimators.

    Exit code 1 if an estimator failed on a walk; the others are written all the same.
    """
    from blesim.dataset.reader import read_recording
    from blesim.dataset.tracks import TrackSet, sha256_of, write_tracks
    from blesim.errors import UsageError
    from blesim.estimators.registry import make_estimator
    from blesim.estimators.trials import Trials
    from blesim.recording import Failure

    made = dict(make_estimator(text) for text in estimator)
    if len(made) < len(estimator):
        raise UsageError("the same estimator with the same settings is named twice")
    opened = read_recording(recording)
    digest = sha256_of(recording)
    chosen_seed = int(digest[:16], 16) if seed is None else seed
    trials = Trials(estimators=made, recording=opened, seed=chosen_seed)
    with closing(trials.results(jobs or _jobs(len(made)))) as results:
        runs = dict(progress(results, len(trials), "track"))
    target = output_path(output, f"{recording.stem}-tracks.h5")
    write_tracks(target, TrackSet(recording_sha256=digest, runs=runs))
    failures = {key: run for key, run in runs.items() if isinstance(run, Failure)}
    for (label, name), failure in failures.items():
        say(f"{label} failed on walk '{name}': {failure.reason}")
    say(f"{target}: {len(runs) - len(failures)} tracks")
    if failures:
        raise typer.Exit(1)


def _jobs(estimators: int) -> int:
    """As many processes as there are estimators to try and processors to try them on."""
    return max(1, min(estimators, os.cpu_count() or 1))
