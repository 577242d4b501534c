"""`blesim fidelity`: the scorecard of a simulated recording against a real one."""

from pathlib import Path
from typing import Annotated

import typer

from blesim.cli.console import answer, answer_json, answer_table, say


def fidelity(
    dataset: Annotated[
        str,
        typer.Argument(
            metavar="DATASET",
            help="philotuxo, mitll_static or uji_library (radio); oxford_steps or ilc20 (sensors).",
        ),
    ],
    source: Annotated[Path, typer.Argument(metavar="PATH", help="Folder of the data set.")],
    scenario: Annotated[
        Path | None,
        typer.Option(help="Simulate with the radio section of this scenario, not with the preset."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="For a program.")] = False,
    plot: Annotated[Path | None, typer.Option(help="Picture (.png, .svg or .pdf).")] = None,
    seed: Annotated[int, typer.Option(help="Seed of the simulation.")] = 1,
) -> None:
    """Compare a real recording with its simulated twin, statistic by statistic."""
    from blesim.errors import UsageError
    from blesim.fidelity.datasets import DATASETS
    from blesim.fidelity.scorecard import inside_count
    from blesim.rng import refuse_bad_seed
    from blesim.scenario.reading import read_scenario

    if dataset not in DATASETS:
        raise UsageError(f"unknown data set '{dataset}'; known are {', '.join(sorted(DATASETS))}")
    refuse_bad_seed(seed)
    radio = None if scenario is None else read_scenario(scenario).scenario.radio
    comparison = DATASETS[dataset](source, radio, seed)
    if plot is not None:
        from blesim.report.fidelity_figure import draw_comparison
        from blesim.report.figure_file import save

        save(draw_comparison(comparison), plot)
        say(f"{plot}: {len(comparison.panels)} panels")
    scores = comparison.scores
    if as_json:
        answer_json([score.as_dict() for score in scores])
        return
    answer_table(
        comparison.title,
        ("statistic", "unit", "real", "5 %", "95 %", "simulated", ""),
        (score.cells() for score in scores),
    )
    answer(f"{inside_count(scores)} of {len(scores)} inside")
