"""How long a user waits for the package and for the command to answer."""

import subprocess
import sys
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

from measure import Row, median_seconds

_ROUNDS = 9
_COMMAND = str(Path(sys.executable).with_name("blesim"))
_CALLS = {
    "python -c pass": [sys.executable, "-c", "pass"],
    "import blesim": [sys.executable, "-c", "import blesim"],
    "blesim --help": [_COMMAND, "--help"],
}


def _run(call: list[str]) -> None:
    subprocess.run(call, check=True, capture_output=True)


@cache
def _medians() -> dict[str, float]:
    works = [partial(_run, call) for call in _CALLS.values()]
    return dict(zip(_CALLS, median_seconds(works, rounds=_ROUNDS), strict=True))


def _median(name: str) -> Callable[[], float]:
    return lambda: _medians()[name]


ROWS = [
    Row(name="python -c pass", unit="s", measure=_median("python -c pass")),
    Row(name="import blesim", unit="s", goal="< 0.3", measure=_median("import blesim")),
    Row(name="blesim --help", unit="s", goal="< 0.5", measure=_median("blesim --help")),
]
