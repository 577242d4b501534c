"""How blesim compiles its few branchy loops."""

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

P = ParamSpec("P")
R = TypeVar("R")


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Machine code of a function, cached on disk.

    Neither ``fastmath`` nor ``parallel``: both would let the same seed give other bytes on another
    machine. Parallelism is by phones, in processes.
    """
    return cast(Callable[P, R], numba.njit(cache=True, error_model="numpy")(function))
