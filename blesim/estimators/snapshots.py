"""What may not change while an estimator works: its state, its inputs, the global generators."""

import copy
import random
from dataclasses import fields
from typing import Any

import numpy as np

from blesim.recording import Recording


def state_of(estimator: Any) -> dict[str, Any]:
    """Everything an estimator holds; containers copied, so that a change in them shows."""
    held = {field.name: getattr(estimator, field.name) for field in fields(estimator)}
    held.update(getattr(estimator, "__dict__", {}))
    containers = (list, dict, set, np.ndarray)
    return {n: copy.deepcopy(v) if isinstance(v, containers) else v for n, v in held.items()}


def global_randomness() -> list[Any]:
    """States of the generators that Python and NumPy share among all callers."""
    numpy_state = np.random.get_state(legacy=False)  # noqa: NPY002 (looked at, not drawn from)
    return [random.getstate(), numpy_state]


def inputs_of(recording: Recording) -> list[Any]:
    """Copies of all arrays that an estimator is handed."""
    venue = recording.venue
    tables = [list(t.arrays()) for walk in recording.walks for t in walk.observations.tables()]
    maps = [venue.beacon_xyz_m, venue.beacon_level]
    if venue.graph is not None:
        maps += [venue.graph.node_xy_m, venue.graph.ends, venue.graph.length_m]
    return copy.deepcopy([tables, maps])


def same(a: Any, b: Any) -> bool:
    """Whether two values are equal, arrays inside them by their elements."""
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        # What was not told is NaN, and stays the same.
        return np.array_equal(a, b, equal_nan=np.asarray(a).dtype.kind == "f")
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, list | tuple) and isinstance(b, list | tuple):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    return bool(a is b or a == b)
