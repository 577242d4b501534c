"""`blesim schema`: what a scenario may say, or what a recording holds."""

from typing import Annotated

import typer

from blesim.cli.console import answer, answer_json


def schema(
    recording: Annotated[
        bool, typer.Option("--recording", help="The recording file's columns, as Markdown.")
    ] = False,
) -> None:
    """Print the JSON Schema of scenario files, for editors that check while one types."""
    if recording:
        from blesim.dataset.schema_page import schema_page

        answer(schema_page().rstrip("\n"))
        return
    from blesim.scenario.model import Scenario

    answer_json(
        {"$schema": "https://json-schema.org/draft/2020-12/schema"} | Scenario.model_json_schema()
    )
