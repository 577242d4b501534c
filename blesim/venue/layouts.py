"""Parametric stores: rows of gondolas with aisles between them, joined by connecting aisles.

The measures of the wholesale store are those published of a British wholesaler's site (IPIN 2016,
the ``aisle-graph`` paper): beacons 5.4 or 8.1 m apart at the ends of 2.7 m shelf units, on one side
of each aisle, 2 m high; 1.9 m from the aisle's centre to the shelf face; 25 beacons in about 800 m2
of three adjacent aisles; 136 beacons in about 6000 m2 of 22 aisles of 24 to 60 m and three
connecting aisles of 80 to 100 m. The drawing of the store is not published: how the aisles lie
beside each other is assumed, and so is the depth of the gondolas.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from uuid import UUID

import shapely

from blesim.venue.beacons import Beacon
from blesim.venue.floor_plan import FloorPlan, Level, Obstacle
from blesim.venue.graph import AisleGraph, Edge, Node
from blesim.venue.sections import Section
from blesim.venue.venue import Venue

SHELF_UNIT_M = 2.7
CENTRE_TO_FACE_M = 1.9
BEACON_HEIGHT_M = 2.0
# Back-to-back wholesale racking: assumed.
GONDOLA_DEPTH_M = 1.6
PITCH_M = 2 * CENTRE_TO_FACE_M + GONDOLA_DEPTH_M
GONDOLA_MATERIAL = "gondola-dry"

# Kontakt.io Smart Beacon: -12 dBm setting, -77 dBm at 1 m as in the paper, 350 ms default interval.
BEACON_UUID = UUID("f7826da6-4fa2-4e98-8024-bc5b71e0893e")
TX_POWER_DBM = -12.0
MEASURED_POWER_DBM = -77.0
ADVERTISING_INTERVAL_S = 0.35

# What is sold along a row; the names are ours, the sections are one shelf unit long.
CATEGORIES = ("cereals", "tins", "pasta", "snacks", "coffee", "cleaning", "drinks", "paper")


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """An unbroken stretch of shelving that all rows share: where it begins, how long it is.

    Attributes
    ----------
    start_m : float
        x of its first shelf end. [m]
    units : int
        Number of shelf units.
    """

    start_m: float
    units: int

    @property
    def end_m(self) -> float:
        """Position x of its last shelf end. [m]."""
        return self.unit_end_m(self.units)

    def unit_end_m(self, unit: int) -> float:
        """Position x of the end of a shelf unit, 0 for the beginning of the run. [m]."""
        return round(self.start_m + unit * SHELF_UNIT_M, 6)


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One line of aisle through all runs.

    Attributes
    ----------
    label : str
        Beacons are called by it and a number, such as D1.
    branches : tuple of str
        Name of the aisle in each run; the same name makes one aisle of two runs.
    beacon_units : tuple of tuple of int
        Shelf ends of each run that carry a beacon.
    """

    label: str
    branches: tuple[str, ...]
    beacon_units: tuple[tuple[int, ...], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Crossing:
    """A connecting aisle: its name, its x, and how far it reaches beyond the last row. [m]."""

    branch: str
    x_m: float
    beyond_m: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class StorePlan:
    """All measures of a store of this kind; rows are counted from the front wall (y = 0)."""

    name: str
    runs: tuple[Run, ...]
    rows: tuple[Row, ...]
    crossings: tuple[Crossing, ...]
    width_m: float
    depth_m: float

    def row_y_m(self, row: int) -> float:
        """Centre line y of a row's aisle, after a wall shelf of half a gondola. [m]."""
        return round(GONDOLA_DEPTH_M / 2 + CENTRE_TO_FACE_M + row * PITCH_M, 6)


def wholesale_section() -> Venue:
    """The measured part of the wholesale store: aisles D, E, F, 25 beacons, 787 m2 of shelving."""
    run = Run(start_m=2 * CENTRE_TO_FACE_M, units=18)
    eight = (0, 3, 6, 9, 11, 13, 15, 18)
    nine = (0, 2, 4, 6, 8, 10, 12, 15, 18)
    rows = tuple(
        Row(label=label, branches=(label,), beacon_units=(units,))
        for label, units in (("F", eight), ("E", nine), ("D", eight))
    )
    return build(
        StorePlan(
            name="wholesale section",
            runs=(run,),
            rows=rows,
            crossings=(
                Crossing(branch="west", x_m=CENTRE_TO_FACE_M),
                Crossing(branch="east", x_m=run.end_m + CENTRE_TO_FACE_M),
            ),
            width_m=run.end_m + 2 * CENTRE_TO_FACE_M,
            depth_m=3 * PITCH_M,
        )
    )


def wholesale_store() -> Venue:
    """The whole wholesale store: 22 aisles, three connecting aisles, 136 beacons, 6030 m2.

    Sixteen rows cross two runs of shelving. Ten of them are one aisle with 59.4 m from the first
    to the last shelf, six are two aisles of 24.3 and 29.7 m. Three adjacent rows hold 25 beacons,
    as in the measured section.
    """
    west = Run(start_m=2 * CENTRE_TO_FACE_M, units=9)
    east = Run(start_m=west.end_m + 2 * SHELF_UNIT_M, units=11)
    rows = tuple(_store_row(row) for row in range(16))
    return build(
        StorePlan(
            name="wholesale store",
            runs=(west, east),
            rows=rows,
            crossings=(
                Crossing(branch="west", x_m=CENTRE_TO_FACE_M, beyond_m=4.5),
                Crossing(branch="middle", x_m=west.end_m + SHELF_UNIT_M),
                Crossing(branch="east", x_m=east.end_m + CENTRE_TO_FACE_M),
            ),
            width_m=east.end_m + 2 * CENTRE_TO_FACE_M,
            depth_m=90.0,
        )
    )


def _store_row(row: int) -> Row:
    label = chr(ord("A") + row)
    # Rows 1, 4, 7, 10, 13 and 15 are two aisles, the others one.
    split = row in (1, 4, 7, 10, 13, 15)
    five = row % 2 == 1
    return Row(
        label=label,
        branches=(f"{label}-west", f"{label}-east") if split else (label, label),
        beacon_units=((0, 3, 6, 9), (0, 3, 6, 9, 11) if five else (1, 4, 7, 10)),
    )


def build(plan: StorePlan) -> Venue:
    """A venue with everything that a plan says.

    Parameters
    ----------
    plan : StorePlan
        Measures; all on level 0.

    Returns
    -------
    Venue
        With gondolas between the rows, wall shelves along the first and after the last, a node
        beside every beacon and at every junction, and a product section for every shelf unit.
    """
    bounds = shapely.box(0.0, 0.0, round(plan.width_m, 6), round(plan.depth_m, 6))
    return Venue(
        name=plan.name,
        floor_plan=FloorPlan(levels=(Level(level=0, bounds=bounds),), obstacles=_gondolas(plan)),
        beacons=_beacons(plan),
        graph=_graph(plan),
        sections=_sections(plan),
    )


def _gondolas(plan: StorePlan) -> tuple[Obstacle, ...]:
    """Wall shelf, gondolas between the rows, wall shelf; one piece for each run."""
    faces = [0.0]
    for row in range(len(plan.rows)):
        centre_m = plan.row_y_m(row)
        faces += [centre_m - CENTRE_TO_FACE_M, centre_m + CENTRE_TO_FACE_M]
    faces.append(faces[-1] + GONDOLA_DEPTH_M / 2)
    names = ["wall", *(row.label for row in plan.rows), "wall"]
    return tuple(
        Obstacle(
            id=f"{names[gondola]}/{names[gondola + 1]}-{number}",
            outline=shapely.box(
                run.start_m,
                round(faces[2 * gondola], 6),
                run.end_m,
                round(faces[2 * gondola + 1], 6),
            ),
            material=GONDOLA_MATERIAL,
        )
        for gondola in range(len(plan.rows) + 1)
        for number, run in enumerate(plan.runs, start=1)
    )


def _beacon_x_m(plan: StorePlan, row: Row) -> list[float]:
    """Positions x of a row's beacons, from west to east. [m]."""
    pairs = zip(plan.runs, row.beacon_units, strict=True)
    return [run.unit_end_m(unit) for run, units in pairs for unit in units]


def _beacons(plan: StorePlan) -> tuple[Beacon, ...]:
    """Beacons on the far face of each aisle."""
    return tuple(
        Beacon(
            id=f"{row.label}{number}",
            uuid=BEACON_UUID,
            major=major,
            minor=number,
            x_m=x_m,
            y_m=round(plan.row_y_m(major - 1) + CENTRE_TO_FACE_M, 6),
            z_m=BEACON_HEIGHT_M,
            tx_power_dbm=TX_POWER_DBM,
            measured_power_dbm=MEASURED_POWER_DBM,
            advertising_interval_s=ADVERTISING_INTERVAL_S,
        )
        for major, row in enumerate(plan.rows, start=1)
        for number, x_m in enumerate(_beacon_x_m(plan, row), start=1)
    )


def _graph(plan: StorePlan) -> AisleGraph:
    nodes: dict[str, Node] = {}
    edges: list[Edge] = []
    for number, row in enumerate(plan.rows):
        line = _row_nodes(plan, row, plan.row_y_m(number))
        nodes |= {node.id: node for node in line}
        edges += [
            Edge(first=a.id, second=b.id, branch=_branch_at(plan, row, (a.x_m + b.x_m) / 2))
            for a, b in pairwise(line)
        ]
    for crossing in plan.crossings:
        line = _crossing_nodes(plan, crossing)
        nodes |= {node.id: node for node in line}
        edges += [Edge(first=a.id, second=b.id, branch=crossing.branch) for a, b in pairwise(line)]
    return AisleGraph(nodes=tuple(nodes.values()), edges=tuple(edges))


def _row_nodes(plan: StorePlan, row: Row, y_m: float) -> list[Node]:
    """Junctions and beacon nodes of a row, from west to east."""
    beacons = enumerate(_beacon_x_m(plan, row), start=1)
    junctions = (_junction(row, crossing, y_m) for crossing in plan.crossings)
    beside = (Node(id=f"{row.label}{number}", x_m=x_m, y_m=y_m) for number, x_m in beacons)
    return sorted((*junctions, *beside), key=lambda node: node.x_m)


def _junction(row: Row, crossing: Crossing, y_m: float) -> Node:
    return Node(id=f"{row.label}/{crossing.branch}", x_m=round(crossing.x_m, 6), y_m=y_m)


def _crossing_nodes(plan: StorePlan, crossing: Crossing) -> list[Node]:
    """Junctions of a connecting aisle from the front, and its end if it reaches further."""
    ys_m = [plan.row_y_m(number) for number in range(len(plan.rows))]
    line = [_junction(row, crossing, y_m) for row, y_m in zip(plan.rows, ys_m, strict=True)]
    if crossing.beyond_m > 0:
        end_m = round(ys_m[-1] + crossing.beyond_m, 6)
        line.append(Node(id=f"{crossing.branch}/end", x_m=round(crossing.x_m, 6), y_m=end_m))
    return line


def _branch_at(plan: StorePlan, row: Row, x_m: float) -> str:
    """Aisle of a row at a position: that of the run it is in or nearest to."""
    away = [max(run.start_m - x_m, x_m - run.end_m, 0.0) for run in plan.runs]
    return row.branches[away.index(min(away))]


def _sections(plan: StorePlan) -> tuple[Section, ...]:
    return tuple(
        section
        for number, row in enumerate(plan.rows)
        for section in _row_sections(plan, row, plan.row_y_m(number), number)
    )


def _row_sections(plan: StorePlan, row: Row, y_m: float, shift: int) -> Sequence[Section]:
    units = [(run, unit) for run in plan.runs for unit in range(run.units)]
    return [
        Section(
            id=f"{row.label}-{number + 1:02d}",
            category=CATEGORIES[(number // 3 + shift) % len(CATEGORIES)],
            branch=_branch_at(plan, row, run.unit_end_m(unit) + SHELF_UNIT_M / 2),
            start_m=(run.unit_end_m(unit), y_m),
            end_m=(run.unit_end_m(unit + 1), y_m),
        )
        for number, (run, unit) in enumerate(units)
    ]
