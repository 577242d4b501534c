"""What all sites are put together from: walls, beacons, and lanes to walk on."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple
from uuid import UUID

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from blesim.venue.beacons import Beacon
from blesim.venue.floor_plan import FLOOR_TO_CEILING_M, Obstacle
from blesim.venue.graph import AisleGraph, Edge, Node

# Of all sites; the papers do not tell theirs, and no model looks at it.
BEACON_UUID = UUID("b9407f30-f5f8-466e-aff9-25556b57fe6d")
# RSSI at 1 m of a beacon that sends with 0 dBm. Aisle-graph paper: -77 dBm at -12 dBm. Where the
# paper of a site gives none, assumed: a dB more or less for each dB of transmit power.
AT_1M_OF_0_DBM = -65.0
# Maps hold micrometres.
_DECIMALS = 6


class Place(NamedTuple):
    """A place on the map. [m]."""

    x_m: float
    y_m: float


def rounded(geometry: BaseGeometry) -> Any:
    """The same geometry with whole micrometres."""
    return shapely.transform(geometry, lambda xy_m: np.round(xy_m, _DECIMALS) + 0.0)


def place(x_m: float, y_m: float) -> Place:
    """A place in whole micrometres."""
    return Place(round(float(x_m), _DECIMALS) + 0.0, round(float(y_m), _DECIMALS) + 0.0)


def wall(
    name: str,
    start: Sequence[float],
    end: Sequence[float],
    *,
    material: str,
    thickness_m: float,
    height_m: float = FLOOR_TO_CEILING_M,
) -> Obstacle:
    """A straight wall between two places, half of its thickness to each side. [m]."""
    line = shapely.LineString([start, end])
    outline = rounded(line.buffer(thickness_m / 2, cap_style="flat"))
    return Obstacle(id=name, outline=outline, material=material, height_m=height_m)


def block(name: str, box_m: tuple[float, float, float, float], material: str) -> Obstacle:
    """A rectangle without entry: west, south, east and north. [m]."""
    west, south, east, north = box_m
    outline = rounded(shapely.box(west, south, east, north))
    return Obstacle(id=name, outline=outline, material=material)


def beacons(
    places: Mapping[str, tuple[float, float, float]],
    *,
    tx_power_dbm: float,
    advertising_interval_s: float,
    measured_power_dbm: float | None = None,
    **settings: Any,
) -> tuple[Beacon, ...]:
    """Beacons by id at x, y and z, all set alike. [m], [dBm], [s]."""
    usual_dbm = AT_1M_OF_0_DBM + tx_power_dbm
    return tuple(
        Beacon(
            id=name,
            uuid=BEACON_UUID,
            major=1,
            minor=number,
            x_m=round(x_m, _DECIMALS),
            y_m=round(y_m, _DECIMALS),
            z_m=z_m,
            tx_power_dbm=tx_power_dbm,
            measured_power_dbm=usual_dbm if measured_power_dbm is None else measured_power_dbm,
            advertising_interval_s=advertising_interval_s,
            **settings,
        )
        for number, (name, (x_m, y_m, z_m)) in enumerate(places.items(), start=1)
    )


def lanes(places: Mapping[str, Place], branches: Iterable[tuple[str, Sequence[str]]]) -> AisleGraph:
    """A graph of straight lanes.

    Parameters
    ----------
    places : mapping of str to Place
        Nodes by id.
    branches : iterable of (str, sequence of str)
        Name of each lane, and its nodes in order.
    """
    return AisleGraph(
        nodes=tuple(Node(id=name, x_m=at.x_m, y_m=at.y_m) for name, at in places.items()),
        edges=tuple(
            Edge(first=first, second=second, branch=branch)
            for branch, names in branches
            for first, second in pairwise(names)
        ),
    )
