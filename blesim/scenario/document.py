"""A YAML text as plain values that know their lines: what JSON can say, and nothing else."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.composer import MaxDepthExceededError
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from blesim.errors import ScenarioError
from blesim.settings import in_one_line, shortened, unreadable

Place = tuple[str | int, ...]
Pair = tuple[Node, Node]

# Deeper and larger than any scenario; aliases of aliases would otherwise grow without end.
_DEEPEST = 50
_MOST_VALUES = 200_000
_TOO_DEEP = f"nested deeper than {_DEEPEST} levels"

# What ruamel.yaml lets through, besides its own errors, for some malformed texts.
_LEAKS = (ArithmeticError, AssertionError, AttributeError, LookupError, TypeError, ValueError)

_TAG = "tag:yaml.org,2002:"
_MERGE = f"{_TAG}merge"
_TEXTS = (f"{_TAG}str", f"{_TAG}value")
_OTHER_SCALARS = tuple(_TAG + kind for kind in ("null", "bool", "int", "float"))
_KINDS: tuple[tuple[type[Node], tuple[str, ...]], ...] = (
    (MappingNode, (f"{_TAG}map",)),
    (SequenceNode, (f"{_TAG}seq",)),
    (ScalarNode, (*_TEXTS, *_OTHER_SCALARS)),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Document:
    """A YAML text as read.

    Attributes
    ----------
    path : Path
        The file, for messages.
    value : object
        Mappings with texts as keys, lists, texts, numbers, truth values and None.
    lines : dict of tuple to int
        Line of each part, by its keys and indices from the top.
    """

    path: Path
    value: Any
    lines: dict[Place, int]

    def fault(self, location: Sequence[str | int], message: str) -> str:
        """One line, ``file:line: path: message``; the line is that of the innermost known part."""
        place: Place = ()
        value = self.value
        for part in location:
            if (*place, part) in self.lines:
                place, value = (*place, part), value[part]
            elif not isinstance(value, dict) or part != value.get("event"):
                # A missing or unknown key: name it, and point at the part that should have it.
                return _fault(self.path, self.lines[place], (*place, part), message)
            # Else it says which of several models was tried: nothing that stands in the file.
        return _fault(self.path, self.lines[place], place, message)


def read_document(path: Path, text: str) -> Document:
    """The values of a YAML text.

    Parameters
    ----------
    path : Path
        Where it is from, for messages.
    text : str
        YAML 1.2, one document; aliases and merge keys are resolved.

    Raises
    ------
    ScenarioError
        With one line for the first fault of the syntax, or one for everything that is no plain
        value: a date, a tag of somebody else's, a key that is no text, a control character.
    """
    root = _composed(path, text)
    reading = _Reading(path=path)
    value = None if root is None else reading.value(root, ())
    if reading.faults:
        raise ScenarioError("\n".join(line for _, line in sorted(reading.faults)))
    return Document(path=path, value=value, lines=reading.lines)


def _composed(path: Path, text: str) -> Node | None:
    yaml: Any = YAML(typ="safe", pure=True)
    yaml.max_depth = _DEEPEST
    # To give an anchor a new meaning further down is what YAML allows.
    yaml.composer.warn_double_anchors = False
    try:
        root: Node | None = yaml.compose(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        deep = isinstance(error, MaxDepthExceededError)
        reason = _TOO_DEEP if deep else str(error.problem or error.context)
        raise _invalid(path, mark.line + 1 if mark is not None else 1, reason) from None
    except (YAMLError, *_LEAKS) as error:
        raise _invalid(path, 1, str(error)) from None
    return root


def _invalid(path: Path, line: int, reason: str) -> ScenarioError:
    return ScenarioError(f"{path}:{line}: not valid YAML: {in_one_line(' '.join(reason.split()))}")


def _fault(path: Path, line: int, place: Place, message: str) -> str:
    named = ".".join(shortened(str(part)) or "''" for part in place)
    return f"{path}:{line}: {named}: {message}" if place else f"{path}:{line}: {message}"


@dataclass(slots=True, kw_only=True)
class _Reading:
    """What has been read so far: the line of each part, and what was wrong."""

    path: Path
    lines: dict[Place, int] = field(default_factory=lambda: {(): 1})
    faults: list[tuple[int, str]] = field(default_factory=list)
    scalars: Any = field(default_factory=lambda: YAML(typ="safe", pure=True).constructor)

    def value(self, node: Node, place: Place, around: tuple[Node, ...] = ()) -> Any:
        """Plain value of a node that stands inside other nodes."""
        self._refuse_endless(node, around)
        reason = _not_plain(node)
        if reason is not None:
            self._note(node, place, reason)
            return None
        if isinstance(node, MappingNode):
            return self._mapping(node, place, (*around, node))
        if isinstance(node, SequenceNode):
            return self._sequence(node, place, (*around, node))
        return self._scalar(node, place)

    def _mapping(self, node: MappingNode, place: Place, around: tuple[Node, ...]) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for key, value in self._pairs(node, place, around):
            inside = (*place, key.value)
            self.lines[inside] = key.start_mark.line + 1
            found[key.value] = self.value(value, inside, around)
        return found

    def _sequence(self, node: SequenceNode, place: Place, around: tuple[Node, ...]) -> list[Any]:
        found = []
        for number, item in enumerate(node.value):
            inside = (*place, number)
            self.lines[inside] = item.start_mark.line + 1
            found.append(self.value(item, inside, around))
        return found

    def _scalar(self, node: Node, place: Place) -> Any:
        if node.tag in _TEXTS:
            reason = unreadable(node.value)
            if reason is not None:
                self._note(node, place, reason)
            return node.value
        try:
            return self.scalars.construct_object(node)
        except _LEAKS:
            kind, written = _tag(node).removeprefix(_TAG), shortened(node.value)
            reason = f"'{written}' cannot be read as {kind}"
            raise _invalid(self.path, node.start_mark.line + 1, reason) from None

    def _pairs(self, node: MappingNode, place: Place, around: tuple[Node, ...]) -> list[Pair]:
        """Pairs of a mapping with a text as key, then those merged into it that it has not."""
        own: dict[str, Pair] = {}
        merged: list[Pair] = []
        for key, value in node.value:
            if _tag(key) == _MERGE:
                merged += self._sources(value, place, around)
            elif self._is_key(key, place):
                if key.value in own:
                    reason = f"the key '{shortened(key.value)}' is there twice"
                    raise _invalid(self.path, key.start_mark.line + 1, reason)
                own[key.value] = key, value
        for key, value in merged:
            own.setdefault(key.value, (key, value))
        return list(own.values())

    def _sources(self, value: Node, place: Place, around: tuple[Node, ...]) -> list[Pair]:
        """Pairs of the mappings that a merge key names, the first mapping first."""
        pairs: list[Pair] = []
        for source in value.value if isinstance(value, SequenceNode) else [value]:
            self._refuse_endless(source, around)
            if isinstance(source, MappingNode):
                pairs += self._pairs(source, place, (*around, source))
            else:
                self._note(value, place, "'<<' takes a mapping, or a list of mappings")
        return pairs

    def _is_key(self, key: Node, place: Place) -> bool:
        reason = "a key must be a text, in quotes where it could be something else"
        if isinstance(key, ScalarNode) and _tag(key) in _TEXTS:
            fault = unreadable(key.value)
            if fault is None:
                return True
            reason = f"the key '{shortened(key.value)}' {fault}"
        self._note(key, place, reason)
        return False

    def _refuse_endless(self, node: Node, around: tuple[Node, ...]) -> None:
        line = node.start_mark.line + 1
        if any(node is outer for outer in around):
            raise _invalid(self.path, line, f"'{node.anchor}' contains itself")
        if len(around) >= _DEEPEST:
            raise _invalid(self.path, line, _TOO_DEEP)
        if len(self.lines) > _MOST_VALUES:
            raise _invalid(self.path, line, f"more than {_MOST_VALUES} values")

    def _note(self, node: Node, place: Place, reason: str) -> None:
        line = node.start_mark.line + 1
        self.faults.append((line, _fault(self.path, line, place, reason)))


def _tag(node: Node) -> str:
    return node.tag or ""


def _not_plain(node: Node) -> str | None:
    """Reason why a node is no value that a parameter can take; None if it is one."""
    if any(isinstance(node, kind) and _tag(node) in tags for kind, tags in _KINDS):
        return None
    if _tag(node) == f"{_TAG}timestamp":
        return "a date is no value here; put it in quotes to make it a text"
    tag = shortened(_tag(node).replace(_TAG, "!!"))
    if _tag(node).startswith(_TAG):
        return f"{tag} is no kind of value here; take the tag out"
    return f"the tag {tag} is not known here; take it out"
