"""`blesim validate`: whether a recording is whole and consistent."""

from pathlib import Path
from typing import Annotated

import typer

from blesim.cli.console import answer, answer_json


def validate(
    recording: Annotated[Path, typer.Argument(help="Recording (HDF5).")],
    as_json: Annotated[bool, typer.Option("--json", help="Print a JSON list of faults.")] = False,
) -> None:
    """Check every column of a recording against the schema, and the streams against each other.

    Exit code 1 if there is a fault.
    """
    from blesim.dataset.validator import validate as faults_of

    faults = faults_of(recording)
    if as_json:
        answer_json(faults)
    else:
        answer("\n".join(faults) or f"{recording}: valid")
    if faults:
        raise typer.Exit(1)
