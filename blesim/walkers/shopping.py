"""Shopping lists as they are drawn, and whims on the way."""

import numpy as np
from numpy.typing import NDArray

from blesim.rng import Draws, normals_of
from blesim.walkers.trading_day import Basket, Detours, Spread


def basket_size(basket: Basket, normal: float, most: int) -> int:
    """Number of sections of a drawn list: log-normal, from 1 to `most`.

    Parameters
    ----------
    basket : Basket
        Mean and standard deviation.
    normal : float
        N(0, 1). [-]
    most : int
        Number of sections there are.
    """
    variance = np.log1p((basket.spread / basket.mean) ** 2)
    size = np.exp(np.log(basket.mean) - variance / 2 + np.sqrt(variance) * normal)
    return int(np.clip(np.round(size), 1, most))


def drawn_sections(
    count: int, weights: NDArray[np.float64], seed: int, shopper: str
) -> NDArray[np.int64]:
    """Different sections, drawn one after the other by their weights among those left.

    The first of exponential clocks with the weights as rates [1]_.

    Parameters
    ----------
    count : int
        How many; fewer where fewer have a weight.
    weights : ndarray of float64, (sections,)
        Not negative. [-]
    seed, shopper : int, str
        Address of the draws.

    Returns
    -------
    ndarray of int64, (count,)

    References
    ----------
    .. [1] P. S. Efraimidis, P. G. Spirakis, "Weighted random sampling with a reservoir",
       Information Processing Letters 97, 2006. doi:10.1016/j.ipl.2005.11.003
    """
    rows = np.arange((len(weights) + 3) // 4)
    draws = Draws(seed=seed, purpose="basket", walker=shopper).uniforms(rows)
    uniforms = draws.reshape(-1)[: len(weights)]
    clocks = np.full(len(weights), np.inf)
    wanted = weights > 0
    clocks[wanted] = -np.log(uniforms[wanted]) / weights[wanted]
    return np.argsort(clocks, kind="stable")[: min(count, int(wanted.sum()))]


def with_detours(
    sections: NDArray[np.int64],
    stops: NDArray[np.bool_],
    neighbours: NDArray[np.int64],
    detours: Detours,
    uniforms: NDArray[np.float64],
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """A list with ways past other sections before, and impulse stops after, some of its stops.

    Parameters
    ----------
    sections, stops : ndarray, (n,)
        Where the way leads, and whether the shopper stops there.
    neighbours : ndarray of int64, (sections, k)
        What a shopper may see on impulse.
    detours : Detours
        How often.
    uniforms : ndarray of float64, (n, 4)
        U(0, 1). [-]

    Returns
    -------
    tuple of ndarray
        Like `sections` and `stops`, longer.
    """
    out: list[tuple[int, bool]] = []
    strays = stops & (uniforms[:, 0] < detours.probability)
    impulses = stops & (uniforms[:, 1] < detours.impulse_probability)
    if not (strays.any() or impulses.any()):
        return sections, stops
    for row, section in enumerate(sections.tolist()):
        if strays[row]:
            out.append((int(uniforms[row, 2] * len(neighbours)), False))
        out.append((section, bool(stops[row])))
        if impulses[row] and neighbours.shape[1]:
            seen = int(uniforms[row, 3] * neighbours.shape[1])
            out.append((int(neighbours[section, seen]), True))
    longer = np.array(out)
    return longer[:, 0].astype(np.int64), longer[:, 1].astype(np.bool_)


def times_us(spread: Spread, uniforms: NDArray[np.float64]) -> NDArray[np.int64]:
    """Log-normal times of U(0, 1) numbers, same shape, at most a day. [us]."""
    seconds = spread.median_s * np.exp(spread.spread * normals_of(uniforms))
    return np.round(np.minimum(seconds, 86400.0) * 1e6).astype(np.int64)
