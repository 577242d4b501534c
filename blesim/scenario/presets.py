"""What a scenario takes from a named preset and changes in places: phones and the radio."""

from collections.abc import Mapping
from typing import Any

from pydantic import Field, field_validator, model_validator

from blesim.imu.step_events import StepSensor
from blesim.radio.environments import ENVIRONMENTS
from blesim.radio.phone import Phone
from blesim.radio.profiles import PROFILES
from blesim.radio.propagation import Propagation
from blesim.settings import Settings

# Two ways of saying the same: whoever takes one takes leave of what the preset says by the other.
_EITHER = (frozenset({"mode"}), frozenset({"interval_ms", "window_ms"}))


class PhoneProfile(Phone):
    """A phone: its radio, and how well it reads steps.

    Attributes
    ----------
    profile : str or None
        A name of `blesim.radio.profiles.PROFILES`: what is not given is taken from there, field by
        field.
    step_sensor : StepSensor
        How well it reads steps.
    """

    profile: str | None = Field(default=None, json_schema_extra={"enum": [*PROFILES, None]})
    step_sensor: StepSensor = StepSensor()

    @model_validator(mode="before")
    @classmethod
    def _over_the_profile(cls, value: object) -> object:
        return over_preset(value, "profile", PROFILES)

    @field_validator("profile")
    @classmethod
    def _known(cls, name: str | None) -> str | None:
        return known_preset(name, PROFILES)


class Radio(Propagation):
    """How signals travel in the venue.

    Attributes
    ----------
    environment : str or None
        A name of `blesim.radio.environments.ENVIRONMENTS`: what is not given is taken from there,
        field by field.
    """

    environment: str | None = Field(default=None, json_schema_extra={"enum": [*ENVIRONMENTS, None]})

    @model_validator(mode="before")
    @classmethod
    def _over_the_environment(cls, value: object) -> object:
        return over_preset(value, "environment", ENVIRONMENTS)

    @field_validator("environment")
    @classmethod
    def _known(cls, name: str | None) -> str | None:
        return known_preset(name, ENVIRONMENTS)


def over_preset(value: object, key: str, presets: Mapping[str, Settings]) -> object:
    """Given fields laid over those of the preset that `key` names; without one, as they are.

    Parameters
    ----------
    value : object
        As read; only a mapping has a preset.
    key : str
        The field with the name; an unknown name is left for `known_preset` to refuse.
    presets : mapping of str to Settings
        By name.
    """
    if not isinstance(value, dict):
        return value
    name = value.get(key)
    if not isinstance(name, str) or name not in presets:
        return _with_tuples(value)
    return _with_tuples(_laid_over(presets[name].model_dump(exclude_unset=True), value))


def known_preset(name: str | None, presets: Mapping[str, Settings]) -> str | None:
    """The name, if there is a preset of that name; `ValueError` otherwise."""
    if name is not None and name not in presets:
        raise ValueError(f"unknown; use one of {', '.join(presets)}")
    return name


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
