"""`blesim estimators`: which estimators are installed, what they need, what can be set."""

from dataclasses import asdict
from typing import Annotated

import typer

from blesim.cli.console import answer, answer_json


def estimators(
    as_json: Annotated[bool, typer.Option("--json", help="Print a JSON list.")] = False,
) -> None:
    """List the installed estimators with what they need and what can be set."""
    from blesim.estimators.registry import describe, estimator_names

    described = [describe(name) for name in estimator_names()]
    if as_json:
        answer_json([asdict(each) for each in described])
        return
    for each in described:
        answer(f"{each.name}: {each.fault or each.summary}")
        if each.fault is None:
            answer(f"    needs {', '.join(each.needs) or 'RSSI readings alone'}")
        for parameter in each.parameters:
            answer(f"    {parameter.name}={parameter.default}  ({parameter.type})")
