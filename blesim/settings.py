"""The base of everything a user may set: frozen, complete, checked when it is built."""

from pydantic import BaseModel, ConfigDict


class Settings(BaseModel):
    """A frozen group of parameters that refuses unknown names, NaN and wrong types.

    Raises
    ------
    pydantic.ValidationError
        With every fault at once; a `ValueError`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)
