"""Reading a scenario: YAML into models, and every fault with its file and line."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

from pydantic import ValidationError

from blesim.errors import ScenarioError
from blesim.scenario.document import Document, read_document
from blesim.scenario.model import Scenario
from blesim.scenario.other_values import laid_in
from blesim.settings import shortened

NOTHING_ELSE: Mapping[str, Any] = MappingProxyType({})
_FIRST_WORD = re.compile(r"(\w+)(?:: | (?='))")
# Where pydantic speaks of Python and of JSON, a scenario has lists and mappings.
_COUNTS = {"too_short": "min_length", "too_long": "max_length"}
_SHAPES = {
    **dict.fromkeys(("model_type", "dict_type"), "give a mapping"),
    **dict.fromkeys(("tuple_type", "list_type"), "give a list"),
}


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
    def _document(self) -> Document:
        return read_document(self.path, self.text)

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
        whole = scenario.model_dump_json(exclude_unset=True, serialize_as_any=True)
        scenario = Scenario.model_validate_json(whole)
        differs = json.dumps(scenario.model_dump(mode="json", include=set(changes)))
        note = f"# changed from {self.path.name}: {differs}\n"
        return ScenarioFile(path=self.path, text=self.text + note, scenario=scenario)

    def fault(self, location: Sequence[str | int], message: str) -> str:
        """One line, ``file:line: path: message``, for a fault found after reading."""
        return self._document.fault(location, message)


def read_scenario(path: Path, values: Mapping[str, Any] = NOTHING_ELSE) -> ScenarioFile:
    """The scenario of a file.

    Parameters
    ----------
    path : Path
        YAML 1.2.
    values : mapping of str to object
        What stands in place of the file's own, by path, as in ``{"radio.fading.model": "none"}``;
        see `blesim.scenario.other_values`. The scenario's text says so in a last line.

    Returns
    -------
    ScenarioFile

    Raises
    ------
    ScenarioError
        With a line ``file:line: path: message`` for every fault of the file and of the values.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ScenarioError(f"{path}: {error.strerror}; give a scenario file") from None
    except UnicodeDecodeError as error:
        raise ScenarioError(f"{path}: not UTF-8 text at byte {error.start}") from None
    document = read_document(path, text)
    if not isinstance(document.value, dict):
        raise ScenarioError(f"{path}:1: a scenario is a mapping that begins with 'title:'")
    if values:
        text += f"# changed from {path.name}: {json.dumps(dict(values))}\n"
        document = _with_values(document, values)
    return ScenarioFile(path=path, text=text, scenario=_checked(document))


def _with_values(document: Document, values: Mapping[str, Any]) -> Document:
    try:
        return replace(document, value=laid_in(document.value, values))
    except KeyError as unknown:
        raise ScenarioError(
            f"{document.path}: {unknown.args[0]}: leads to nothing that this scenario has"
        ) from None


def _checked(document: Document) -> Scenario:
    try:
        # JSON keeps the strictness of the models and takes lists for tuples.
        return Scenario.model_validate_json(json.dumps(document.value))
    except ValidationError as error:
        faults = [
            document.fault(*_at_its_key(fault["loc"], _reason(dict(fault)), fault.get("input")))
            for fault in error.errors(include_url=False)
        ]
        raise ScenarioError("\n".join(faults)) from None


def _at_its_key(
    location: Sequence[str | int], reason: str, value: Any
) -> tuple[Sequence[str | int], str]:
    """A fault of a mapping whose reason begins with one of its keys, told at that key."""
    key = _FIRST_WORD.match(reason)
    if key is None or not isinstance(value, dict) or key[1] not in value:
        return location, reason
    return [*location, key[1]], reason[key.end() :]


def _reason(fault: dict[str, Any]) -> str:
    """A pydantic fault in our words where they are clearer, with the value it is about."""
    kind, value = fault["type"], fault.get("input")
    if kind == "extra_forbidden":
        return "unknown key; take it out or correct its spelling"
    if kind == "missing":
        return "missing; it has no default"
    if kind == "union_tag_not_found":
        return f"missing {fault['ctx']['discriminator']}; it says what this is"
    if kind == "union_tag_invalid":
        tag = shortened(fault["ctx"]["tag"])
        return f"unknown '{tag}'; use one of {fault['ctx']['expected_tags']}"
    if kind in _COUNTS and isinstance(value, dict | list):
        least_or_most = fault["ctx"][_COUNTS[kind]]
        words = "at least" if kind == "too_short" else "at most"
        return f"give {words} {least_or_most}, not {fault['ctx']['actual_length']}"
    message = _SHAPES.get(kind) or str(fault["msg"]).removeprefix("Value error, ")
    if isinstance(value, dict | list):
        return message
    return f"{message}, not {shortened(json.dumps(value))}"
