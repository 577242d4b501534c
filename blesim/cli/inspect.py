"""`blesim inspect`: what is in a recording."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from blesim.cli.console import answer, answer_json, answer_table, say
from blesim.cli.output import output_path

if TYPE_CHECKING:
    from blesim.recording import Crowd, Recording


def inspect(
    recording: Annotated[Path, typer.Argument(help="Recording (HDF5).")],
    as_json: Annotated[bool, typer.Option("--json", help="Print a JSON object.")] = False,
    plot: Annotated[
        Path | None,
        typer.Option(
            help="Draw the people over the day and their presence by section, or the recorded walks"
            " where nobody else is known (.png, .svg, .pdf)."
        ),
    ] = None,
) -> None:
    """Show where a recording comes from, its venue, the people in it and its walks."""
    from blesim.dataset.reader import read_crowd, read_recording
    from blesim.dataset.tracks import sha256_of

    if plot is not None:
        from blesim.report.figure_file import refuse_unknown_format

        refuse_unknown_format(plot)
    opened = read_recording(recording)
    found = _contents(opened, sha256_of(recording)) | {"crowd": _people(read_crowd(recording))}
    if plot is not None:
        _draw(recording, plot)
        say(f"{plot}: drawn")
    found["walks"] = _walks(opened)
    if as_json:
        answer_json(found)
    else:
        _tell(found)


def _contents(opened: "Recording", sha256: str) -> dict[str, Any]:
    provenance, venue = opened.provenance, opened.venue
    return {
        "title": provenance.title,
        "source": provenance.source,
        "license": provenance.license,
        "seed": provenance.seed,
        "sha256": sha256,
        "venue": venue.name,
        "beacons": len(venue.beacons),
        "obstacles": len(venue.floor_plan.obstacles),
        "aisles": list(venue.graph.branches) if venue.graph is not None else [],
    }


def _people(crowd: "Crowd") -> dict[str, Any] | None:
    """Figures of the people in the venue; none where only the recorded walks are known."""
    from blesim.metrics.presence import most_present
    from blesim.recording import Role

    if not crowd.people:
        return None
    most, time_us = most_present(crowd)
    roles = {"shoppers": Role.SHOPPER, "staff": Role.STAFF, "testers": Role.TESTER}
    return {
        **{
            name: sum(person.role == role for person in crowd.people)
            for name, role in roles.items()
        },
        "most_present": most,
        "most_present_s": None if time_us is None else time_us * 1e-6,
        "stops": len(crowd.visits),
        "dwell_h": float(crowd.visits.dwell_us.sum()) / 3.6e9,
    }


def _walks(opened: "Recording") -> list[dict[str, Any]]:
    return [
        {
            "walk": walk.name,
            "kind": walk.kind.name.lower(),
            "phone": walk.phone,
            **{table.STREAM.name: len(table) for table in walk.observations.tables()},
        }
        for walk in opened.walks
    ]


def _tell(found: dict[str, Any]) -> None:
    walks, crowd = found.pop("walks"), found.pop("crowd")
    if crowd is not None:
        found |= _crowd_in_words(crowd)
    for key, value in found.items():
        answer(f"{key:>10}  {', '.join(value) if isinstance(value, list) else value}")
    answer_table(
        "Walks",
        list(walks[0]) if walks else ["walk"],
        [[str(v) for v in w.values()] for w in walks],
    )


def _crowd_in_words(crowd: dict[str, Any]) -> dict[str, str]:
    counts = ", ".join(f"{crowd[name]} {name}" for name in ("shoppers", "staff", "testers"))
    since = "" if crowd["most_present_s"] is None else f", {_since(crowd['most_present_s'])}"
    return {
        "people": f"{counts}; at most {crowd['most_present']} at once{since}",
        "stops": f"{crowd['stops']} at product sections, {crowd['dwell_h']:.1f} h in all",
    }


def _since(time_s: float) -> str:
    return f"{abs(time_s) / 3600:.2f} h {'after' if time_s >= 0 else 'before'} opening"


def _draw(recording: Path, plot: Path) -> None:
    from blesim.dataset.reader import read_truth
    from blesim.errors import DataError
    from blesim.report.day_figure import draw_day, draw_walks
    from blesim.report.figure_file import save

    truth = read_truth(recording)
    known = {name: walk.trajectory for name, walk in truth.walks.items() if len(walk.trajectory)}
    if not truth.crowd.people and not known:
        raise DataError(f"{recording}: holds nobody's trajectory; there is nothing to draw")
    figure = (
        draw_day(truth.venue, truth.crowd) if truth.crowd.people else draw_walks(truth.venue, known)
    )
    save(figure, output_path(plot, ""))
