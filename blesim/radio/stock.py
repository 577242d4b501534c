"""What stands on the shelves: their loss varies along them, and from hour to hour."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim.rng import Draws
from blesim.settings import Settings
from blesim.units import to_us
from blesim.venue.floor_plan import Obstacle
from blesim.venue.line_of_sight import bays_of


class Stock(Settings):
    """How unevenly shelves are filled; obstacles that are not stocked stay as they are.

    Attributes
    ----------
    spread : float
        Standard deviation of a bay's loss over the mean, cut off at 0 and 2; assumed. [-]
    bay_m : float
        Length of shelf that is filled alike: a shelf unit of 2.7 m. [m]
    change : float
        Share of the variance that is drawn anew after each `hold_s`. [-]
    hold_s : float
        How long a bay stays as it is. [s]
    """

    spread: float = Field(default=0.0, ge=0, le=1)
    bay_m: float = Field(default=2.7, gt=0.1, le=100)
    change: float = Field(default=0.0, ge=0, le=1)
    hold_s: float = Field(default=3600.0, gt=1, le=86400 * 30)

    @property
    def hold_us(self) -> int:
        """How long a bay stays as it is. [us]."""
        return to_us(self.hold_s)


@lru_cache(maxsize=16)
def stock_levels(
    stock: Stock, obstacles: tuple[Obstacle, ...], seed: int, spell: int
) -> NDArray[np.float64]:
    """Factor of the loss of each bay of each obstacle while a spell of `hold_s` lasts.

    Parameters
    ----------
    stock : Stock
        How uneven.
    obstacles : tuple of Obstacle
        Those of one level.
    seed : int
        Of the simulation.
    spell : int
        The how-manieth spell.

    Returns
    -------
    ndarray of float64, (number of obstacles, largest number of bays)
        1 where nothing is stocked. [-]
    """
    bays = [bays_of(obstacle.outline, stock.bay_m) for obstacle in obstacles]
    levels = np.ones((len(obstacles), max(bays, default=1)))
    for row, obstacle in enumerate(obstacles):
        if obstacle.loss.stocked and stock.spread > 0:
            draws = Draws(seed=seed, purpose="stock", walker=obstacle.id)
            kept = draws.normals(np.arange(bays[row]))[:, 0]
            now = Draws(seed=seed, purpose=f"stock {spell}", walker=obstacle.id)
            fresh = now.normals(np.arange(bays[row]))[:, 0]
            deviate = np.sqrt(1.0 - stock.change) * kept + np.sqrt(stock.change) * fresh
            levels[row, : bays[row]] = np.clip(1.0 + stock.spread * deviate, 0.0, 2.0)
    levels.flags.writeable = False
    return levels
