"""What the README shows is what a reader gets."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
COMMAND = [sys.executable, "-c", "from blesim.cli import main; main()"]


def blocks(language=""):
    """Fenced blocks of a language."""
    found = re.findall(r"^```(\w*)\n(.*?)^```$", README, re.S | re.M)
    return [text for name, text in found if name == language]


def run(arguments, cwd):
    ended = subprocess.run(
        [*COMMAND, *arguments], cwd=cwd, capture_output=True, text=True, check=True
    )
    return ended.stdout


@pytest.fixture(scope="module")
def ten_lines(tmp_path_factory):
    """The scenario of the README, simulated, positioned and scored as the README says."""
    folder = tmp_path_factory.mktemp("readme")
    (text,) = blocks("yaml")
    (folder / "store.yaml").write_text(text, encoding="utf-8")
    (commands,) = [block for block in blocks() if "simulate store.yaml" in block]
    for line in commands.splitlines():
        run(line.split()[1:], folder)
    return folder


def test_the_table_is_what_the_demo_prints(tmp_path):
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    demo = re.search(r"^demo:.*\n((?:\t.*\n)+)", makefile, re.M).group(1)
    lines = [line.split()[1:] for line in demo.strip().splitlines()]
    assert [line[0] for line in lines] == ["simulate", "estimate", "score"]
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    printed = [run(line, tmp_path) for line in lines]
    (table,) = [block for block in blocks() if "run-1" in block]
    assert printed[-1].strip() == table.strip()


def test_the_scenario_has_ten_lines_and_its_commands_run(ten_lines):
    (text,) = blocks("yaml")
    assert len(text.splitlines()) <= 11
    assert sorted(path.name for path in ten_lines.iterdir()) == [
        "store.h5",
        "store.png",
        "store.yaml",
        "tracks.h5",
    ]


def test_the_file_opens_as_shown(ten_lines, monkeypatch, capsys):
    (code,) = [block for block in blocks("python") if "xarray" in block]
    monkeypatch.chdir(ten_lines)
    exec(code, {})  # noqa: S102  # our own README
    assert capsys.readouterr().out.startswith("dBm ")


def test_links_lead_somewhere():
    for link in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (ROOT / link).exists(), link


def test_the_architecture_names_every_room():
    section = README.partition("## Architecture")[2].partition("## Limits")[0]
    table = "\n".join(line for line in section.splitlines() if line.startswith("|"))
    named = set(re.findall(r"`(\w+)`", " ".join(row.split("|")[1] for row in table.splitlines())))
    rooms = {path.stem for path in (ROOT / "blesim").glob("*.py")} - {"__init__"}
    rooms |= {path.parent.name for path in (ROOT / "blesim").glob("*/__init__.py")}
    assert named == rooms
