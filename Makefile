# Everything a reader needs: `make demo` shows the main job, `make test` proves it.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP_INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt

.PHONY: demo test test-all check bench clean

demo: $(VENV)/.installed $(VENV)/.kernels
	$(BIN)/blesim simulate scenarios/wholesale-section.yaml --seed 1 -o output/wholesale-section.h5
	$(BIN)/blesim estimate output/wholesale-section.h5 -e nearest-beacon -o output/wholesale-section-tracks.h5
	$(BIN)/blesim score output/wholesale-section.h5 output/wholesale-section-tracks.h5 --plot output/wholesale-section.png

test: $(VENV)/.installed-test $(VENV)/.kernels
	$(BIN)/python -m pytest -n auto

test-all: $(VENV)/.installed-test $(VENV)/.kernels
	$(BIN)/python -m pytest -n auto -m "slow or not slow"

check: $(VENV)/.installed-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

bench: $(VENV)/.installed-test $(VENV)/.kernels
	$(BIN)/python tests/benchmark/run.py

clean:
	rm -rf $(VENV) .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find blesim tests -name __pycache__ -type d -prune -exec rm -rf {} +
	find output -mindepth 1 ! -name .gitkeep -delete

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

# The stamps make a second run install nothing; a changed dependency list makes it install again.
$(VENV)/.installed: pyproject.toml constraints.txt | $(VENV)/bin/python
	$(PIP_INSTALL) -e .
	touch $@

$(VENV)/.installed-test: pyproject.toml constraints.txt | $(VENV)/bin/python
	$(PIP_INSTALL) -e ".[test]"
	touch $(VENV)/.installed $@

# Compiled kernels are kept beside their sources, but do not notice when a kernel that they call
# from another file has changed.
$(VENV)/.kernels: $(shell find blesim -name '*.py') | $(VENV)/bin/python
	find blesim -name '*.nb[ci]' -delete
	touch $@
