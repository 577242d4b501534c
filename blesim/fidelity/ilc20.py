"""People walking from way point to way point through a mall with a phone held level.

Traces are taken in the order of their names: the carrying mode ``flat`` and the magnetic field are
fitted on every other one from the first on, scored are those between. Way points, the times they
were pressed at, when the walker stood and the step rate are given to the twin. Nobody measured the
way between way points: the twin's is as much longer than the straight lines as its gait needs to
have the step rate.
"""

import gzip
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from blesim.errors import DataError
from blesim.fidelity.comparison import Comparison
from blesim.fidelity.felt import FeltWalk, Numbers, Piece, carried, felt_of, pieces, step_rate_hz
from blesim.fidelity.gait_statistics import (
    QUIET_S,
    gait_panels,
    gait_statistics,
    quiet,
    quiet_statistic,
)
from blesim.fidelity.motion_statistics import field_panel, motion_statistics
from blesim.fidelity.scorecard import Statistic, scorecard
from blesim.fidelity.twin_ways import speed_at_m_s, stops_s, way_walked
from blesim.fidelity.way_points import Trace, heading_panel, heading_statistics
from blesim.imu.feel import feel
from blesim.imu.fused_heading import HEADING_SENSORS, fused_heading
from blesim.imu.magnetics import Magnetics
from blesim.imu.profiles import IMU_PROFILES
from blesim.imu.step_events import StepSensor
from blesim.tables import Trajectory
from blesim.units import to_s
from blesim.walkers.gait import Gait, steps_of

FOLDER = "site1_B1"
LABEL = "flat"
PIECE_S = 20.0
TWINS = 5
# The chips and the system that the traces name.
PHONE = IMU_PROFILES["bmi160-ak09911"]
HEADING = HEADING_SENSORS["android"]
_FITTED, _SCORED = slice(0, None, 2), slice(1, None, 2)
_SENSORS = ("ACCELEROMETER", "GYROSCOPE", "MAGNETIC_FIELD", "ROTATION_VECTOR")


def read_fitted(path: Path) -> list[Trace]:
    """The traces that parameters may be fitted on; see `read_scored`."""
    return _read(path, _FITTED)


def read_scored(path: Path) -> list[Trace]:
    """The traces that are scored.

    Parameters
    ----------
    path : Path
        Folder of the data set.

    Raises
    ------
    DataError
        If there is none, or one is damaged.
    """
    return _read(path, _SCORED)


def _read(path: Path, part: slice) -> list[Trace]:
    files = sorted((path / FOLDER).glob("*.txt.gz"))[part]
    if not files:
        raise DataError(f"{path / FOLDER}: too few traces there; give the folder of the data set")
    return [_trace(file) for file in files]


def _trace(file: Path) -> Trace:
    try:
        with gzip.open(file, "rt", encoding="utf-8") as lines:
            rows = _rows_by_type(lines.read().splitlines())
        return _built(file.name.removesuffix(".txt.gz"), rows)
    except (OSError, EOFError, zlib.error, KeyError, ValueError, IndexError) as fault:
        raise DataError(f"{file}: damaged, or not of the data set ({fault})") from fault


def _rows_by_type(lines: Sequence[str]) -> dict[str, Numbers]:
    """Time in milliseconds and the values, (n, 1 + m), of way points and sensors."""
    wanted = dict.fromkeys(_SENSORS, 3) | {"WAYPOINT": 2}
    found: dict[str, list[list[float]]] = {name: [] for name in wanted}
    for line in lines:
        if line.startswith("#"):
            continue
        time_ms, kind, *values = line.split("\t")
        name = kind.removeprefix("TYPE_")
        if name in wanted:
            found[name].append([float(time_ms), *map(float, values[: wanted[name]])])
    return {name: np.array(rows) for name, rows in found.items()}


def _built(name: str, rows: dict[str, Numbers]) -> Trace:
    """A trace of the rows of its file, time counted from the first sample.

    The sensors are sampled together: row i of each belongs to the same moment.
    """
    lengths = {sensor: rows[sensor].shape for sensor in _SENSORS}
    if (
        len(set(lengths.values())) > 1
        or len(rows["ACCELEROMETER"]) < 2
        or len(rows["WAYPOINT"]) < 2
    ):
        raise ValueError(f"rows and columns of the sensors: {lengths}")
    start_ms = rows["ACCELEROMETER"][0, 0]
    time_s = (rows["ACCELEROMETER"][:, 0] - start_ms) / 1e3
    return Trace(
        felt=FeltWalk(
            name=name,
            carrying=LABEL,
            time_s=time_s,
            acceleration_m_s2=rows["ACCELEROMETER"][:, 1:],
            angular_rate_rad_s=rows["GYROSCOPE"][:, 1:],
            magnetic_field_ut=rows["MAGNETIC_FIELD"][:, 1:],
        ),
        heading_s=time_s,
        heading_rad=_heading_rad(rows["ROTATION_VECTOR"][:, 1:]),
        mark_s=(rows["WAYPOINT"][:, 0] - start_ms) / 1e3,
        mark_m=rows["WAYPOINT"][:, 1:],
    )


def _heading_rad(vector: Numbers) -> Numbers:
    """Heading of the phone's y axis, (n,), of rotation vectors (n, 3). [rad].

    A rotation vector is the vector part of the unit quaternion that turns the phone's frame into
    east, north, up (Android, ``Sensor.TYPE_ROTATION_VECTOR``); the map's x axis points east.
    """
    x, y, z = vector.T
    w = np.sqrt(np.clip(1.0 - x**2 - y**2 - z**2, 0.0, 1.0))
    return np.asarray(np.arctan2(1.0 - 2.0 * (x**2 + z**2), 2.0 * (x * y - z * w)))


def twin_of(trace: Trace, number: int, seed: int) -> Trace:
    """The same way walked with the same stops, simulated.

    Parameters
    ----------
    trace : Trace
        Whose way points, times, stops, step rate and sample rate are taken over.
    number : int
        Which of its twins; each is another person in another mall.
    seed : int
        Of the simulation.
    """
    name = f"{trace.felt.name} {number}"
    # Fields are drawn by seed, so that another seed is another mall.
    there = seed + number
    trajectory = way_of(trace)
    steps, carrying = steps_of(trajectory, Gait(), there, name), carried(LABEL)
    phone = PHONE.model_copy(update={"rate_hz": trace.rate_hz()})
    imu = feel(phone, Magnetics(), trajectory, steps, carrying, there, name).imu
    told = fused_heading(trajectory, steps, carrying, HEADING, StepSensor(), there, name)
    return Trace(
        felt=felt_of(name, LABEL, imu),
        heading_s=to_s(told.time_us),
        heading_rad=told.heading_rad.astype(np.float64),
        mark_s=trace.mark_s,
        mark_m=trace.mark_m,
    )


def way_of(trace: Trace) -> Trajectory:
    """Trajectory with the way points, the stops and the step rate of a trace."""
    still = quiet(np.linalg.norm(trace.felt.acceleration_m_s2, axis=1))
    stood_s = stops_s(still, QUIET_S)
    walked_s = trace.mark_s[-1] - trace.mark_s[0] - np.diff(stood_s, axis=1).sum()
    rate_hz = np.mean([step_rate_hz(piece) for piece in pieces(trace.felt, PIECE_S)])
    straight_m = np.hypot(*np.diff(trace.mark_m, axis=0).T).sum()
    longer = speed_at_m_s(float(rate_hz), Gait()) * walked_s / straight_m
    duration_s = float(trace.felt.time_s[-1])
    return way_walked(trace.mark_s, longer * trace.mark_m, stood_s, duration_s)


def compare_mall(path: Path, seed: int) -> Comparison:
    """Traces beside their twins.

    Parameters
    ----------
    path : Path
        Folder of the data set.
    seed : int
        Of the simulation.

    Raises
    ------
    DataError
        If the data set cannot be read.
    """
    real = read_scored(path)
    sides = real, [twin_of(trace, number, seed) for trace in real for number in range(TWINS)]
    cut = [_pieces_of(side) for side in sides]
    return Comparison(
        title=f"ilc20: {len(real)} traces through a mall, phone held level",
        scores=scorecard(*(_statistics_of(side) for side in sides)),
        panels=(*gait_panels(LABEL, *cut), field_panel(LABEL, *cut), heading_panel(*sides)),
    )


def _statistics_of(traces: Sequence[Trace]) -> list[Statistic]:
    cut = _pieces_of(traces)
    signals = [np.linalg.norm(trace.felt.acceleration_m_s2, axis=1) for trace in traces]
    return [
        *gait_statistics(LABEL, cut),
        quiet_statistic(LABEL, signals),
        *motion_statistics(LABEL, cut),
        *heading_statistics(traces),
    ]


def _pieces_of(traces: Sequence[Trace]) -> list[Piece]:
    return [piece for trace in traces for piece in pieces(trace.felt, PIECE_S)]
