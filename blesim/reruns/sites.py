"""The scenarios of the papers, wherever blesim is installed."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from blesim.errors import DataError
from blesim.scenario.reading import NOTHING_ELSE, ScenarioFile, read_scenario


def scenario_of(name: str, values: Mapping[str, Any] = NOTHING_ELSE) -> ScenarioFile:
    """The scenario of that name, such as ``wholesale-section``, with other values at some paths.

    Raises
    ------
    DataError
        If this installation has no scenarios.
    """
    path = _folder() / f"{name}.yaml"
    if not path.is_file():
        raise DataError(f"scenario '{name}' is not in this installation; install blesim again")
    return read_scenario(path, values)


def scenario_files() -> list[Path]:
    """Scenarios and maps, sorted."""
    return sorted(path for path in _folder().glob("*") if path.suffix in (".yaml", ".geojson"))


def _folder() -> Path:
    """In the package where it was installed, beside it in its sources."""
    package = Path(__file__).parents[1]
    inside = package / "scenarios"
    return inside if inside.is_dir() else package.parent / "scenarios"
