"""How blesim compiles its few branchy loops."""

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

P = ParamSpec("P")
R = TypeVar("R")


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Machine code of a function, cached on disk where there is a place for it.

    Neither ``fastmath`` nor ``parallel``: both would let the same seed give other bytes on another
    machine. Parallelism is by phones, in processes.
    """
    try:
        return _compiled(function, cache=True)
    except RuntimeError as fault:
        # Neither beside the source nor in the user's home may anything be written.
        if "no locator available" not in str(fault):
            raise
        return _compiled(function, cache=False)


def _compiled(function: Callable[P, R], *, cache: bool) -> Callable[P, R]:
    return cast(Callable[P, R], numba.njit(cache=cache, error_model="numpy")(function))
