"""Estimators by name: the entry points of the group ``blesim.estimators``, ours and anybody's."""

import difflib
import re
import typing
from collections.abc import Mapping
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from pydantic import ConfigDict, TypeAdapter, ValidationError

from blesim.errors import UsageError
from blesim.estimators.base import Estimator

GROUP = "blesim.estimators"
# A mark such as [1]_ points into documentation that a one-line summary leaves out.
_REFERENCE = re.compile(r"\s*\[\d+\]_")


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """One setting of an estimator: name, type as written in Python, default as Python writes it."""

    name: str
    type: str
    default: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Description:
    """What a user should know of an estimator before using it.

    Attributes
    ----------
    name : str
        As in the call.
    summary : str
        First line of its documentation.
    needs : tuple of str
        What it cannot do without at its default settings, sorted.
    parameters : tuple of Parameter
        Its settings.
    fault : str or None
        Why it cannot be used, if so; the rest is then empty.
    """

    name: str
    summary: str = ""
    needs: tuple[str, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    fault: str | None = None


def estimator_names() -> tuple[str, ...]:
    """Names of all installed estimators, sorted; none of them is imported."""
    return tuple(sorted({point.name for point in entry_points(group=GROUP)}))


def load_estimator(name: str) -> type[Any]:
    """Class of an estimator.

    Raises
    ------
    UsageError
        If no package brings one of that name, several do, or it cannot be imported or used.
    """
    point = _entry_point(name)
    try:
        loaded = point.load()
    except Exception as fault:  # whatever a stranger's module does when it is imported
        raise UsageError(
            f"estimator '{name}' ({point.value}) cannot be imported: {one_line(fault)}"
        ) from fault
    frozen_dataclass = is_dataclass(loaded) and getattr(loaded, "__dataclass_params__").frozen  # noqa: B009 (no stub knows it)
    if not (isinstance(loaded, type) and frozen_dataclass):
        raise UsageError(f"estimator '{name}' ({point.value}) is not a frozen dataclass")
    for part in ("needs", "fit", "start"):
        if not hasattr(loaded, part):
            raise UsageError(f"estimator '{name}' ({point.value}) has no '{part}'")
    return loaded


def make_estimator(text: str) -> tuple[str, Estimator]:
    """Estimator from a text such as ``"nearest-beacon:signal=averaged,window_s=2"``.

    Parameters
    ----------
    text : str
        ``NAME`` or ``NAME:key=value,key=value``; values are read by the type of the parameter.

    Returns
    -------
    label : str
        The text without blanks: what tables and files call this estimator.
    estimator : Estimator
        Not yet fitted.

    Raises
    ------
    UsageError
        If the estimator or a parameter is unknown, or a value is not allowed.
    """
    label = "".join(text.split())
    name, _, arguments = label.partition(":")
    cls = load_estimator(name)
    settings = {
        key: _value(name, cls, key, value) for key, value in _pairs(name, arguments).items()
    }
    try:
        return label, typing.cast(Estimator, cls(**settings))
    except (ValueError, TypeError, UsageError) as fault:
        raise UsageError(f"estimator '{name}': {one_line(fault)}") from fault


def describe(name: str) -> Description:
    """Needs and parameters of an estimator; one that is broken is described by its fault.

    Raises
    ------
    UsageError
        If there is no estimator of that name.
    """
    _refuse_unknown(name)
    try:
        cls = load_estimator(name)
        needs = cls().needs
    except UsageError as fault:
        return Description(name=name, fault=str(fault))
    except Exception as fault:  # whatever a stranger's class does when it is built
        return Description(name=name, fault=f"'{name}' with default settings: {one_line(fault)}")
    return Description(
        name=name,
        summary=_REFERENCE.sub("", (cls.__doc__ or "").strip().partition("\n")[0]),
        needs=tuple(sorted(str(need) for need in needs)),
        parameters=tuple(
            Parameter(name=key, type=_type_text(hint), default=_default_text(field))
            for key, (field, hint) in _parameters(cls).items()
        ),
    )


def one_line(fault: BaseException) -> str:
    """What went wrong, in one line: the kind of fault unless it explains itself."""
    if isinstance(fault, ValidationError):
        return "; ".join(
            ".".join([*map(str, error["loc"]), error["msg"]]) for error in fault.errors()
        )
    words = " ".join(str(fault).split())
    if isinstance(fault, UsageError):
        return words
    return f"{type(fault).__name__}: {words}" if words else type(fault).__name__


def _entry_point(name: str) -> EntryPoint:
    _refuse_unknown(name)
    # A package may be seen twice, as its source and as its installation; that is one offer.
    offers = {point.value: point for point in entry_points(group=GROUP, name=name)}
    if len(offers) > 1:
        raise UsageError(
            f"estimator '{name}' is offered by {' and by '.join(sorted(offers))}; uninstall one"
        )
    return next(iter(offers.values()))


def _refuse_unknown(name: str) -> None:
    known = estimator_names()
    if name not in known:
        raise UsageError(
            f"there is no estimator '{name}'{_hint(name, known)};"
            f" known are {', '.join(known) or 'none'}"
        )


def _hint(name: str, known: typing.Iterable[str]) -> str:
    close = difflib.get_close_matches(name, known, n=2)
    return f" (did you mean {' or '.join(close)}?)" if close else ""


def _pairs(name: str, arguments: str) -> Mapping[str, str]:
    pairs: dict[str, str] = {}
    for argument in filter(None, arguments.split(",")):
        key, equals, value = argument.partition("=")
        if not (key and equals):
            raise UsageError(f"estimator '{name}': '{argument}' is not of the form key=value")
        if key in pairs:
            raise UsageError(f"estimator '{name}': parameter '{key}' is given twice")
        pairs[key] = value
    return pairs


def _parameters(cls: type[Any]) -> dict[str, tuple[Field[Any], Any]]:
    """Field and type of each setting, by its name; what `fit` learns is none."""
    settings = [field for field in fields(cls) if field.init]
    hints = typing.get_type_hints(cls, include_extras=True)
    return {field.name: (field, hints[field.name]) for field in settings}


def _value(name: str, cls: type[Any], key: str, text: str) -> Any:
    parameters = _parameters(cls)
    if key not in parameters:
        raise UsageError(
            f"estimator '{name}' has no parameter '{key}'{_hint(key, parameters)};"
            f" it has {', '.join(parameters) or 'none'}"
        )
    hint = parameters[key][1]
    if text.lower() == "none" and type(None) in typing.get_args(hint):
        return None
    adapter: TypeAdapter[Any] = TypeAdapter(hint, config=ConfigDict(allow_inf_nan=False))
    try:
        return adapter.validate_python(text)
    except ValidationError as fault:
        reasons = "; ".join(dict.fromkeys(error["msg"] for error in fault.errors()))
        raise UsageError(f"estimator '{name}': {key}={text}: {reasons}") from fault


def _type_text(hint: Any) -> str:
    if typing.get_origin(hint) is typing.Annotated:
        return _type_text(typing.get_args(hint)[0])
    if typing.get_origin(hint) is typing.Literal:
        return " | ".join(repr(choice) for choice in typing.get_args(hint))
    return hint.__name__ if isinstance(hint, type) else str(hint).replace("typing.", "")


def _default_text(field: Field[Any]) -> str:
    factory = field.default_factory
    return repr(field.default if factory is MISSING else factory())
