"""The base of everything a user may set: frozen, complete, checked when it is built."""

import unicodedata
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

# As far as a recording reaches, in metres and in levels.
MAP_LIMIT_M = 1e5
LEVEL_RANGE = (-50, 200)
# Control characters, halves of characters, ends of lines and of paragraphs.
_UNREADABLE = frozenset({"Cc", "Cs", "Zl", "Zp"})
_LONGEST_TOLD = 60


def unreadable(text: str) -> str | None:
    """Reason why a text cannot stand in a line of a message or in a file; None if it can."""
    for character in text:
        if unicodedata.category(character) in _UNREADABLE:
            return f"holds the control character U+{ord(character):04X}; take it out"
    return None


def in_one_line(text: str) -> str:
    """The text for a message: what would break the line is spelt as an escape."""
    escaped = (c if unreadable(c) is None else ascii(c)[1:-1] for c in text)
    return "".join(escaped)


def shortened(text: str) -> str:
    """The text for a message, in one line: its beginning, where it is long."""
    beginning = in_one_line(text[:_LONGEST_TOLD])
    return beginning if len(text) <= _LONGEST_TOLD else f"{beginning}..."


def _readable(text: str) -> str:
    reason = unreadable(text)
    if reason is not None:
        raise ValueError(reason)
    return text


Text = Annotated[str, Field(max_length=1000), AfterValidator(_readable)]
Name = Annotated[str, Field(min_length=1, max_length=200), AfterValidator(_readable)]
MapCoordinate = Annotated[float, Field(ge=-MAP_LIMIT_M, le=MAP_LIMIT_M)]
LevelNumber = Annotated[int, Field(ge=LEVEL_RANGE[0], le=LEVEL_RANGE[1])]


class Settings(BaseModel):
    """A frozen group of parameters that refuses unknown names, NaN and wrong types.

    Raises
    ------
    pydantic.ValidationError
        With every fault at once; a `ValueError`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)
