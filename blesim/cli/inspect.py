"""`blesim inspect`: what is in a recording."""

from pathlib import Path
from typing import Annotated, Any

import typer

from blesim.cli.console import answer, answer_json, answer_table


def inspect(
    recording: Annotated[Path, typer.Argument(help="Recording (HDF5).")],
    as_json: Annotated[bool, typer.Option("--json", help="Print a JSON object.")] = False,
) -> None:
    """Show where a recording comes from, its venue and its walks."""
    from blesim.dataset.reader import read_recording
    from blesim.dataset.tracks import sha256_of
    from blesim.recording import Recording

    def contents(opened: Recording) -> dict[str, Any]:
        provenance, venue = opened.provenance, opened.venue
        return {
            "title": provenance.title,
            "source": provenance.source,
            "license": provenance.license,
            "seed": provenance.seed,
            "sha256": sha256_of(recording),
            "venue": venue.name,
            "beacons": len(venue.beacons),
            "obstacles": len(venue.floor_plan.obstacles),
            "aisles": list(venue.graph.branches) if venue.graph is not None else [],
            "walks": [
                {
                    "walk": walk.name,
                    "kind": walk.kind.name.lower(),
                    "phone": walk.phone,
                    **{table.STREAM.name: len(table) for table in walk.observations.tables()},
                }
                for walk in opened.walks
            ],
        }

    found = contents(read_recording(recording))
    if as_json:
        answer_json(found)
        return
    walks = found.pop("walks")
    for key, value in found.items():
        answer(f"{key:>10}  {', '.join(value) if isinstance(value, list) else value}")
    answer_table(
        "Walks",
        list(walks[0]) if walks else ["walk"],
        [[str(v) for v in w.values()] for w in walks],
    )
