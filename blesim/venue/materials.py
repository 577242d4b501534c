"""What obstacles are made of: loss at 2.4 GHz, with where each number comes from.

ITU-R P.2040 rows are the slab transmission loss of one leaf at 2.44 GHz and normal incidence;
COST 231 rows are the light and heavy wall of its multi-wall model. Measured rows are regressions
on the library recordings of Mendoza-Silva et al. (doi:10.5281/zenodo.1618692) and are lower bounds,
since packets too weak to arrive do not count. No primary number was found for supermarket gondolas;
theirs are assumptions.
"""

from types import MappingProxyType

from pydantic import Field

from blesim.settings import Settings


class Material(Settings):
    """Loss of a radio link through one obstacle.

    Attributes
    ----------
    crossing_db : float
        Loss of each crossing, however long. [dB]
    metre_db : float
        Loss of each metre inside the obstacle, added to that of the crossing. [dB/m]
    stocked : bool
        Whether the loss is that of what stands in it, and varies with it.
    source : str
        Where the numbers come from.
    """

    crossing_db: float = Field(ge=0)
    metre_db: float = Field(ge=0, default=0.0)
    stocked: bool = False
    source: str


_P2040 = "ITU-R P.2040, single slab at 2.44 GHz, normal incidence"
_COST231 = "COST 231 final report, multi-wall model"
_UJI = "measured, doi:10.5281/zenodo.1618692, lower bound"
_ASSUMED = "assumed"

MATERIALS = MappingProxyType(
    {
        "plasterboard": Material(crossing_db=1.1, source=_P2040),
        "wood-4cm": Material(crossing_db=0.6, source=_P2040),
        "glass-6mm": Material(crossing_db=1.9, source=_P2040),
        "brick-11cm": Material(crossing_db=3.7, source=_P2040),
        "concrete-10cm": Material(crossing_db=8.1, source=_P2040),
        "concrete-20cm": Material(crossing_db=14.8, source=_P2040),
        "light-wall": Material(crossing_db=3.4, source=_COST231),
        "heavy-wall": Material(crossing_db=6.9, source=_COST231),
        "bookcase": Material(crossing_db=1.45, stocked=True, source=_UJI),
        "pillar": Material(crossing_db=2.05, source=_UJI),
        "office-partition": Material(crossing_db=2.05, source=_UJI),
        "gondola-dry": Material(crossing_db=3.0, stocked=True, source=_ASSUMED),
        "gondola-liquid": Material(crossing_db=9.0, stocked=True, source=_ASSUMED),
    }
)
