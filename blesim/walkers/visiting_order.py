"""In which order a shopper goes to the sections of a list."""

import numpy as np
from numpy.typing import NDArray

from blesim.kernels import kernel


def nearest_next(
    wanted: NDArray[np.int64], from_start_m: NDArray[np.float64], between_m: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Wanted sections, each the nearest to the one before; the first the nearest to the start.

    Parameters
    ----------
    wanted : ndarray of int64, (n,)
        Rows of sections, each once.
    from_start_m : ndarray of float64, (sections,)
        Way to each section from where the shopper begins. [m]
    between_m : ndarray of float64, (sections, sections)
        Way from the row's section to the column's. [m]

    Returns
    -------
    ndarray of int64, (n,)
        The first of `wanted` where several are equally near.
    """
    order = wanted.copy()
    _sort_by_nearness(order, from_start_m, between_m)
    return order


@kernel
def _sort_by_nearness(
    order: NDArray[np.int64], from_start_m: NDArray[np.float64], between_m: NDArray[np.float64]
) -> None:
    for done in range(len(order)):
        best = done
        for row in range(done, len(order)):
            if done == 0:
                nearer = from_start_m[order[row]] < from_start_m[order[best]]
            else:
                here = order[done - 1]
                nearer = between_m[here, order[row]] < between_m[here, order[best]]
            if nearer:
                best = row
        chosen = order[best]
        for row in range(best, done, -1):
            order[row] = order[row - 1]
        order[done] = chosen


def along_circuit(
    wanted: NDArray[np.int64], circuit: NDArray[np.int64], gates: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Sections that a full circuit of the store passes, and whether the shopper stops there.

    Parameters
    ----------
    wanted : ndarray of int64, (n,)
        Rows of sections.
    circuit : ndarray of int64, (sections,)
        All sections in the order in which the circuit comes to them.
    gates : ndarray of int64, (aisles,)
        One section of every aisle, which everybody passes.

    Returns
    -------
    sections : ndarray of int64, (m,)
        Wanted ones and gates, each once.
    stops : ndarray of bool, (m,)
    """
    here = np.isin(circuit, wanted) | np.isin(circuit, gates)
    sections = circuit[here]
    return sections, np.isin(sections, wanted)
