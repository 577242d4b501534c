"""Other values laid into a scenario as read, for what-if questions: by path, ``radio.fading``."""

from collections.abc import Mapping
from copy import deepcopy
from typing import Any

EVERY = "*"


def laid_in(document: Any, values: Mapping[str, Any]) -> Any:
    """A copy of plain values with others at some paths.

    Parameters
    ----------
    document : object
        Mappings and lists, as read from YAML.
    values : mapping of str to object
        By path: keys and the indices of lists, joined by points; ``*`` stands for all of them, as
        in ``walks.*.speed_m_s``. A mapping on the way that is missing is made.

    Raises
    ------
    KeyError
        With the path that leads through something else, beyond a list, or to all of nothing.
    """
    changed = deepcopy(document)
    for path, value in values.items():
        *way, last = path.split(".")
        for part in _parts(changed, way, path):
            for key in _keys(part, last, path):
                part[key] = deepcopy(value)
    return changed


def _parts(part: Any, way: list[str], path: str) -> list[Any]:
    """What the way leads to: several things where it goes through all of a list."""
    if not way:
        return [part]
    here, *on = way
    found = []
    for key in _keys(part, here, path):
        if isinstance(part, dict):
            part.setdefault(key, {})
        found += _parts(part[key], on, path)
    return found


def _keys(part: Any, name: str, path: str) -> list[Any]:
    if isinstance(part, dict):
        if name != EVERY:
            return [name]
        keys: list[Any] = list(part)
    elif isinstance(part, list):
        keys = [row for row in range(len(part)) if name in (EVERY, str(row))]
    else:
        keys = []
    if not keys:
        raise KeyError(path)
    return keys
