"""`blesim rerun`: published experiments, side by side with ours."""

import os
from contextlib import closing
from pathlib import Path
from typing import Annotated

import typer

from blesim.cli.console import answer_json, answer_table, progress, say
from blesim.cli.output import output_path


def rerun(
    paper: Annotated[
        str,
        typer.Argument(
            help="aisle-graph, pdr-fingerprint, map-ekf, channel-ekf, proximity-pf, or all."
        ),
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder (default: output/reruns).")
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="How many seeds.")] = 20,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Processes (default: one a processor).")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a dask scheduler that shares the work instead.")
    ] = None,
    what_if: Annotated[
        bool,
        typer.Option(
            "--what-if", help="Also with one thing changed at a time, to see what hangs on it."
        ),
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the numbers as JSON.")] = False,
) -> None:
    """Rerun published experiments; resumes where it stopped.

    Writes into the folder: `reruns.json`, `reruns.md`, `index.html` and the pictures, of the papers
    asked for this time; trials done before are kept.
    """
    from blesim.report.rerun_page import as_dict, write_reruns
    from blesim.reruns.registry import PAPERS
    from blesim.reruns.run import summarised, tasks_of, trials, version_text
    from blesim.reruns.trials_on_disk import TrialStore

    papers = PAPERS if paper == "all" else (paper,)
    tasks = tasks_of(papers, seeds, what_if=what_if)
    folder = output_path((output or Path("output", "reruns")) / "reruns.json", "").parent
    store = TrialStore(folder=folder, version=version_text())
    done = trials(tasks, store, jobs or os.cpu_count() or 1, scheduler)
    with closing(done):
        for _ in progress(done, len(tasks), "trial"):
            pass
    reruns = [summarised(each, seeds, store, what_if=what_if) for each in papers]
    write_reruns(reruns, folder)
    if as_json:
        answer_json(as_dict(reruns))
        return
    answer_table(
        "Published experiments, rerun",
        ("paper", "figures within a factor 1.5", "orderings that hold"),
        [
            (
                each.experiment.paper,
                _share([figure.agrees for figure in each.figures]),
                _share([ordering.held for ordering in each.orderings]),
            )
            for each in reruns
        ],
    )
    say(f"{folder / 'index.html'}: written")


def _share(held: list[bool | None]) -> str:
    told = [each for each in held if each is not None]
    return f"{sum(told)} of {len(told)}"
