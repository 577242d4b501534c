"""The H-shaped floor of the paper on beacon proximity.

Published (digest "proximity-particle-filter"): an H-shaped enterable area, 9 beacons on floor or
ceiling, a walk of 70 m with six turns and two read-out points, and, for the probability of Near, a
square of 7.5 m in cells of 30 cm around a beacon on the floor that faces west.

The drawing is not published. Assumed: two corridors 3 m wide joined by a hall of 8 m x 8 m, which
holds the square; that what cannot be entered costs as much as concrete; where beacons hang; that
they send with 0 dBm and ten times a second, as Apple asks of an iBeacon. Which way they face
matters, says the paper, but not how much: here they send alike to all sides.
"""

import shapely

from blesim.venue.beacons import Beacon
from blesim.venue.floor_plan import FloorPlan, Level
from blesim.venue.graph import AisleGraph
from blesim.venue.sites.parts import Place, beacons, block, lanes, place
from blesim.venue.venue import Venue

WIDTH_M, LENGTH_M = 14.0, 21.0
_CORRIDOR_M, _HALL_M = 3.0, 8.0
_HALL = (6.5, 14.5)
_CEILING_M = 2.7
# Centres of the corridors, and of the way across the hall: beside the beacon on its floor.
_WEST_M, _EAST_M, _ACROSS_M = 1.5, 12.5, 11.1
# The way ends 2.5 m before the walls. Three times up and down and twice across are 70 m.
_SOUTH_M, _NORTH_M = 2.5, 18.5


def h_floor() -> Venue:
    """The H-shaped floor: 190 m2 to walk on, and a block without entry above and below the hall.

    Nodes are the ends ``west/south`` to ``east/north``, the junctions ``west`` and ``east`` at the
    hall, and the read-out points ``point-1`` and ``point-2``.
    """
    west_m, east_m = _CORRIDOR_M, WIDTH_M - _CORRIDOR_M
    return Venue(
        name="H-shaped floor",
        floor_plan=FloorPlan(
            levels=(Level(level=0, bounds=shapely.box(0, 0, WIDTH_M, LENGTH_M)),),
            # Two heavy walls cost 13.8 dB (COST 231), this 14.8.
            obstacles=(
                block("south block", (west_m, 0, east_m, _HALL[0]), "concrete-20cm"),
                block("north block", (west_m, _HALL[1], east_m, LENGTH_M), "concrete-20cm"),
            ),
        ),
        beacons=_beacons(),
        graph=_graph(),
    )


def _beacons() -> tuple[Beacon, ...]:
    """One on the floor of the hall, four on the ceiling of each corridor."""
    ceiling = {
        f"{side}{number}": (x_m, y_m, _CEILING_M)
        for side, x_m in (("w", _WEST_M), ("e", _EAST_M))
        for number, y_m in enumerate((2.5, 7.8, 13.2, 18.5), start=1)
    }
    hung = {"hall": (WIDTH_M / 2, LENGTH_M / 2, 0.0)} | ceiling
    return beacons(hung, tx_power_dbm=0.0, advertising_interval_s=0.1)


def _graph() -> AisleGraph:
    places: dict[str, Place] = {}
    for side, x_m in (("west", _WEST_M), ("east", _EAST_M)):
        places[f"{side}/south"] = place(x_m, _SOUTH_M)
        places[side] = place(x_m, _ACROSS_M)
        places[f"{side}/north"] = place(x_m, _NORTH_M)
    places |= {"point-1": place(_WEST_M, 6.0), "point-2": place(_EAST_M, 15.5)}
    return lanes(
        places,
        [
            ("west corridor", ["west/south", "point-1", "west", "west/north"]),
            ("hall", ["west", "east"]),
            ("east corridor", ["east/south", "east", "point-2", "east/north"]),
        ],
    )
