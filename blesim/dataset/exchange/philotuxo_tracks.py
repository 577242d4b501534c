"""A moving track of the philotuxo data set: readings and ground truth, line by line."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from blesim.columns import CHANNEL_NOT_TOLD, NO_EDGE, STATES
from blesim.errors import DataError
from blesim.recording import Observations, Walk, WalkTruth
from blesim.tables import Readings, Trajectory
from blesim.units import MICROSECONDS_PER_SECOND

# unix time, receiver, beacon, RSSI, x, y, z, nine entries of the rotation matrix
_FIELDS = 16
_SUFFIX = "_all_sensors"
# Slower than this, the ground truth's own jitter looks like walking.
_STANDING_M_S = 0.1
# Far in the future, and still to be counted in microseconds.
_LAST_UNIX_S = 1e11
_MAP_LIMIT_M = 1e5
_LONGEST_S = 24 * 3600


@dataclass(frozen=True, slots=True, kw_only=True)
class MovingTrack:
    """One track, and how many lines of its file were left out."""

    walk: Walk
    truth: WalkTruth
    glitches: int
    unreadable: int


def read_track(path: Path, row_of_mac: Mapping[str, int]) -> MovingTrack:
    """Walk and truth of one ``.mbd`` file.

    Parameters
    ----------
    path : Path
        The file.
    row_of_mac : mapping of str to int
        Row of each receiver among the beacons, by MAC address.

    Raises
    ------
    DataError
        If the file cannot be opened, holds no reading, or its readings lie too far apart.
    """
    lines = _lines(path)
    parsed = [row for line in lines if (row := _row(line, row_of_mac)) is not None]
    rows = np.array(parsed, dtype=np.float64).reshape(-1, 5)
    kept = rows[rows[:, 2] <= 0]
    if not len(kept):
        raise DataError(f"{path}: not one reading in it that can be used")
    # Packets of several receivers are written down in the order in which they were processed.
    kept = kept[np.argsort(kept[:, 0], kind="stable")]
    if kept[-1, 0] - kept[0, 0] > _LONGEST_S:
        raise DataError(f"{path}: readings more than a day apart; a line has a wrong time")
    time_us = np.rint((kept[:, 0] - kept[0, 0]) * MICROSECONDS_PER_SECOND).astype(np.int64)
    name = path.stem.removesuffix(_SUFFIX)
    return MovingTrack(
        walk=_walk(name, time_us, kept),
        truth=WalkTruth(trajectory=_trajectory(time_us, kept[:, 3], kept[:, 4])),
        glitches=len(rows) - len(kept),
        unreadable=len(lines) - len(rows),
    )


def _lines(path: Path) -> list[str]:
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as fault:
        raise DataError(f"{path}: cannot be read: {fault.strerror}") from fault
    return [line for line in text.splitlines() if line.strip()]


def _row(line: str, row_of_mac: Mapping[str, int]) -> tuple[float, ...] | None:
    """Time, row of the receiver, RSSI, x and y of a line; None if it cannot be read."""
    fields = line.split(",")
    if len(fields) != _FIELDS or fields[1] not in row_of_mac:
        return None
    try:
        numbers = (float(fields[0]), int(fields[3]), float(fields[4]), float(fields[5]))
    except ValueError:
        return None
    unix_s, rssi_dbm, x_m, y_m = numbers
    # Written so that NaN is refused as well.
    if not (0 <= unix_s <= _LAST_UNIX_S and -127 <= rssi_dbm <= 127):
        return None
    if not (abs(x_m) <= _MAP_LIMIT_M and abs(y_m) <= _MAP_LIMIT_M):
        return None
    return unix_s, row_of_mac[fields[1]], rssi_dbm, x_m, y_m


def _walk(name: str, time_us: NDArray[np.int64], rows: NDArray[np.float64]) -> Walk:
    readings = Readings(
        time_us=time_us,
        beacon=rows[:, 1].astype(np.int32),
        rssi_dbm=rows[:, 2].astype(np.int8),
        channel=np.full(len(rows), CHANNEL_NOT_TOLD, dtype=np.uint8),
    )
    return Walk(
        name=name,
        walker="not told",
        phone="beacon1",
        carrying="not told",
        observations=Observations(readings=readings),
    )


def _trajectory(
    time_us: NDArray[np.int64], x_m: NDArray[np.float64], y_m: NDArray[np.float64]
) -> Trajectory:
    """Trajectory through the ground truth of every packet, one knot at each distinct time."""
    knots_us, first = np.unique(time_us, return_index=True)
    x_m, y_m = x_m[first], y_m[first]
    walked_m = np.hypot(np.diff(x_m), np.diff(y_m))
    speed_m_s = np.append(walked_m / np.diff(knots_us) * MICROSECONDS_PER_SECOND, 0.0)
    states = dict(STATES)
    return Trajectory(
        time_us=knots_us,
        x_m=x_m,
        y_m=y_m,
        level=np.zeros(len(first), dtype=np.int16),
        heading_rad=np.full(len(first), np.nan),
        speed_m_s=speed_m_s,
        edge=np.full(len(first), NO_EDGE, dtype=np.int32),
        offset_m=np.full(len(first), np.nan),
        edge_speed_m_s=np.full(len(first), np.nan),
        state=np.where(speed_m_s < _STANDING_M_S, states["standing"], states["walking"]),
    )
