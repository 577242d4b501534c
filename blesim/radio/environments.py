"""How signals travel in four kinds of building, and in an anechoic chamber: the presets.

``fitted`` numbers come from the functions of `blesim.fidelity` named beside them, which anybody who
has the recordings can run again, and a test does; what is ``assumed`` says so. How well the presets
do on the parts of the recordings they were not fitted on is what ``blesim fidelity`` tells.
"""

from collections.abc import Mapping
from types import MappingProxyType

from blesim.radio.fading import Fading
from blesim.radio.people import People
from blesim.radio.propagation import Propagation
from blesim.radio.shadowing import Shadowing

# fitted: fit_hall on set 1 of the philotuxo points. Links that stand still differ more between
# channels than correlated multipath allows, whatever its strength: the correlation of 0.30 to 0.43
# measured between channels while walking is the shadowing they share. Nobody held the beacon, so
# that people are the office's.
_HALL = Propagation(
    path_loss_exponent=1.55,
    shadowing=Shadowing(standard_deviation_db=2.7, decorrelation_m=4.0),
    fading=Fading(rice_factor_db=0.7, channel_correlation=0.0),
    people=People(body_loss_db=8.0, sway_m=0.02, sway_s=6.0),
)

# fitted: body, multipath and sway, fit_rooms on ear and back pocket in the conference room of
# mitll_static. measured: exponent and spread, a regression on the office zone of
# doi:10.5281/zenodo.1618692. assumed: the reach of the shadowing.
_OFFICE = Propagation(
    path_loss_exponent=1.96,
    shadowing=Shadowing(standard_deviation_db=3.4, decorrelation_m=1.3),
    fading=Fading(rice_factor_db=-3.0, channel_correlation=0.06),
    people=People(body_loss_db=8.0, sway_m=0.02, sway_s=6.0),
)

# fitted: exponent, spread, body and multipath, fit_library on campaign 2 of uji_library, obstacles
# being those of the floor plan. assumed: the reach of the shadowing (campaign 2 shows none left at
# 1.8 m, its closest points), channels as in the hall, sway as in the office.
_LIBRARY = Propagation(
    path_loss_exponent=2.35,
    shadowing=Shadowing(standard_deviation_db=4.8, decorrelation_m=1.3),
    fading=Fading(rice_factor_db=7.8, channel_correlation=0.0),
    people=People(body_loss_db=8.2, sway_m=0.02, sway_s=6.0),
)

# assumed, all of it: no recording of a supermarket with positions is public. Between its gondolas
# as in the library, whose shelves stand as close; above them as open as the hall.
_SUPERMARKET = Propagation(
    path_loss_exponent=2.0,
    shadowing=Shadowing(standard_deviation_db=4.5, decorrelation_m=1.3),
    fading=Fading(rice_factor_db=0.7, channel_correlation=0.0),
    people=People(body_loss_db=8.0, sway_m=0.02, sway_s=6.0),
)

# fitted: body, multipath and sway, fit_rooms on ear and back pocket in the anechoic chamber of
# mitll_static; what remains of multipath there goes around the carrier's body. Free space has an
# exponent of 2. assumed: that the chamber casts no shadows.
_CHAMBER = Propagation(
    path_loss_exponent=2.0,
    shadowing=Shadowing(standard_deviation_db=0.0),
    fading=Fading(rice_factor_db=-6.0, channel_correlation=0.8),
    people=People(body_loss_db=19.7, sway_m=0.02, sway_s=4.0),
)

ENVIRONMENTS: Mapping[str, Propagation] = MappingProxyType(
    {
        "hall": _HALL,
        "office": _OFFICE,
        "library": _LIBRARY,
        "supermarket": _SUPERMARKET,
        "chamber": _CHAMBER,
    }
)
