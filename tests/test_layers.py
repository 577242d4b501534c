"""The rooms of the house stand in order: who may import whom."""

import ast
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import networkx as nx
import pytest

import blesim

PACKAGE = Path(blesim.__file__).parent

# Each room may import from those before it.
ROOMS = (
    "errors",
    "stopping",
    "whole_file",
    "workers",
    "units",
    "settings",
    "kernels",
    "columns",
    "rng",
    "tables",
    "venue",
    "recording",
    "walkers",
    "radio",
    "imu",
    "scenario",
    "observe",
    "cast",
    "simulate",
    "dataset",
    "pdr",
    "ranging",
    "filters",
    "estimators",
    "metrics",
    "fidelity",
    "reruns",
    "study",
    "report",
    "cli",
)
SIMULATOR = ("scenario", "observe", "cast", "simulate", "walkers", "radio", "imu")
BLIND_TO_THE_SIMULATOR = ("dataset", "pdr", "ranging", "filters", "estimators", "metrics")
FORBIDDEN = {("radio", "imu"), ("imu", "radio")} | {
    (room, other) for room in BLIND_TO_THE_SIMULATOR for other in SIMULATOR
}
# Drawing libraries are known to one room.
PLOTTING = ("matplotlib", "plotly")


@dataclass(frozen=True, slots=True, kw_only=True)
class Import:
    """One import: the importing module, the line, what is imported, and from it which name."""

    module: str
    line: int
    target: str
    name: str | None = None

    @property
    def where(self) -> str:
        return f"{self.module}:{self.line}"


def imports_of(module: str, source: str) -> list[Import]:
    """All imports of a module, those inside functions and of type checking too."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found += [
                Import(module=module, line=node.lineno, target=alias.name) for alias in node.names
            ]
        elif isinstance(node, ast.ImportFrom):
            target = "." * node.level + (node.module or "")
            found += [
                Import(module=module, line=node.lineno, target=target, name=alias.name)
                for alias in node.names
            ]
    return found


def room_of(module: str) -> str:
    """Room of a module name such as ``blesim.venue.graph``; empty for the package root."""
    return module.partition(".")[2].partition(".")[0]


def resolved(found: Import, modules: Mapping[str, str]) -> str:
    """Name of the module that an import loads."""
    whole = f"{found.target}.{found.name}"
    return whole if found.name and whole in modules else found.target


def faults(modules: Mapping[str, str]) -> list[str]:
    """One line for each breach of the order, in the sources of modules by name."""
    told = [f"{name}: unknown room" for name in modules if room_of(name) not in ("", *ROOMS)]
    arcs: nx.DiGraph[str] = nx.DiGraph()
    for name, source in modules.items():
        for found in imports_of(name, source):
            target = resolved(found, modules)
            told += breaches(found, target)
            if target in modules and room_of(target) == room_of(name):
                arcs.add_edge(name, target)
    return told + [f"cycle: {' -> '.join(cycle)}" for cycle in nx.simple_cycles(arcs)]


def breaches(found: Import, target: str) -> list[str]:
    mine, theirs = room_of(found.module), room_of(target)
    if target.startswith("."):
        return [f"{found.where}: relative import; write the whole name"]
    if target.split(".")[0] in PLOTTING and mine != "report":
        return [f"{found.where}: {target} belongs to report"]
    if target.split(".")[0] != "blesim" or mine not in ROOMS or mine == theirs:
        return []
    if target == "blesim":
        allowed = found.name == "__version__"
        return [] if allowed else [f"{found.where}: import from the module, not from the root"]
    if theirs not in ROOMS or ROOMS.index(theirs) > ROOMS.index(mine):
        return [f"{found.where}: {mine} imports {theirs}, which comes after it"]
    if (mine, theirs) in FORBIDDEN:
        return [f"{found.where}: {mine} must not know {theirs}"]
    return []


def package_sources() -> dict[str, str]:
    sources = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        sources[name] = path.read_text(encoding="utf-8")
    return sources


def test_the_package_keeps_the_order() -> None:
    assert faults(package_sources()) == []


def test_folders_without_python_hold_data_only() -> None:
    rooms = {path.name for path in PACKAGE.iterdir() if path.is_dir() and any(path.rglob("*.py"))}
    assert rooms <= set(ROOMS)


def test_the_order_itself_allows_no_forbidden_pair_twice() -> None:
    assert len(set(ROOMS)) == len(ROOMS)
    assert {room for pair in FORBIDDEN for room in pair} <= set(ROOMS)


@pytest.mark.parametrize(
    ("modules", "fault"),
    [
        ({"blesim.tables": "import blesim.cli"}, "tables imports cli, which comes after it"),
        ({"blesim.units": "def f():\n    from blesim.rng import x"}, "units:2: units imports rng"),
        ({"blesim.imu.a": "from blesim.radio.b import c"}, "imu must not know radio"),
        ({"blesim.radio.a": "from blesim.imu.b import c"}, "imu, which comes after it"),
        ({"blesim.dataset.a": "import blesim.simulate"}, "dataset must not know simulate"),
        ({"blesim.metrics.a": "from blesim.walkers import b"}, "metrics must not know walkers"),
        ({"blesim.pdr.a": "from blesim.scenario.b import c"}, "pdr must not know scenario"),
        ({"blesim.venue.a": "from blesim import Venue"}, "not from the root"),
        ({"blesim.venue.a": "import blesim"}, "not from the root"),
        (
            {"blesim.rng": "from blesim import simulate", "blesim.simulate": ""},
            "rng imports simulate",
        ),
        ({"blesim.venue.a": "from .graph import b"}, "relative import"),
        ({"blesim.venue.a": "from . import b"}, "relative import"),
        ({"blesim.metrics.a": "import matplotlib.pyplot as plt"}, "belongs to report"),
        ({"blesim.cli.a": "from plotly import graph_objects"}, "belongs to report"),
        ({"blesim.helpers": ""}, "blesim.helpers: unknown room"),
        ({"blesim.tables": "import blesim.helpers"}, "tables imports helpers"),
        (
            {
                "blesim.venue.a": "from blesim.venue.b import x",
                "blesim.venue.b": "def f():\n    from blesim.venue import c",
                "blesim.venue.c": "import blesim.venue.a",
            },
            "cycle: ",
        ),
    ],
)
def test_a_breach_is_found(modules: dict[str, str], fault: str) -> None:
    (told,) = faults(modules)
    assert fault in told


@pytest.mark.parametrize(
    "modules",
    [
        {"blesim.cli.a": "from blesim import __version__\nimport blesim.simulate"},
        {"blesim.tables": "from blesim import columns", "blesim.columns": ""},
        {"blesim.report.a": "import matplotlib\nfrom plotly import io"},
        {"blesim.venue.a": "from blesim.venue.b import c\nimport numpy", "blesim.venue.b": ""},
        {"blesim": "from blesim.venue.venue import Venue\nfrom blesim.simulate import simulate"},
        {"blesim.fidelity.a": "from blesim.simulate import simulate"},
    ],
)
def test_what_is_allowed(modules: dict[str, str]) -> None:
    assert faults(modules) == []
