"""Scenarios written down for a test, and the faults they are refused for."""

from collections.abc import Callable
from pathlib import Path

import pytest

from blesim.errors import ScenarioError
from blesim.scenario.build import set_stage
from blesim.scenario.reading import read_scenario


@pytest.fixture
def written(tmp_path: Path) -> Callable[[str], Path]:
    """Write a scenario that walks through the section: title, venue, walks and what is given."""

    def write(more: str, venue: str = "{layout: wholesale-section}") -> Path:
        path = tmp_path / "scenario.yaml"
        phones = "" if "phones:" in more else "phones: {phone: {}}\n"
        walk = "walks: [{name: run, phone: phone, route: [D1, D5]}]\n"
        path.write_text(f"venue: {venue}\n{more}{phones}title: t\n{walk}", encoding="utf-8")
        return path

    return write


@pytest.fixture
def faults() -> Callable[[Path], list[str]]:
    """Lines of the error that a scenario is refused with, without the folder."""

    def told(path: Path) -> list[str]:
        with pytest.raises(ScenarioError) as caught:
            set_stage(read_scenario(path), 1)
        assert caught.value.exit_code == 2
        return [line.replace(f"{path.parent}/", "") for line in str(caught.value).splitlines()]

    return told
