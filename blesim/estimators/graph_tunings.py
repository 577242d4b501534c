"""The tuned parameters of the particle filter in the tables of the aisle-graph paper.

Digest "aisle-graph", tables 1 and 3: tuned on the first of its three runs.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from blesim.errors import UsageError

Preset = Literal["table-1-500", "table-3-250", "table-3-1000"]
_MOST_PARTICLES = 1_000_000


def refuse_outside(name: str, value: float, low: float, high: float) -> None:
    """Raise `UsageError` unless a parameter is from `low` to `high`."""
    if not low <= value <= high:
        raise UsageError(f"{name} {value:g}: give a number from {low:g} to {high:g}")


def refuse_unknown(name: str, value: str, known: tuple[str, ...]) -> None:
    """Raise `UsageError` unless a choice is among the known ones."""
    if value not in known:
        raise UsageError(f"{name} '{value}': use one of {', '.join(known)}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Tuning:
    """One row of the tables.

    Attributes
    ----------
    particles : int
        How many.
    spread_same_db, spread_other_db : float
        sigma_p of Eq 8, for a particle on the beacon's branch and for others. [dB]
    velocity_spread_m_s, velocity_limit_m_s : float
        V_d and V_max. [m/s]

    Raises
    ------
    UsageError
        If a parameter is out of its range.
    """

    particles: int
    spread_same_db: float
    spread_other_db: float
    velocity_spread_m_s: float
    velocity_limit_m_s: float

    def __post_init__(self) -> None:
        refuse_outside("particles", self.particles, 1, _MOST_PARTICLES)
        refuse_outside("spread_same_db", self.spread_same_db, 0.01, 100.0)
        refuse_outside("spread_other_db", self.spread_other_db, 0.01, 100.0)
        refuse_outside("velocity_spread_m_s", self.velocity_spread_m_s, 0.0, 100.0)
        refuse_outside("velocity_limit_m_s", self.velocity_limit_m_s, 0.0, 100.0)


PRESETS: Mapping[Preset, Tuning] = MappingProxyType(
    {
        "table-1-500": Tuning(
            particles=500,
            spread_same_db=4.0,
            spread_other_db=6.0,
            velocity_spread_m_s=2.5,
            velocity_limit_m_s=4.0,
        ),
        "table-3-250": Tuning(
            particles=250,
            spread_same_db=4.0,
            spread_other_db=6.0,
            velocity_spread_m_s=3.0,
            velocity_limit_m_s=6.0,
        ),
        "table-3-1000": Tuning(
            particles=1000,
            spread_same_db=4.0,
            spread_other_db=5.0,
            velocity_spread_m_s=2.5,
            velocity_limit_m_s=4.0,
        ),
    }
)
