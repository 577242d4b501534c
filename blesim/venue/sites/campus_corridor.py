"""The corridors of the paper on map-compensated headings.

Published (digest "map-heading-ekf" and the paper's sections 4 and 5): straight zones B, Z, A and C
with azimuths of 90, 180, 270 and 305 degrees, walked in this order from the west end of B to the
west end of C, and zones BZ, AZ and CA between them where people turn; entries of the straight zones
called Z1, Z2, A1 and A2; 20 beacons "deployed every 10 m throughout the whole corridor", or 15 or
10 along it, or five at key turning points; +4 dBm, "signal emission frequency set to 1 Hz".

The drawing is not published. Assumed: the whole way is the longest of the seven walks of table 2,
211.68 m, which makes 0.67 m of each of the 316 steps; how it divides into zones; how far the
turning zones reach; that the corridors are 2.4 m wide with brick walls; where beacons hang.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray

from blesim.errors import UsageError
from blesim.venue.floor_plan import FloorPlan, Level, Obstacle
from blesim.venue.graph import AisleGraph, Edge, Node
from blesim.venue.sites.parts import Place, beacons, place, rounded
from blesim.venue.venue import Venue

WAY_M = 211.68
WIDTH_M = 2.4
_WALL_M = 0.15
# How far a turning zone reaches from its corner; assumed: people cut into it by three steps.
TURNING_M = 2.0
_HEIGHT_M = 2.2
_MARGIN_M = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Zone:
    """A straight zone: its name, azimuth and length, and what the turn at its end is called.

    [degree], [m]
    """

    name: str
    azimuth_deg: float
    length_m: float
    turn: str = ""


ZONES = (
    Zone(name="B", azimuth_deg=90.0, length_m=60.0, turn="BZ"),
    Zone(name="Z", azimuth_deg=180.0, length_m=30.0, turn="AZ"),
    Zone(name="A", azimuth_deg=270.0, length_m=75.0, turn="CA"),
    Zone(name="C", azimuth_deg=305.0, length_m=46.68),
)
# Names of the way's ends, and of the entries of the zones on both sides of each turn.
_ENDS = ("B/west", "C/west")
_ENTRIES = (("B", "Z1"), ("Z2", "A1"), ("A2", "C"))


def campus_corridor(count: int = 20) -> Venue:
    """The corridors with beacons evenly along them, ``b01`` and so on from the west end of B.

    Parameters
    ----------
    count : int
        Number of beacons: 20 are 10 m apart, others 200 m / count.

    Raises
    ------
    UsageError
        If there are fewer than one, or more than 200.
    """
    if not 1 <= count <= 200:
        raise UsageError(f"{count} beacons: give 1 to 200")
    spacing_m = 200.0 / count
    first_m = (WAY_M - (count - 1) * spacing_m) / 2
    along_m = np.array([first_m + number * spacing_m for number in range(count)])
    return _venue(f"campus corridor, {count} beacons", along_m)


def campus_corridor_keys() -> Venue:
    """The corridors with the five beacons of the map-matching method: both ends and the turns."""
    return _venue("campus corridor, beacons at key points", _corners_along_m())


def _venue(name: str, along_m: NDArray[np.float64]) -> Venue:
    ids = [f"b{number:02d}" for number in range(1, len(along_m) + 1)]
    hung = {each: (*_on_wall(at_m), _HEIGHT_M) for each, at_m in zip(ids, along_m, strict=True)}
    bounds, walls = _walls()
    return Venue(
        name=name,
        floor_plan=FloorPlan(levels=(Level(level=0, bounds=bounds),), obstacles=walls),
        beacons=beacons(hung, tx_power_dbm=4.0, advertising_interval_s=1.0),
        graph=_graph(dict(zip(ids, along_m.tolist(), strict=True))),
    )


def _corners_along_m() -> NDArray[np.float64]:
    """Way from the west end of B to each corner and both ends, (5,). [m]."""
    return np.concatenate([[0.0], np.cumsum([zone.length_m for zone in ZONES])])


def _corners_m() -> NDArray[np.float64]:
    """Both ends and the corners of the centre line, (5, 2). [m]."""
    azimuth_rad = np.radians([zone.azimuth_deg for zone in ZONES])
    ahead = np.stack([np.sin(azimuth_rad), np.cos(azimuth_rad)], axis=1)
    lengths_m = np.array([zone.length_m for zone in ZONES])
    corners_m = np.concatenate([[[0.0, 0.0]], np.cumsum(ahead * lengths_m[:, None], axis=0)])
    return np.asarray(corners_m - corners_m.min(axis=0) + _MARGIN_M)


def _zone_at(along_m: float) -> int:
    """Number of the zone at a way along the centre line; at a corner, that which begins there."""
    row = int(np.searchsorted(_corners_along_m(), along_m, side="right")) - 1
    return min(max(row, 0), len(ZONES) - 1)


def _at(along_m: float, aside_m: float = 0.0) -> Place:
    """Place at a way along the centre line, and so far to its left. [m]."""
    row = _zone_at(along_m)
    azimuth_rad = np.radians(ZONES[row].azimuth_deg)
    east, north = np.sin(azimuth_rad), np.cos(azimuth_rad)
    into_m = along_m - _corners_along_m()[row]
    x_m, y_m = _corners_m()[row]
    return place(x_m + into_m * east - aside_m * north, y_m + into_m * north + aside_m * east)


def _on_wall(along_m: float) -> Place:
    """Place on the left wall, which is the outer one in every turn."""
    return _at(along_m, WIDTH_M / 2)


def _walls() -> tuple[shapely.Polygon, tuple[Obstacle, ...]]:
    """Bounds around the corridors and their walls; and the walls, left and right."""
    centre = shapely.LineString(_corners_m())
    outside = centre.buffer(WIDTH_M / 2 + _WALL_M, cap_style="flat", join_style="mitre")
    # Beyond both ends, so that it cuts the walls in two.
    beyond = shapely.LineString([_at(-1.0), *_corners_m()[1:-1], _at(WAY_M + 1.0)])
    inside = beyond.buffer(WIDTH_M / 2, cap_style="flat", join_style="mitre")
    sides = sorted(shapely.get_parts(outside.difference(inside)), key=lambda side: -side.area)
    return rounded(outside), tuple(
        Obstacle(id=f"{name} wall", outline=rounded(side), material="brick-11cm")
        for name, side in zip(("outer", "inner"), sides, strict=True)
    )


def _graph(beside: dict[str, float]) -> AisleGraph:
    """The centre line: ends, entries, corners, and a node beside each beacon that is elsewhere."""
    along_m = _named_along_m()
    taken_m = np.array(list(along_m.values()))
    along_m |= {
        name: at_m for name, at_m in beside.items() if np.all(np.abs(taken_m - at_m) > 0.01)
    }
    line = sorted(along_m, key=lambda name: along_m[name])
    return AisleGraph(
        nodes=tuple(
            Node(id=name, x_m=_at(along_m[name]).x_m, y_m=_at(along_m[name]).y_m) for name in line
        ),
        edges=tuple(
            Edge(first=a, second=b, branch=_branch_at((along_m[a] + along_m[b]) / 2))
            for a, b in pairwise(line)
        ),
    )


def _named_along_m() -> dict[str, float]:
    """Way from the west end of B to its named places: ends, turns and entries. [m]."""
    corners_m = _corners_along_m().tolist()
    named = dict(zip(_ENDS, (corners_m[0], corners_m[-1]), strict=True))
    for zone, corner_m, entries in zip(ZONES, corners_m[1:-1], _ENTRIES, strict=False):
        named[zone.turn] = corner_m
        named |= dict(zip(entries, (corner_m - TURNING_M, corner_m + TURNING_M), strict=True))
    return named


def _branch_at(along_m: float) -> str:
    """Name of the zone, straight or turning, at a way along the centre line."""
    for zone, corner_m in zip(ZONES[:-1], _corners_along_m()[1:-1], strict=True):
        if abs(along_m - corner_m) < TURNING_M:
            return zone.turn
    return ZONES[_zone_at(along_m)].name
