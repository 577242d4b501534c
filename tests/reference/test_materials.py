"""The published losses, and the slab formula of ITU-R P.2040 for those that come from it."""

import cmath
from math import log10, pi

import pytest

from blesim.venue.materials import MATERIALS

FREQUENCY_GHZ = 2.44
SPEED_OF_LIGHT_M_S = 299_792_458.0


def slab_loss_db(a: float, b: float, c: float, d: float, thickness_m: float) -> float:
    """Transmission loss of a single slab at normal incidence as ITU-R P.2040-3 gives it.

    Relative permittivity ``a f^b``, conductivity ``c f^d`` S/m, f in GHz.
    """
    permittivity = a * FREQUENCY_GHZ**b - 1j * 17.98 * c * FREQUENCY_GHZ**d / FREQUENCY_GHZ
    root = cmath.sqrt(permittivity)
    reflection = (1 - root) / (1 + root)
    phase = 2 * pi * thickness_m * FREQUENCY_GHZ * 1e9 / SPEED_OF_LIGHT_M_S * root
    through = (1 - reflection**2) * cmath.exp(-1j * phase)
    through /= 1 - reflection**2 * cmath.exp(-2j * phase)
    return -20 * log10(abs(through))


@pytest.mark.parametrize(
    ("name", "parameters", "thickness_m"),
    [
        # Table 3 of ITU-R P.2040-3: a, b, c, d of each class of material.
        ("concrete-10cm", (5.24, 0.0, 0.0462, 0.7822), 0.10),
        ("concrete-20cm", (5.24, 0.0, 0.0462, 0.7822), 0.20),
        ("brick-11cm", (3.91, 0.0, 0.0238, 0.16), 0.115),
        ("wood-4cm", (1.99, 0.0, 0.0047, 1.0718), 0.04),
        ("glass-6mm", (6.31, 0.0, 0.0036, 1.3394), 0.006),
    ],
)
def test_slabs(
    name: str, parameters: tuple[float, float, float, float], thickness_m: float
) -> None:
    loss_db = slab_loss_db(*parameters, thickness_m)
    assert MATERIALS[name].crossing_db == pytest.approx(loss_db, abs=0.06)


@pytest.mark.parametrize(("name", "loss_db"), [("light-wall", 3.4), ("heavy-wall", 6.9)])
def test_cost_231_walls(name: str, loss_db: float) -> None:
    # COST Action 231 final report, 1999, section 4.7.2: L_w1 and L_w2 of the multi-wall model.
    assert MATERIALS[name].crossing_db == loss_db
