"""A small invented recording on which any estimator can be tried; no simulator is behind it."""

from dataclasses import replace
from uuid import UUID

import numpy as np
import shapely
from numpy.typing import NDArray

from blesim.recording import Observations, Provenance, Recording, Walk, WalkKind
from blesim.rng import Draws
from blesim.tables import Headings, Imu, Marks, Readings, Steps
from blesim.venue.beacons import Beacon
from blesim.venue.floor_plan import FloorPlan, Level
from blesim.venue.graph import AisleGraph, Edge, Node
from blesim.venue.venue import Venue

_SPEED_M_S = 1.0
_STEP_US = 600_000
_READING_US = 100_000
_IMU_US = 40_000
_HEADING_US = 200_000
_GRAVITY_M_S2 = 9.81
_BOUNCE_M_S2 = 3.0
# Samples over which a corner is turned.
_TURN_SAMPLES = 20
_MEASURED_POWER_DBM = -61.0
_HEIGHT_DIFFERENCE_M = 1.0

# Corners of the two aisles and of the two cross aisles that join them. [m]
_CORNERS_M = {"a": (2.0, 2.0), "b": (14.0, 2.0), "c": (14.0, 6.0), "d": (2.0, 6.0)}
_AISLES = (("a", "b", "aisle 1"), ("b", "c", "east"), ("c", "d", "aisle 2"), ("d", "a", "west"))


def practice_recording(seed: int = 1) -> Recording:
    """Recording of two aisles with eight beacons: a survey walk and two walks, 32 s each.

    It holds readings with their channels, IMU samples of a phone held flat that show steps and
    turns, step events, headings and marks. Some events fall on the same microsecond, as they do on
    phones.

    Parameters
    ----------
    seed : int
        Of the RSSI noise.
    """
    venue = practice_venue()
    walks = (
        _walk(venue, "survey", _round("abcda"), seed, WalkKind.SURVEY),
        _walk(venue, "there", _round("abcda"), seed, WalkKind.WALK),
        _walk(venue, "back", _round("cbadc"), seed, WalkKind.WALK),
    )
    provenance = Provenance(title="Practice recording", source="blesim practice", seed=seed)
    return Recording(venue=venue, walks=walks, provenance=provenance)


def practice_venue() -> Venue:
    """Venue of 16 m x 8 m: two aisles, two cross aisles, four beacons along each aisle."""
    nodes = tuple(Node(id=name, x_m=x_m, y_m=y_m) for name, (x_m, y_m) in _CORNERS_M.items())
    edges = tuple(Edge(first=first, second=second, branch=b) for first, second, b in _AISLES)
    level = Level(level=0, bounds=shapely.box(0.0, 0.0, 16.0, 8.0))
    return Venue(
        name="practice",
        floor_plan=FloorPlan(levels=(level,)),
        beacons=tuple(
            _beacon(row, x_m, y_m)
            for row, (x_m, y_m) in enumerate((x, y) for y in (0.5, 7.5) for x in (2, 6, 10, 14))
        ),
        graph=AisleGraph(nodes=nodes, edges=edges),
    )


def _beacon(row: int, x_m: float, y_m: float) -> Beacon:
    return Beacon(
        id=f"B{row + 1}",
        uuid=UUID(int=0xB1E),
        major=1,
        minor=row,
        x_m=x_m,
        y_m=y_m,
        z_m=2.0,
        tx_power_dbm=-4.0,
        measured_power_dbm=_MEASURED_POWER_DBM,
        advertising_interval_s=0.35,
    )


def _round(corners: str) -> NDArray[np.float64]:
    """Way points of a round by the names of its corners, (n, 2). [m]."""
    return np.array([_CORNERS_M[name] for name in corners])


def _walk(
    venue: Venue, name: str, way_points_m: NDArray[np.float64], seed: int, kind: WalkKind
) -> Walk:
    legs_m = np.hypot(*np.diff(way_points_m, axis=0).T)
    passed_us = np.round(np.append(0.0, np.cumsum(legs_m)) / _SPEED_M_S * 1e6).astype(np.int64)
    observations = Observations(
        readings=_readings(venue, name, passed_us, way_points_m, seed),
        imu=_imu(passed_us, way_points_m),
        steps=_steps(passed_us, way_points_m),
        headings=_headings(passed_us, way_points_m),
        marks=Marks(
            time_us=passed_us,
            x_m=way_points_m[:, 0],
            y_m=way_points_m[:, 1],
            level=np.zeros(len(passed_us), np.int16),
        ),
    )
    return Walk(name=name, walker="tester", phone="any", kind=kind, observations=observations)


def _readings(
    venue: Venue,
    name: str,
    passed_us: NDArray[np.int64],
    way_points_m: NDArray[np.float64],
    seed: int,
) -> Readings:
    """Log-distance readings, exponent 2 and 4 dB noise, of a beacon drawn for each."""
    # Every fifth reading is heard in the same microsecond as the one before.
    count = int(passed_us[-1]) // _READING_US
    ordinals = np.arange(count, dtype=np.int64)
    time_us = (ordinals - (ordinals % 5 == 4)) * _READING_US
    x_m, y_m = (np.interp(time_us, passed_us, axis) for axis in way_points_m.T)
    draws = Draws(seed=seed, purpose="practice reading", walker=name)
    which, noise = (
        draws.uniforms(ordinals),
        replace(draws, purpose="practice noise").normals(ordinals),
    )
    beacon = (which[:, 0] * len(venue.beacons)).astype(np.int32)
    apart_m = venue.beacon_xyz_m[beacon, :2] - np.stack([x_m, y_m], axis=1)
    distance_m = np.hypot(np.hypot(*apart_m.T), _HEIGHT_DIFFERENCE_M)
    rssi_dbm = _MEASURED_POWER_DBM - 20.0 * np.log10(distance_m) + 4.0 * noise[:, 0]
    return Readings(
        time_us=time_us,
        beacon=beacon,
        rssi_dbm=np.clip(np.rint(rssi_dbm), -100, -20).astype(np.int8),
        channel=(37 + (which[:, 1] * 3).astype(np.int64)).astype(np.uint8),
    )


def _steps(passed_us: NDArray[np.int64], way_points_m: NDArray[np.float64]) -> Steps:
    time_us = np.arange(_STEP_US, int(passed_us[-1]) + 1, _STEP_US)
    return Steps(
        time_us=time_us,
        length_m=np.full(len(time_us), _SPEED_M_S * _STEP_US * 1e-6),
        heading_rad=_heading_rad(time_us, passed_us, way_points_m),
    )


def _headings(passed_us: NDArray[np.int64], way_points_m: NDArray[np.float64]) -> Headings:
    time_us = np.arange(0, int(passed_us[-1]) + 1, _HEADING_US)
    heading_rad = _heading_rad(time_us, passed_us, way_points_m)
    return Headings(time_us=time_us, heading_rad=heading_rad)


def _heading_rad(
    time_us: NDArray[np.int64], passed_us: NDArray[np.int64], way_points_m: NDArray[np.float64]
) -> NDArray[np.float64]:
    leg = np.minimum(np.searchsorted(passed_us, time_us, side="right") - 1, len(passed_us) - 2)
    along = np.diff(way_points_m, axis=0)[leg]
    heading_rad: NDArray[np.float64] = np.arctan2(along[:, 1], along[:, 0])
    return heading_rad


def _imu(passed_us: NDArray[np.int64], way_points_m: NDArray[np.float64]) -> Imu:
    """Samples of a phone held flat, its y axis ahead, that bounces once a step."""
    time_us = np.arange(0, int(passed_us[-1]) + 1, _IMU_US)
    heading_rad = _turned(_heading_rad(time_us, passed_us, way_points_m))
    turn_rate_rad_s = np.diff(heading_rad, prepend=heading_rad[0]) / (_IMU_US * 1e-6)
    none = np.zeros(len(time_us))
    bounce_m_s2 = _BOUNCE_M_S2 * np.sin(2.0 * np.pi * time_us / _STEP_US)
    return Imu(
        time_us=time_us,
        acceleration_x_m_s2=none,
        acceleration_y_m_s2=none,
        acceleration_z_m_s2=_GRAVITY_M_S2 + bounce_m_s2,
        angular_rate_x_rad_s=none,
        angular_rate_y_rad_s=none,
        angular_rate_z_rad_s=turn_rate_rad_s,
        magnetic_field_x_ut=-20.0 * np.cos(heading_rad),
        magnetic_field_y_ut=20.0 * np.sin(heading_rad),
        magnetic_field_z_ut=none - 45.0,
    )


def _turned(heading_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Headings that turn evenly at the corners, not wrapped."""
    padded = np.pad(np.unwrap(heading_rad), (_TURN_SAMPLES - 1, 0), mode="edge")
    return np.convolve(padded, np.full(_TURN_SAMPLES, 1.0 / _TURN_SAMPLES), mode="valid")
