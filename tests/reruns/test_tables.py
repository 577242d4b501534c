"""The tables of the reruns in the documentation; run this file with a folder to write them.

``blesim rerun all --what-if --seeds 20 -o FOLDER`` makes the folder.
"""

import sys
from pathlib import Path

import pytest

import blesim
from blesim.report.rerun_page import tables_page
from blesim.reruns.registry import PAPERS, changes_of, experiment_of
from blesim.reruns.run import summarised, version_text
from blesim.reruns.trials_on_disk import TrialStore

PAGE = Path(blesim.__file__).parent / "docs" / "reruns" / "tables.md"
SEEDS = 20


@pytest.fixture(scope="module")
def sections():
    titles = {f"## {paper}: {experiment_of(paper).title}": paper for paper in PAPERS}
    found, paper = {each: [] for each in PAPERS}, None
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        paper = titles.get(line, paper)
        if paper is not None:
            found[paper].append(line)
    return found


@pytest.mark.parametrize("paper", PAPERS)
def test_the_tables_are_those_of_the_experiment(sections, paper):
    rows = [line.strip("| ").split(" | ") for line in sections[paper] if line.startswith("| ")]
    experiment = experiment_of(paper)
    told = {tuple(row[:3]) for row in rows}
    for each in experiment.published:
        assert tuple(part.replace("|", "/") for part in each.key) in told, each.key
    for each in experiment.expected:
        better, worse = (" / ".join(key) for key in (each.better, each.worse))
        assert (better, worse, each.condition) in told
    named = {tuple(row[:2]) for row in rows}
    for change in changes_of(paper):
        assert (change.name, change.why) in named


def write(folder):
    store = TrialStore(folder=folder, version=version_text())
    reruns = [summarised(each, SEEDS, store, pictures=False, what_if=True) for each in PAPERS]
    PAGE.write_text(tables_page(reruns), encoding="utf-8")


if __name__ == "__main__":
    write(Path(sys.argv[1]))
