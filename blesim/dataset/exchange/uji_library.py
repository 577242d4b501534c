"""The university library of Mendoza-Silva et al.: fingerprints between bookcases, three phones.

Each fixed point that one phone stood at in one campaign is a survey walk of six scans of about a
second; every scan ends with a mark. The data set is public (CC BY 4.0): doi:10.5281/zenodo.1618692.
"""

import csv
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import TypeVar
from uuid import NAMESPACE_URL, uuid5

import numpy as np
import shapely
from numpy.typing import NDArray
from pydantic import ValidationError

from blesim.columns import CHANNEL_NOT_TOLD, NO_EDGE, STATES
from blesim.dataset.exchange.imported import Imported
from blesim.errors import DataError, VenueError
from blesim.recording import Observations, Provenance, Recording, Truth, Walk, WalkKind, WalkTruth
from blesim.tables import Marks, Readings, Trajectory
from blesim.venue.beacons import Beacon
from blesim.venue.floor_plan import FloorPlan, Level, Obstacle
from blesim.venue.venue import Venue

T = TypeVar("T", int, float)

_HOME = "https://doi.org/10.5281/zenodo.1618692"
_REFERENCES = f"Mendoza-Silva et al., BLE RSS measurements database, {_HOME}"
PHONES = MappingProxyType({"1": "A5", "2": "BQ", "3": "S6"})
TX_POWER_DBM = MappingProxyType({"1": -4.0, "2": -12.0, "3": -20.0})
_MATERIALS = {"1": "bookcase", "2": "pillar"}
_NOT_HEARD = 100
_INTERVAL_S = 0.2
# Level at one metre over all phones, obstacles apart; a fit to campaign 2.
_MEASURED_POWER_DBM = -62.0
# Nobody says. Of heights from 1.2 to 3 m above a phone at 1.2 m this leaves the least residuals.
BEACON_HEIGHT_M = 1.5
_SCAN_US = 1_000_000
_MARGIN_M = 2.0


def read_uji_library(path: Path) -> Imported:
    """Fingerprints as survey walks among bookcases and pillars.

    Parameters
    ----------
    path : Path
        Folder with ``dep/lib.csv``, ``obs/lib.csv`` and ``rss/lib_*.csv``.

    Returns
    -------
    Imported
        The split of a walk is its campaign. Points where nothing was heard are dropped and counted.

    Raises
    ------
    DataError
        If a file is missing, cannot be read, or does not fit the others.
    """
    scans = _scans(path / "rss")
    venue = _library(path, scans)
    starts = np.flatnonzero(np.append(True, scans.point[1:] != scans.point[:-1]))
    bounds = [*starts.tolist(), len(scans.point)]
    parts = [scans.rows(slice(*pair)) for pair in pairwise(bounds)]
    heard = [part for part in parts if np.any(part.time_ns > 0)]
    found = [_walk(part) for part in heard]
    report = (f"left out: {len(parts) - len(heard)} points at which nothing was heard",)
    return Imported(
        recording=Recording(
            venue=venue,
            walks=tuple(walk for walk, _ in found),
            provenance=Provenance(
                title="Library with 24 beacons, fingerprints by three phones",
                source="Mendoza-Silva et al., BLE RSS measurements database",
                license="CC-BY-4.0",
                references="; ".join([_REFERENCES, *report]),
            ),
        ),
        truth=Truth(
            venue=venue, walks=MappingProxyType({walk.name: truth for walk, truth in found})
        ),
        report=report,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Scans:
    """Rows of the files: identifier without sequence number, place, readings of all beacons."""

    point: NDArray[np.str_]
    place_m: NDArray[np.float64]
    rssi_dbm: NDArray[np.int64]
    time_ns: NDArray[np.int64]

    def rows(self, selection: slice | NDArray[np.intp]) -> "_Scans":
        return _Scans(
            point=self.point[selection],
            place_m=self.place_m[selection],
            rssi_dbm=self.rssi_dbm[selection],
            time_ns=self.time_ns[selection],
        )


def _scans(folder: Path) -> _Scans:
    identifiers = [row[0] for row in _rows(folder / "lib_ids.csv")]
    scans = _Scans(
        point=np.array([name[:-2] for name in identifiers]),
        place_m=np.array(_table(folder / "lib_crd.csv", float), dtype=np.float64),
        rssi_dbm=np.array(_table(folder / "lib_rss.csv", int), dtype=np.int64),
        time_ns=np.array(_table(folder / "lib_tms.csv", int), dtype=np.int64),
    )
    sizes = {len(scans.point), len(scans.place_m), len(scans.rssi_dbm), len(scans.time_ns)}
    if len(sizes) > 1 or scans.rssi_dbm.shape != scans.time_ns.shape:
        raise DataError(f"{folder}: lib_*.csv differ in size; get the data set once more")
    if not all(len(name) == 8 and name.isdigit() for name in identifiers):
        raise DataError(f"{folder / 'lib_ids.csv'}: an identifier is not eight digits")
    return scans.rows(np.argsort(np.array(identifiers), kind="stable"))


def _table(path: Path, number: Callable[[str], T]) -> list[list[T]]:
    try:
        table = [[number(cell) for cell in row] for row in _rows(path)]
    except ValueError as fault:
        raise DataError(f"{path}: not a table of numbers ({fault})") from fault
    if len({len(row) for row in table}) != 1:
        raise DataError(f"{path}: empty, or rows of different length; get the data set once more")
    return table


def _rows(path: Path) -> list[list[str]]:
    try:
        with path.open(encoding="utf-8", newline="") as lines:
            return [row for row in csv.reader(lines) if row]
    except (OSError, UnicodeDecodeError, csv.Error) as fault:
        raise DataError(f"{path}: cannot be read ({fault}); give the data set's folder") from fault


def _library(path: Path, scans: _Scans) -> Venue:
    """The part of the library that was measured, two metres around it."""
    beacons = [_beacon(path, row) for row in _rows(path / "dep" / "lib.csv")[1:]]
    if len(beacons) != scans.rssi_dbm.shape[1]:
        raise DataError(f"{path}: {len(beacons)} beacons, {scans.rssi_dbm.shape[1]} columns")
    obstacles = tuple(_obstacles(path / "obs" / "lib.csv"))
    beacons = [_on_a_face(beacon, obstacles) for beacon in beacons]
    places = shapely.MultiPoint([*scans.place_m.tolist(), *((b.x_m, b.y_m) for b in beacons)])
    outlines = shapely.union_all([obstacle.outline for obstacle in obstacles])
    west, south, east, north = shapely.union(places.envelope, outlines.envelope).bounds
    bounds = shapely.box(west - _MARGIN_M, south - _MARGIN_M, east + _MARGIN_M, north + _MARGIN_M)
    try:
        plan = FloorPlan(levels=(Level(level=0, bounds=bounds),), obstacles=obstacles)
        return Venue(name="library", floor_plan=plan, beacons=tuple(beacons))
    except VenueError as fault:
        raise DataError(f"{path}: a floor plan that contradicts itself: {fault}") from fault


def _beacon(path: Path, row: Sequence[str]) -> Beacon:
    try:
        name, x_m, y_m = row
        return Beacon(
            id=name,
            uuid=uuid5(NAMESPACE_URL, _HOME),
            major=1,
            minor=int(name),
            x_m=float(x_m),
            y_m=float(y_m),
            z_m=BEACON_HEIGHT_M,
            tx_power_dbm=TX_POWER_DBM["2"],
            measured_power_dbm=_MEASURED_POWER_DBM,
            advertising_interval_s=_INTERVAL_S,
        )
    except (ValueError, ValidationError) as fault:
        raise DataError(f"{path / 'dep' / 'lib.csv'}: no beacon in the line {row}") from fault


def _on_a_face(beacon: Beacon, obstacles: Sequence[Obstacle]) -> Beacon:
    """A beacon that was drawn a few centimetres inside a bookcase, at the nearest place outside."""
    place = shapely.Point(beacon.x_m, beacon.y_m)
    for obstacle in obstacles:
        if shapely.contains(obstacle.outline, place):
            face = shapely.shortest_line(shapely.boundary(obstacle.outline), place)
            x_m, y_m = (round(float(value), 3) for value in face.coords[0])
            return beacon.model_copy(update={"x_m": x_m, "y_m": y_m})
    return beacon


def _obstacles(path: Path) -> Iterator[Obstacle]:
    """Polygons of consecutive corners with the same number."""
    corners: dict[tuple[str, str], list[tuple[float, float]]] = {}
    try:
        for name, x_m, y_m, kind in _rows(path)[1:]:
            corners.setdefault((name, _MATERIALS[kind]), []).append((float(x_m), float(y_m)))
        for (name, material), ring in corners.items():
            outline = shapely.Polygon(ring)
            yield Obstacle(id=f"{material} {name}", outline=outline, material=material)
    except (ValueError, KeyError, VenueError) as fault:
        raise DataError(f"{path}: no outlines that can be read ({fault})") from fault


def _walk(scans: _Scans) -> tuple[Walk, WalkTruth]:
    """Scans of one phone at one point, in the order in which they were made."""
    phone, power, campaign, point = (*str(scans.point[0])[:3], str(scans.point[0])[3:])
    if phone not in PHONES or power not in TX_POWER_DBM:
        raise DataError(f"lib_ids.csv: phone {phone} or power {power} is not of the data set")
    heard = scans.time_ns > 0
    start_ns = _start_ns(scans.time_ns, heard)
    time_us = (scans.time_ns - start_ns) // 1000
    ends_us = _scan_ends_us(time_us, heard)
    row, beacon = np.nonzero(heard)
    order = np.argsort(time_us[row, beacon], kind="stable")
    row, beacon = row[order], beacon[order]
    readings = Readings(
        time_us=time_us[row, beacon],
        beacon=beacon,
        rssi_dbm=scans.rssi_dbm[row, beacon],
        channel=np.full(len(row), CHANNEL_NOT_TOLD, dtype=np.uint8),
    )
    here = np.broadcast_to(scans.place_m[0][:, None], (2, len(ends_us)))
    marks = Marks(
        time_us=ends_us, x_m=here[0], y_m=here[1], level=np.zeros(len(ends_us), dtype=np.int16)
    )
    walk = Walk(
        name=f"{PHONES[phone]} at {TX_POWER_DBM[power]:g} dBm, campaign {campaign}, point {point}",
        walker="not told",
        phone=PHONES[phone],
        carrying="standing still",
        kind=WalkKind.SURVEY,
        split=f"campaign {campaign}",
        observations=Observations(readings=readings, marks=marks),
    )
    return walk, WalkTruth(trajectory=_still(int(ends_us[-1]), *scans.place_m[0].tolist()))


def _start_ns(time_ns: NDArray[np.int64], heard: NDArray[np.bool_]) -> int:
    """Start of the first scan: a second for each before the first that heard something. [ns]."""
    empty = int(np.argmax(heard.any(axis=1)))
    return int(time_ns[heard].min()) - (empty * _SCAN_US + 1) * 1000


def _scan_ends_us(time_us: NDArray[np.int64], heard: NDArray[np.bool_]) -> NDArray[np.int64]:
    """End of each scan: its last reading, or a second later than the one before if it has none."""
    ends_us = []
    last_us = 0
    for times, rows in zip(time_us, heard, strict=True):
        last_us = max(last_us, int(times[rows].max())) if rows.any() else last_us + _SCAN_US
        ends_us.append(last_us)
    # A scan that heard nothing ends before the next one that did begins.
    following_us = np.full(len(ends_us), np.iinfo(np.int64).max)
    for number in range(len(ends_us) - 2, -1, -1):
        rows = heard[number + 1]
        first = int(time_us[number + 1][rows].min()) - 1 if rows.any() else following_us[number + 1]
        following_us[number] = min(following_us[number + 1], first)
    silent = ~heard.any(axis=1)
    ends = np.where(silent, np.minimum(ends_us, following_us), ends_us)
    return np.maximum.accumulate(ends)


def _still(end_us: int, x_m: float, y_m: float) -> Trajectory:
    unknown = np.full(2, np.nan)
    return Trajectory(
        time_us=np.array([0, end_us]),
        x_m=np.full(2, x_m),
        y_m=np.full(2, y_m),
        level=np.zeros(2, dtype=np.int16),
        heading_rad=unknown,
        speed_m_s=np.zeros(2),
        edge=np.full(2, NO_EDGE, dtype=np.int32),
        offset_m=unknown,
        edge_speed_m_s=unknown,
        state=np.full(2, dict(STATES)["standing"], dtype=np.uint8),
    )
