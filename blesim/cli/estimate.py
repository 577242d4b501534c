"""`blesim estimate`: a recording becomes tracks."""

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
        typer.Option("-o", "--output", help="Tracks [default: output/NAME-tracks.h5]."),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(help="Seed of estimators that draw [default: from the recording's digest]."),
    ] = None,
) -> None:
    """Position the walks of a recording with one or more estimators.

    Exit code 1 if an estimator failed on a walk; the others are written all the same.
    """
    from blesim.dataset.reader import read_recording
    from blesim.dataset.tracks import TrackSet, sha256_of, write_tracks
    from blesim.errors import UsageError
    from blesim.estimators.registry import make_estimator
    from blesim.estimators.run import fit, follow, refuse_missing
    from blesim.recording import Failure, WalkKind

    made = dict(make_estimator(text) for text in estimator)
    if len(made) < len(estimator):
        raise UsageError("the same estimator with the same settings is named twice")
    opened = read_recording(recording)
    walks = [walk for walk in opened.walks if walk.kind == WalkKind.WALK]
    for label, each in made.items():
        for walk in walks:
            refuse_missing(each, opened, walk, label)
    digest = sha256_of(recording)
    chosen_seed = int(digest[:16], 16) if seed is None else seed
    runs = {}
    for label, each in made.items():
        fitted = fit(each, opened)
        for walk in progress(walks, len(walks), label):
            result = (
                fitted
                if isinstance(fitted, Failure)
                else follow(fitted, opened.venue, walk, seed=chosen_seed, label=label)
            )
            runs[label, walk.name] = result
    target = output_path(output, f"{recording.stem}-tracks.h5")
    write_tracks(target, TrackSet(recording_sha256=digest, runs=runs))
    failures = {key: run for key, run in runs.items() if isinstance(run, Failure)}
    for (label, name), failure in failures.items():
        say(f"{label} failed on walk '{name}': {failure.reason}")
    say(f"{target}: {len(runs) - len(failures)} tracks")
    if failures:
        raise typer.Exit(1)
