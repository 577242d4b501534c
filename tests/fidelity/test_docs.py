"""The score tables of the docs are what the command prints; run this file to write them anew."""

import re
from pathlib import Path

import pytest

import blesim
from blesim.fidelity.datasets import DATASETS
from blesim.fidelity.scorecard import Score, inside_count

PAGE = Path(blesim.__file__).parent / "docs" / "fidelity.md"
HEADER = ("statistic", "unit", "real", "5 %", "95 %", "simulated", "")


def table(scores: tuple[Score, ...]) -> str:
    rows = [HEADER, ("---",) * len(HEADER), *(score.cells() for score in scores)]
    lines = [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join([*lines, "", f"{inside_count(scores)} of {len(scores)} inside."])


def between(name: str) -> re.Pattern[str]:
    return re.compile(rf"(?<=<!-- {name} -->\n\n).*?(?=\n\n<!-- end -->)", re.DOTALL)


@pytest.mark.parametrize("name", DATASETS)
def test_the_page_holds_what_the_command_prints(name, data_dir):
    found = between(name).search(PAGE.read_text(encoding="utf-8"))
    assert found is not None
    assert found[0] == table(DATASETS[name](data_dir(name), None, 1).scores)


if __name__ == "__main__":
    text = PAGE.read_text(encoding="utf-8")
    data = Path(blesim.__file__).resolve().parents[2] / "shared" / "data"
    for each in DATASETS:
        text = between(each).sub(table(DATASETS[each](data / each, None, 1).scores), text)
    PAGE.write_text(text, encoding="utf-8")
