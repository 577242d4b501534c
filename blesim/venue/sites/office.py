"""The office of the paper on channel-separate regression, with its dense and its sparse beacons.

Published (digest "channel-separate-ekf" and the paper's section 4.1): 60 m x 40 m, beacons on walls
about 1.5 m high, 10 Hz, -16 dBm; dense 20 beacons, "average: 1 beacon per 9 m", sparse 8, one per
18 m. How strong the beacons are the paper tells by what is heard: 5 to 19 channels at a time with
the dense ones and 0 to 9 with the sparse ones (figure 11), which takes -73 dBm at 1 m in an office
as they were measured. Path loss fitted there on what arrives, as in Eq 32, has -78 dBm at 1 m and
an exponent of 1.4; the paper's example channel -79.6 dBm and 1.3.

The drawing is not published. Assumed: corridors 2 m wide, a ring and a middle aisle of 180 m
together, which hold 20 beacons 9 m apart; two aisles that cross it; rooms along the outer walls,
meeting rooms in the middle, desks with partitions beside them; doors closed.
"""

from collections.abc import Iterator
from itertools import pairwise

import shapely

from blesim.venue.beacons import Beacon
from blesim.venue.floor_plan import FloorPlan, Level, Obstacle
from blesim.venue.graph import AisleGraph
from blesim.venue.sites.parts import beacons, lanes, place, wall
from blesim.venue.venue import Venue

LENGTH_M, WIDTH_M = 60.0, 40.0
HEIGHT_M = 1.5
_HALF_AISLE_M, _WALL_M = 1.0, 0.1
# Centre lines: of the ring, of the middle aisle, of the aisles across.
_WEST_M, _EAST_M, _SOUTH_M, _NORTH_M = 8.0, 52.0, 8.0, 32.0
_MIDDLE_M, _ACROSS_M = 20.0, (22.0, 38.0)
_RING = shapely.LinearRing(
    [(_WEST_M, _SOUTH_M), (_EAST_M, _SOUTH_M), (_EAST_M, _NORTH_M), (_WEST_M, _NORTH_M)]
)
# The outer wall of the ring, a side for each of its sides.
_OUTER = shapely.box(7.0, 7.0, 53.0, 33.0).exterior
# Desks are hidden behind partitions of this height; assumed.
_PARTITION_M = 1.6


def office_dense() -> Venue:
    """The office with 20 beacons: 15 along the ring, 5 along the middle aisle."""
    return _office("office, dense beacons", 15, (11.8, 20.8, 30.0, 39.2, 48.2))


def office_sparse() -> Venue:
    """The office with 8 beacons: 7 along the ring, one in the middle."""
    return _office("office, sparse beacons", 7, (30.0,))


def _office(name: str, ring_count: int, middle_x_m: tuple[float, ...]) -> Venue:
    bounds = shapely.box(0, 0, LENGTH_M, WIDTH_M)
    return Venue(
        name=name,
        floor_plan=FloorPlan(
            levels=(Level(level=0, bounds=bounds),),
            obstacles=(*_ring_walls(), *_room_walls(), *_inner_walls()),
        ),
        beacons=_beacons(ring_count, middle_x_m),
        graph=_graph(),
    )


def _beacons(ring_count: int, middle_x_m: tuple[float, ...]) -> tuple[Beacon, ...]:
    """Evenly along the outer wall of the ring, half a spacing off its corner; in the middle."""
    spacing_m = _RING.length / ring_count
    hung = {}
    for number in range(ring_count):
        centre = _RING.interpolate((number + 0.5) * spacing_m)
        on_wall = _OUTER.interpolate(_OUTER.project(centre))
        hung[f"r{number + 1:02d}"] = (on_wall.x, on_wall.y, HEIGHT_M)
    for number, x_m in enumerate(middle_x_m, start=1):
        hung[f"m{number}"] = (x_m, _MIDDLE_M + _HALF_AISLE_M, HEIGHT_M)
    return beacons(
        hung,
        tx_power_dbm=-16.0,
        advertising_interval_s=0.1,
        measured_power_dbm=-73.0,
        # Assumed: of the two kinds of beacon that were measured, that which differs less. The
        # paper's figure 1 differs more, but within what multipath does in offices.
        channel_gain_db=(0.7, 0.5, -1.2),
    )


def _ring_walls() -> Iterator[Obstacle]:
    """Outer walls of the ring, their faces on it."""
    low, east, north = 7.0 - _WALL_M / 2, 53.0 + _WALL_M / 2, 33.0 + _WALL_M / 2
    far = _WALL_M / 2
    for name, start, end in (
        ("south", (low - far, low), (east + far, low)),
        ("north", (low - far, north), (east + far, north)),
        ("west", (low, low + far), (low, north - far)),
        ("east", (east, low + far), (east, north - far)),
    ):
        yield wall(f"ring {name}", start, end, material="light-wall", thickness_m=_WALL_M)


def _room_walls() -> Iterator[Obstacle]:
    """Walls between the rooms along the outer walls."""
    for number, x_m in enumerate((6.95, 14.6, 22.3, 30.0, 37.7, 45.4, 53.05), start=1):
        for side, low_m, high_m in (("s", 0.0, 6.9), ("n", 33.1, WIDTH_M)):
            yield wall(
                f"room {side}{number}",
                (x_m, low_m),
                (x_m, high_m),
                material="light-wall",
                thickness_m=_WALL_M,
            )
    for number, y_m in enumerate((15.6, 24.4), start=1):
        for side, low_m, high_m in (("w", 0.0, 6.9), ("e", 53.1, LENGTH_M)):
            yield wall(
                f"room {side}{number}",
                (low_m, y_m),
                (high_m, y_m),
                material="light-wall",
                thickness_m=_WALL_M,
            )


def _inner_walls() -> Iterator[Obstacle]:
    """Meeting rooms between the aisles across, partitions in the blocks beside them."""
    aisles_m = pairwise((_WEST_M, *_ACROSS_M, _EAST_M))
    for column, (left_m, right_m) in zip(("west", "mid", "east"), aisles_m, strict=True):
        west_m, east_m = left_m + _HALF_AISLE_M, right_m - _HALF_AISLE_M
        for row, low_m, high_m in (("south", 9.0, 19.0), ("north", 21.0, 31.0)):
            name = f"{column} {row}"
            if column == "mid":
                yield from _meeting_room(name, west_m, low_m, east_m, high_m)
            else:
                towards_north = row == "south"
                yield from _desks(name, west_m, low_m, east_m, high_m, towards_north=towards_north)


def _meeting_room(
    name: str, west_m: float, south_m: float, east_m: float, north_m: float
) -> Iterator[Obstacle]:
    """Four walls just inside a rectangle."""
    half = _WALL_M / 2
    for side, start, end in (
        ("s", (west_m, south_m + half), (east_m, south_m + half)),
        ("n", (west_m, north_m - half), (east_m, north_m - half)),
        ("w", (west_m + half, south_m + _WALL_M), (west_m + half, north_m - _WALL_M)),
        ("e", (east_m - half, south_m + _WALL_M), (east_m - half, north_m - _WALL_M)),
    ):
        yield wall(f"{name} {side}", start, end, material="light-wall", thickness_m=_WALL_M)


def _desks(
    name: str,
    west_m: float,
    south_m: float,
    east_m: float,
    north_m: float,
    *,
    towards_north: bool,
) -> Iterator[Obstacle]:
    """A partition along the middle aisle, and two between rows of desks."""
    half = _WALL_M / 2
    aside_m = north_m - half if towards_north else south_m + half
    rows = (
        ("aisle", west_m, east_m, aside_m),
        ("desks 1", west_m + 1.5, east_m - 1.5, south_m + (north_m - south_m) / 3),
        ("desks 2", west_m + 1.5, east_m - 1.5, south_m + 2 * (north_m - south_m) / 3),
    )
    for what, start_m, end_m, y_m in rows:
        yield wall(
            f"{name} {what}",
            (start_m, y_m),
            (end_m, y_m),
            material="office-partition",
            thickness_m=_WALL_M,
            height_m=_PARTITION_M,
        )


def _graph() -> AisleGraph:
    """Centre lines; nodes at corners and junctions alone."""
    names = (("sw", "s1", "s2", "se"), ("w", "c1", "c2", "e"), ("nw", "n1", "n2", "ne"))
    places = {
        name: place(x_m, y_m)
        for row, y_m in zip(names, (_SOUTH_M, _MIDDLE_M, _NORTH_M), strict=True)
        for name, x_m in zip(row, (_WEST_M, *_ACROSS_M, _EAST_M), strict=True)
    }
    along = list(zip(("south", "middle", "north"), names, strict=True))
    across = zip(("west", "cross 1", "cross 2", "east"), zip(*names, strict=True), strict=True)
    return lanes(places, [*along, *across])
