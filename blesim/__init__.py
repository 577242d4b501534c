"""A Bluetooth-beacon store in software: simulate, record, position and score.

The public names below are loaded when they are first asked for, so that ``import blesim`` is quick.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from blesim.dataset.reader import read_recording, read_truth
    from blesim.dataset.writer import write_recording
    from blesim.errors import BlesimError
    from blesim.estimators.base import Estimator, Tracker
    from blesim.estimators.check import check_estimator
    from blesim.metrics.score import score
    from blesim.recording import Observations, Recording, Truth, Walk
    from blesim.scenario.reading import read_scenario
    from blesim.simulate import Simulation
    from blesim.tables import Track
    from blesim.venue.venue import Venue

__version__ = "0.1.0"

__all__ = [
    "BlesimError",
    "Estimator",
    "Observations",
    "Recording",
    "Simulation",
    "Track",
    "Tracker",
    "Truth",
    "Venue",
    "Walk",
    "check_estimator",
    "read_recording",
    "read_scenario",
    "read_truth",
    "score",
    "write_recording",
]

_HOME = {
    "BlesimError": "blesim.errors",
    "Estimator": "blesim.estimators.base",
    "Observations": "blesim.recording",
    "Recording": "blesim.recording",
    "Simulation": "blesim.simulate",
    "Track": "blesim.tables",
    "Tracker": "blesim.estimators.base",
    "Truth": "blesim.recording",
    "Venue": "blesim.venue.venue",
    "Walk": "blesim.recording",
    "check_estimator": "blesim.estimators.check",
    "read_recording": "blesim.dataset.reader",
    "read_scenario": "blesim.scenario.reading",
    "read_truth": "blesim.dataset.reader",
    "score": "blesim.metrics.score",
    "write_recording": "blesim.dataset.writer",
}


def __getattr__(name: str) -> Any:
    """Load a public name."""
    if name not in _HOME:
        raise AttributeError(f"module 'blesim' has no attribute '{name}'")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    """List the public names."""
    return sorted([*__all__, "__version__"])
