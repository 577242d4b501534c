"""`blesim import`: a real recording comes in through the same door as a simulated one."""

from pathlib import Path
from typing import Annotated

import typer

from blesim.cli.console import say
from blesim.cli.output import output_path


def import_(
    source_format: Annotated[str, typer.Argument(metavar="FORMAT", help="Such as philotuxo.")],
    source: Annotated[Path, typer.Argument(metavar="PATH", help="File or folder to read.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Recording (default: output/FORMAT.h5).")
    ] = None,
) -> None:
    """Turn somebody else's recording into one of ours."""
    from blesim.dataset.exchange import IMPORTERS
    from blesim.dataset.writer import write_recording
    from blesim.errors import UsageError

    if source_format not in IMPORTERS:
        known = ", ".join(sorted(IMPORTERS))
        raise UsageError(f"unknown format '{source_format}'; known are {known}")
    imported = IMPORTERS[source_format](source)
    target = output_path(output, f"{source_format}.h5")
    write_recording(target, imported.recording, imported.truth)
    readings = sum(len(walk.observations.readings) for walk in imported.recording.walks)
    say(f"{target}: {len(imported.recording.walks)} walks, {readings} readings")
    for line in imported.report:
        say(line)
