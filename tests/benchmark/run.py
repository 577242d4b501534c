"""The benchmark of `make bench`: a table on the terminal, and output/bench.json.

A missed goal is reported and is no failure; a row that crashes is.
"""

import argparse
import json
import sys
import traceback
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from measure import Result, Row
from rich.console import Console
from rich.table import Table

# Files beside this one, each with a list ROWS; the slow imports of one do not disturb another.
FILES = (
    "start_up",
    "line_of_sight",
    "recording_file",
    "radio",
    "filters",
    "imu",
    "trading_day",
    "graph_filter",
    "live_estimators",
)
OUTPUT = Path(__file__).resolve().parents[2] / "output" / "bench.json"


def all_rows() -> list[Row]:
    """Return the rows of all files in order."""
    return [row for name in FILES for row in import_module(name).ROWS]


def chosen(rows: Sequence[Row], only: str | None) -> list[Row]:
    """Return the rows whose names contain the text, all of them without it."""
    found = [row for row in rows if only is None or only in row.name]
    if not found:
        names = ", ".join(f"'{row.name}'" for row in rows)
        sys.exit(f"bench: no row is called '{only}'; there are {names}")
    return found


def measured(rows: Sequence[Row], console: Console) -> list[Result]:
    """Return the results of the rows that did not crash; of the others, show what happened."""
    results = []
    for row in rows:
        try:
            with console.status(row.name):
                results.append(row.result())
        except Exception:  # whatever one row does wrong, the others are still of interest
            console.print(f"[red]{row.name} crashed[/red]")
            console.print(traceback.format_exc(), markup=False)
    return results


def table_of(results: Sequence[Result]) -> Table:
    """Return the results as a table for the terminal."""
    table = Table("name", "value", "unit", "goal", "met")
    table.columns[1].justify = "right"
    words = {True: "[green]yes[/green]", False: "[red]no[/red]", None: ""}
    for result in results:
        value = f"{result.value:.3g}" if result.value < 1000 else f"{result.value:.0f}"
        table.add_row(result.name, value, result.unit, result.goal or "", words[result.met])
    return table


def run(rows: Sequence[Row], output: Path, console: Console) -> int:
    """Measure, print and write; return the exit code."""
    results = measured(rows, console)
    console.print(table_of(results))
    output.parent.mkdir(parents=True, exist_ok=True)
    entries = [result.as_json() for result in results]
    output.write_text(json.dumps(entries, indent=2) + "\n", encoding="utf-8")
    return 0 if len(results) == len(rows) else 1


def main() -> int:
    """Run the benchmark as the command line says."""
    parser = argparse.ArgumentParser(description="Measure blesim against its goals.")
    parser.add_argument("--only", metavar="NAME", help="rows whose name contains this")
    parser.add_argument("--output", type=Path, default=OUTPUT, metavar="FILE")
    options = parser.parse_args()
    return run(chosen(all_rows(), options.only), options.output, Console())


if __name__ == "__main__":
    sys.exit(main())
