"""Reading a scenario: YAML into models, and every fault with its file and line."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from blesim.errors import ScenarioError
from blesim.scenario.model import Scenario

Location = Sequence[str | int]


@dataclass(frozen=True, kw_only=True)
class ScenarioFile:
    """A scenario as read: the models, the verbatim text, and where each part stands.

    Attributes
    ----------
    path : Path
        The file; maps are looked for beside it.
    text : str
        Verbatim.
    scenario : Scenario
        The checked parameters.
    """

    path: Path
    text: str
    scenario: Scenario

    @cached_property
    def _tree(self) -> Any:
        return _parse(self.path, self.text)

    def with_parameters(self, **changes: Any) -> "ScenarioFile":
        """The same scenario with other parameters, for what-if questions in Python.

        Its text says what differs, so that a recording made from it does not pass for the original.

        Parameters
        ----------
        **changes
            Fields of `Scenario`, already built, such as ``radio=Propagation(...)``.
        """
        scenario = self.scenario.model_copy(update=changes)
        # Validated once more: copies are not.
        scenario = Scenario.model_validate_json(scenario.model_dump_json(exclude_unset=True))
        differs = json.dumps(scenario.model_dump(mode="json", include=set(changes)))
        note = f"# changed from {self.path.name}: {differs}\n"
        return ScenarioFile(path=self.path, text=self.text + note, scenario=scenario)

    def fault(self, location: Location, message: str) -> str:
        """One line, ``file:line: path: message``, for a fault found after reading."""
        return _fault(self.path, self._tree, location, message)


def read_scenario(path: Path) -> ScenarioFile:
    """The scenario of a file.

    Parameters
    ----------
    path : Path
        YAML 1.2.

    Returns
    -------
    ScenarioFile

    Raises
    ------
    ScenarioError
        With a line ``file:line: path: message`` for every fault of the file.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ScenarioError(f"{path}: {error.strerror}; give a scenario file") from None
    except UnicodeDecodeError as error:
        raise ScenarioError(f"{path}: not UTF-8 text at byte {error.start}") from None
    tree = _parse(path, text)
    if not isinstance(tree, CommentedMap):
        raise ScenarioError(f"{path}:1: a scenario is a mapping that begins with 'title:'")
    return ScenarioFile(path=path, text=text, scenario=_checked(path, tree))


def _parse(path: Path, text: str) -> Any:
    """YAML as mappings and sequences that know their lines."""
    try:
        return YAML(typ="rt").load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = mark.line + 1 if mark is not None else 1
        reason = " ".join(str(error.problem or error.context).split())
        raise ScenarioError(f"{path}:{line}: not valid YAML: {reason}") from None
    except YAMLError as error:
        raise ScenarioError(f"{path}:1: not valid YAML: {' '.join(str(error).split())}") from None


def _checked(path: Path, tree: CommentedMap) -> Scenario:
    try:
        # JSON keeps the strictness of the models and takes lists for tuples.
        return Scenario.model_validate_json(json.dumps(tree, default=str))
    except ValidationError as error:
        faults = [
            _fault(path, tree, fault["loc"], _reason(dict(fault)))
            for fault in error.errors(include_url=False)
        ]
        raise ScenarioError("\n".join(faults)) from None


def _reason(fault: dict[str, Any]) -> str:
    """A pydantic fault in our words where they are clearer, with the value it is about."""
    kind, value = fault["type"], fault.get("input")
    if kind == "extra_forbidden":
        return "unknown key; take it out or correct its spelling"
    if kind == "missing":
        return "missing; it has no default"
    message = str(fault["msg"]).removeprefix("Value error, ")
    if isinstance(value, dict | list):
        return message
    return f"{message}, not {json.dumps(value)}"


def _fault(path: Path, tree: Any, location: Location, message: str) -> str:
    """Spell a fault with the line of the innermost part that the file really has."""
    node, line, named = tree, 1, []
    for part in location:
        if isinstance(node, CommentedMap) and part in node:
            line = node.lc.key(part)[0] + 1
        elif isinstance(node, CommentedSeq) and isinstance(part, int) and part < len(node):
            line = node.lc.item(part)[0] + 1
        else:
            # A missing or unknown key: name it, and point at the part that should have it.
            named.append(str(part))
            break
        node = node[part]
        named.append(str(part))
    return f"{path}:{line}: {'.'.join(named)}: {message}"
