"""`blesim simulate`: a scenario becomes a recording."""

from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from blesim.cli.console import day_progress, progress, say
from blesim.cli.output import output_path

if TYPE_CHECKING:
    from blesim.recording import Walk
    from blesim.venue.venue import Venue


def simulate(
    scenario: Annotated[Path, typer.Argument(help="Scenario file (YAML).")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Recording (default: output/NAME.h5).")
    ] = None,
    seed: Annotated[
        int | None, typer.Option(help="Seed of all random numbers; overrides the scenario's.")
    ] = None,
    jobs: Annotated[
        int, typer.Option(min=1, help="Processes; the file is the same for any number.")
    ] = 1,
) -> None:
    """Simulate a scenario: who walks where, and what their phones record.

    The same scenario and seed give the same bytes.
    """
    from blesim.dataset.writer import RecordingWriter
    from blesim.scenario.reading import read_scenario
    from blesim.simulate import Simulation

    with day_progress() as told:
        simulation = Simulation.run(read_scenario(scenario), seed, told)
    target = output_path(output, f"{scenario.stem}.h5")
    heard, silent = 0, {beacon.id for beacon in simulation.stage.surveyed.beacons}
    file = RecordingWriter(
        target,
        venue_surveyed=simulation.stage.surveyed,
        venue_built=simulation.stage.built,
        provenance=simulation.provenance,
        beacon_events=simulation.lives.log,
        crowd=simulation.crowd,
    )
    with closing(simulation.walks(jobs)) as walks, file as writer:
        for walk, truth in progress(walks, len(simulation.carriers), "walk"):
            writer.append(walk, truth)
            heard += len(walk.observations.readings)
            silent -= _beacons_heard(walk, simulation.stage.surveyed)
            if not len(walk.observations.readings):
                say(f"walk '{walk.name}' heard no beacon at all")
    if silent:
        say(f"nobody heard {len(silent)} of the beacons: {', '.join(sorted(silent))}")
    say(f"{target}: {len(simulation.carriers)} walks, {heard} readings, seed {simulation.seed}")


def _beacons_heard(walk: "Walk", venue: "Venue") -> set[str]:
    rows = set(walk.observations.readings.beacon.tolist())
    return {venue.beacons[row].id for row in rows}
