"""How signals travel in a venue: the sum of all models of the air."""

from typing import Literal

from pydantic import Field

from blesim.radio.advertising import Advertising
from blesim.radio.collisions import Collisions
from blesim.radio.fading import Fading
from blesim.radio.people import People
from blesim.radio.shadowing import Shadowing
from blesim.radio.stock import Stock
from blesim.settings import Settings


class Propagation(Settings):
    """How signals travel in a venue; obstacles come from its floor plan.

    Attributes
    ----------
    path_loss_model : str
        ``log-distance``: from the measured power at one metre with the exponents below;
        ``itu-office``, ``itu-corridor``: ITU-R P.1238-11, line of sight, from the transmit power.
    path_loss_exponent : float
        On the line of sight. [-]
    obstructed_exponent : float or None
        Where an obstacle stands between, if another; the obstacle's own loss comes on top. [-]
    level_height_m : float
        From floor to floor. [m]
    traffic_loss : float
        Share of packets lost to other traffic at 2.4 GHz, whatever their strength. [-]
    advertising, shadowing, fading, people, collisions, stock
        See there.
    """

    path_loss_model: Literal["log-distance", "itu-office", "itu-corridor"] = "log-distance"
    path_loss_exponent: float = Field(default=2.0, gt=0, le=8)
    obstructed_exponent: float | None = Field(default=None, gt=0, le=8)
    level_height_m: float = Field(default=4.0, gt=1, le=20)
    traffic_loss: float = Field(default=0.0, ge=0, le=1)
    advertising: Advertising = Advertising()
    shadowing: Shadowing = Shadowing()
    fading: Fading = Fading()
    people: People = People()
    collisions: Collisions = Collisions()
    stock: Stock = Stock()
