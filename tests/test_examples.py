"""The examples in the docstrings are executed."""

import doctest
import importlib
import pkgutil

import pytest

import blesim

MODULES = sorted(module.name for module in pkgutil.walk_packages(blesim.__path__, prefix="blesim."))


@pytest.mark.parametrize("name", MODULES)
def test_docstring_examples(name: str) -> None:
    if name.endswith("__main__"):
        pytest.skip("runs when it is imported")
    assert doctest.testmod(importlib.import_module(name)).failed == 0


def test_there_are_examples() -> None:
    units = importlib.import_module("blesim.units")
    assert sum(len(test.examples) for test in doctest.DocTestFinder().find(units)) >= 2
