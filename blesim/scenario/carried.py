"""How a tester carries the phone, as a scenario tells it."""

from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema

from blesim.settings import Settings

CarryingName = Literal["hand", "flat", "swinging", "pocket", "bag", "trolley"]


class CarriedFrom(Settings):
    """A way of carrying the phone, from some time of the walk on.

    Attributes
    ----------
    carrying : str
        ``hand``: in front of the body; ``flat``: held level there; ``swinging``: in the hand of a
        swinging arm; ``pocket``; ``bag``; ``trolley``.
    after_s : float
        How long after the start of the walk. [s]
    """

    carrying: CarryingName
    after_s: float = Field(default=0.0, ge=0, le=31 * 86400)


def _throughout(value: Any) -> Any:
    """A way of carrying that is given by its name holds from the start on."""
    if isinstance(value, str):
        return ({"carrying": value},)
    # What comes out of a validator of ours no longer counts as JSON, which has no tuples.
    return tuple(value) if isinstance(value, list) else value


def _one_after_the_other(carrying: tuple[CarriedFrom, ...]) -> tuple[CarriedFrom, ...]:
    after_s = [each.after_s for each in carrying]
    if not after_s or after_s[0] != 0 or any(b <= a for a, b in pairwise(after_s)):
        raise ValueError("give at least one way, the first from 0 s on, each later than before")
    return carrying


_SCHEMA = {
    "anyOf": [
        {"type": "string", "enum": ["hand", "flat", "swinging", "pocket", "bag", "trolley"]},
        {"type": "array", "minItems": 1, "items": CarriedFrom.model_json_schema()},
    ]
}
# One way throughout, or several in order of time.
Carried = Annotated[
    tuple[CarriedFrom, ...],
    BeforeValidator(_throughout),
    AfterValidator(_one_after_the_other),
    WithJsonSchema(_SCHEMA),
]
IN_HAND = (CarriedFrom(carrying="hand"),)
