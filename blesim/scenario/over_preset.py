"""Settings laid over those of a named preset."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema
from pydantic_core.core_schema import no_info_after_validator_function

from blesim.settings import Settings

Presets = Mapping[str, Settings]
# Two ways of saying the same: whoever takes one takes leave of what the preset says by the other.
_EITHER = (frozenset({"mode"}), frozenset({"interval_ms", "window_ms"}))


@dataclass(frozen=True, slots=True)
class KnownIn:
    """Marks a field that holds the name of one of some presets, or none."""

    presets: Presets

    def __get_pydantic_core_schema__(
        self, source: type[str], handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Check the name."""
        return no_info_after_validator_function(self._check, handler(source))

    def __get_pydantic_json_schema__(
        self, core_schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """Tell editors the names."""
        return handler(core_schema) | {"enum": [*self.presets, None]}

    def _check(self, name: str | None) -> str | None:
        if name is not None and name not in self.presets:
            raise ValueError(f"unknown; use one of {', '.join(self.presets)}")
        return name


class OverPreset(Settings):
    """Settings over those of a preset: what is not given is taken from there, field by field."""

    KEY: ClassVar[str]
    PRESETS: ClassVar[Presets]

    @model_validator(mode="before")
    @classmethod
    def _over_the_preset(cls, value: object) -> object:
        return over_preset(value, cls.KEY, cls.PRESETS)


def over_preset(value: object, key: str, presets: Mapping[str, Settings]) -> object:
    """Given fields laid over those of the preset that `key` names; without one, as they are.

    Parameters
    ----------
    value : object
        As read; only a mapping has a preset.
    key : str
        The field with the name; an unknown name is left for `KnownIn` to refuse.
    presets : mapping of str to Settings
        By name.
    """
    if not isinstance(value, dict):
        return value
    name = value.get(key)
    if not isinstance(name, str) or name not in presets:
        return _with_tuples(value)
    return _with_tuples(_laid_over(presets[name].model_dump(exclude_unset=True), value))


def _laid_over(base: dict[str, Any], given: dict[str, Any]) -> dict[str, Any]:
    merged = dict(base)
    for one, other in (_EITHER, _EITHER[::-1]):
        if one & given.keys():
            merged = {name: value for name, value in merged.items() if name not in other}
    for name, value in given.items():
        both = isinstance(value, dict) and isinstance(merged.get(name), dict)
        merged[name] = _laid_over(merged[name], value) if both else value
    return merged


def _with_tuples(value: Any) -> Any:
    """The same with tuples for lists, which a strict model does not take once JSON is parsed."""
    if isinstance(value, dict):
        return {name: _with_tuples(item) for name, item in value.items()}
    return tuple(map(_with_tuples, value)) if isinstance(value, list) else value
