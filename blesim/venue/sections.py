"""A product section: a stretch of an aisle with something to buy beside it."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """A stretch of an aisle's centre line.

    Attributes
    ----------
    id : str
        Name on the map.
    category : str
        What is sold there.
    branch : str
        Aisle it belongs to.
    start_m, end_m : tuple of float
        x and y of both ends, on the centre line of the aisle. [m]
    level : int
        Level it is on.
    """

    id: str
    category: str
    branch: str
    start_m: tuple[float, float]
    end_m: tuple[float, float]
    level: int = 0
