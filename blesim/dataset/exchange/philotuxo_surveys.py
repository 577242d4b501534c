"""The static points of the philotuxo data set: one survey walk each, standing still."""

import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blesim.columns import CHANNEL_NOT_TOLD, NO_EDGE, STATES
from blesim.errors import DataError
from blesim.recording import Observations, Walk, WalkKind, WalkTruth
from blesim.tables import Marks, Readings, Trajectory

_MICROSECONDS_PER_MILLISECOND = 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class Surveys:
    """The walks of one set of points, and how many readings of it were left out."""

    walks: list[tuple[Walk, WalkTruth]]
    glitches: int


@dataclass(frozen=True, slots=True, kw_only=True)
class _Packets:
    """Packets of a set, sorted by point and then time; arrays (n,), points (k, 2)."""

    points_m: NDArray[np.float64]
    point: NDArray[np.intp]
    time_us: NDArray[np.int64]
    beacon: NDArray[np.int32]
    rssi_dbm: NDArray[np.int8]
    glitches: int


def read_surveys(path: Path, split: str, row_of_alias: Mapping[str, int]) -> Surveys:
    """Survey walks of a set of static points.

    Parameters
    ----------
    path : Path
        A ``.npz`` archive.
    split : str
        What the set is called.
    row_of_alias : mapping of str to int
        Row of each receiver among the beacons, by alias.

    Raises
    ------
    DataError
        If the archive is damaged, incomplete, or names an unknown receiver.
    """
    packets = _packets(path, row_of_alias)
    starts = np.searchsorted(packets.point, np.arange(len(packets.points_m) + 1))
    walks = [
        _standing(f"{split}, point {number:02d}", split, packets, slice(start, end))
        for number, (start, end) in enumerate(pairwise(starts.tolist()))
        if end > start
    ]
    return Surveys(walks=walks, glitches=packets.glitches)


def _packets(path: Path, row_of_alias: Mapping[str, int]) -> _Packets:
    try:
        return _sorted(_arrays(path), row_of_alias)
    except (
        OSError,
        EOFError,
        KeyError,
        IndexError,
        TypeError,
        ValueError,
        zipfile.BadZipFile,
        zlib.error,
    ) as fault:
        raise DataError(f"{path}: damaged, or not of the data set ({fault})") from fault


def _arrays(path: Path) -> dict[str, NDArray[Any]]:
    loaded = np.load(path)
    if not isinstance(loaded, np.lib.npyio.NpzFile):
        raise ValueError("one array, where an archive of several is needed")
    with loaded:
        return dict(loaded)


def _sorted(arrays: dict[str, NDArray[Any]], row_of_alias: Mapping[str, int]) -> _Packets:
    rows = np.array([row_of_alias[str(alias)] for alias in arrays["sensors"]], dtype=np.int32)
    kept = np.flatnonzero(arrays["rssi"] <= 0)
    # A stable sort: packets of the same millisecond stay in the order of the receivers.
    kept = kept[np.lexsort((arrays["t_ms"][kept], arrays["point"][kept]))]
    return _Packets(
        points_m=arrays["points_xyz"][:, :2],
        point=arrays["point"][kept].astype(np.intp),
        time_us=arrays["t_ms"][kept].astype(np.int64) * _MICROSECONDS_PER_MILLISECOND,
        beacon=rows[arrays["sensor"][kept]],
        rssi_dbm=arrays["rssi"][kept],
        glitches=len(arrays["rssi"]) - len(kept),
    )


def _standing(name: str, split: str, packets: _Packets, rows: slice) -> tuple[Walk, WalkTruth]:
    """Survey walk from the first to the last packet of a point; both ends are marked."""
    x_m, y_m = packets.points_m[packets.point[rows.start]].tolist()
    ends_us = np.array([0, packets.time_us[rows.stop - 1]])
    readings = Readings(
        time_us=packets.time_us[rows],
        beacon=packets.beacon[rows],
        rssi_dbm=packets.rssi_dbm[rows],
        channel=np.full(rows.stop - rows.start, CHANNEL_NOT_TOLD, dtype=np.uint8),
    )
    here = np.array([[x_m, y_m]] * 2).T
    marks = Marks(time_us=ends_us, x_m=here[0], y_m=here[1], level=np.zeros(2, dtype=np.int16))
    walk = Walk(
        name=name,
        walker="not told",
        phone="beacon1",
        carrying="standing still",
        kind=WalkKind.SURVEY,
        split=split,
        observations=Observations(readings=readings, marks=marks),
    )
    return walk, WalkTruth(trajectory=_still(ends_us, here[0], here[1]))


def _still(
    ends_us: NDArray[np.int64], x_m: NDArray[np.float64], y_m: NDArray[np.float64]
) -> Trajectory:
    unknown = np.full(2, np.nan)
    return Trajectory(
        time_us=ends_us,
        x_m=x_m,
        y_m=y_m,
        level=np.zeros(2, dtype=np.int16),
        heading_rad=unknown,
        speed_m_s=np.zeros(2),
        edge=np.full(2, NO_EDGE, dtype=np.int32),
        offset_m=unknown,
        edge_speed_m_s=unknown,
        state=np.full(2, dict(STATES)["standing"], dtype=np.uint8),
    )
