"""What all tests share: where the recorded data of others is found, and repeatable examples."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import settings

from blesim.venue.layouts import wholesale_section, wholesale_store
from blesim.venue.venue import Venue

# The same examples in every run; compiling a kernel takes longer than any sensible deadline.
settings.register_profile("blesim", derandomize=True, deadline=None)
settings.load_profile("blesim")

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def data_dir() -> Callable[[str], Path]:
    """Find the folder of one set of real data, such as ``data_dir("philotuxo")``, or skip."""

    def find(name: str) -> Path:
        folder = Path(os.environ.get("BLESIM_DATA") or ROOT.parent / "shared" / "data") / name
        if not folder.is_dir():
            pytest.skip(f"no real data at {folder}; set BLESIM_DATA to the folder that holds it")
        return folder

    return find


@pytest.fixture(scope="session")
def section() -> Venue:
    """The measured section of the wholesale store."""
    return wholesale_section()


@pytest.fixture(scope="session")
def store() -> Venue:
    """The whole wholesale store."""
    return wholesale_store()
