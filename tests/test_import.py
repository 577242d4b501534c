"""Importing the package and its commands loads nothing heavy."""

import importlib.util
import subprocess
import sys

import pytest

HEAVY = ("numba", "scipy", "matplotlib", "h5py", "pandas", "networkx", "shapely")


@pytest.mark.parametrize("module", ["blesim", "blesim.cli"])
def test_heavy_parts_are_imported_late(module: str) -> None:
    if importlib.util.find_spec(module) is None:
        pytest.skip(f"{module} does not exist")
    code = f"import sys, {module}; print(*sorted(set({HEAVY}) & set(sys.modules)))"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ended.stdout.split() == []
