"""Fading: fast variation of the level from packet to packet."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim.settings import Settings


class Fading(Settings):
    """Which fading, and how much.

    Attributes
    ----------
    model : str
        ``gaussian``: an independent normal deviate in dB for every packet, as published
        simulations assume; ``none``.
    standard_deviation_db : float
        Spread of the Gaussian. [dB]
    """

    model: Literal["gaussian", "none"] = "gaussian"
    standard_deviation_db: float = Field(default=3.0, ge=0, le=20)

    def of_db(self, deviates: NDArray[np.float64]) -> NDArray[np.float64]:
        """Fading of packets, + stronger, from one standard normal deviate each, (n,). [dB]."""
        spread_db = self.standard_deviation_db if self.model == "gaussian" else 0.0
        return spread_db * deviates
