"""The room with two pairs of beacons of the paper on PDR and four-direction fingerprints.

Published (digest "pdr-fingerprint-kalman"): 16.2 m x 4.8 m, a grid of 0.6 m, four beacons in two
pairs, 6 m apart in each pair, every 100 ms, 0 dBm. The drawings are not published: that one pair
hangs on each long wall, shifted against the other, and how high, is assumed.
"""

import shapely

from blesim.venue.floor_plan import FloorPlan, Level
from blesim.venue.graph import AisleGraph
from blesim.venue.sites.parts import Place, beacons, lanes, place
from blesim.venue.venue import Venue

LENGTH_M, WIDTH_M = 16.2, 4.8
PAIR_M = 6.0
_MIDDLE_M = LENGTH_M / 2
# Assumed: above tables, within reach.
_HEIGHT_M = 1.5
# Lanes for walking, assumed: every fourth line of the grid along the room, two metres apart across.
_COLUMNS, _COLUMN_M = "abcdefg", 2.4
_ROWS_M = (0.6, 2.4, 4.2)


def two_pair_room() -> Venue:
    """The room with two pairs of beacons, 77.8 m2 without obstacles.

    Nodes are ``a1`` to ``g3``: seven columns from west to east, three rows from south to north.
    """
    return Venue(
        name="room with two pairs of beacons",
        floor_plan=FloorPlan(
            levels=(Level(level=0, bounds=shapely.box(0, 0, LENGTH_M, WIDTH_M)),),
        ),
        beacons=beacons(
            {
                "pink-1": (_MIDDLE_M - PAIR_M, 0.0, _HEIGHT_M),
                "pink-2": (_MIDDLE_M, 0.0, _HEIGHT_M),
                "yellow-1": (_MIDDLE_M, WIDTH_M, _HEIGHT_M),
                "yellow-2": (_MIDDLE_M + PAIR_M, WIDTH_M, _HEIGHT_M),
            },
            tx_power_dbm=0.0,
            advertising_interval_s=0.1,
        ),
        graph=_graph(),
    )


def _graph() -> AisleGraph:
    places: dict[str, Place] = {}
    for column, letter in enumerate(_COLUMNS):
        for row, y_m in enumerate(_ROWS_M, start=1):
            places[f"{letter}{row}"] = place(_MIDDLE_M + (column - 3) * _COLUMN_M, y_m)
    rows = range(1, len(_ROWS_M) + 1)
    along = [(f"row {row}", [f"{letter}{row}" for letter in _COLUMNS]) for row in rows]
    across = [(f"column {letter}", [f"{letter}{row}" for row in rows]) for letter in _COLUMNS]
    return lanes(places, [*along, *across])
