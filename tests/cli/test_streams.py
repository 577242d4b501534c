"""What commands do when their own streams fail them, and how names of others are shown."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from blesim import __version__
from blesim.cli.console import answer_table, report_fault

COMMAND = f"'{sys.executable}' -c 'from blesim.cli import main; main()'"
full = pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")


def shell(arguments, **variables):
    return subprocess.run(
        f"{COMMAND} {arguments}",
        shell=True,
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | variables,
    )


@pytest.mark.parametrize(
    ("arguments", "code", "errors"),
    [
        ("schema >&-", 0, ""),
        ("inspect nowhere.h5 2>&-", 1, ""),
        pytest.param(
            "schema >/dev/full",
            1,
            "blesim: output cannot be written: No space left on device\n",
            marks=full,
        ),
        pytest.param("inspect nowhere.h5 2>/dev/full", 1, "", marks=full),
    ],
)
def test_streams_that_take_nothing(arguments, code, errors):
    ended = shell(arguments)
    assert (ended.returncode, ended.stderr) == (code, errors)


def test_letters_that_the_terminal_lacks_are_replaced():
    ended = shell("estimators", PYTHONIOENCODING="ascii")
    assert (ended.returncode, ended.stderr) == (0, "")
    ended = shell("inspect 店.h5", PYTHONIOENCODING="ascii")
    assert (ended.returncode, ended.stderr) == (1, "blesim: ?.h5: there is no such file\n")


@pytest.mark.parametrize("arguments", ["", "fly", "simulate", "simulate --nix", "score a b c"])
def test_a_wrong_call_is_one_line(arguments):
    ended = shell(arguments)
    if not arguments:
        assert ended.returncode == 0
        assert "simulate" in ended.stdout
        return
    assert ended.returncode == 2
    assert ended.stderr.startswith("blesim: ")
    assert ended.stderr.count("\n") == 1
    assert ended.stdout == ""


def test_the_version_is_told():
    ended = shell("--version")
    assert (ended.returncode, ended.stdout) == (0, f"blesim {__version__}\n")


def test_names_in_tables_are_letters_and_nothing_else(capsys):
    answer_table("Walks", ["walk", "n"], [["[/foo]", "[red]x"], ["a\x1b[31m\nb", "店"]])
    shown = capsys.readouterr().out
    for name in ("[/foo]", "[red]x", r"a\x1b[31m\nb", "店"):
        assert name in shown
    assert "\x1b[31m" not in shown


def test_a_fault_has_a_line_for_each_and_no_control_characters(capsys):
    report_fault("one\ntwo \x1b[2J")
    assert capsys.readouterr().err == "blesim: one\nblesim: two \\x1b[2J\n"
