"""Links of a recording: the readings of one walk from one beacon, with where the phone was."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from blesim.columns import NO_EDGE, STATES
from blesim.recording import Walk, WalkTruth
from blesim.tables import Readings, Trajectory
from blesim.units import MICROSECONDS_PER_SECOND, to_s
from blesim.venue.venue import Venue

Numbers = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Link:
    """Readings of one beacon on one walk; arrays (n,), in order of time.

    Attributes
    ----------
    walk, beacon : int
        Which.
    time_s, rssi_dbm : ndarray of float64
        The readings. [s], [dBm]
    channel : ndarray of uint8
        As told; 0 where it is not.
    place_m : ndarray of float64, (n, 2)
        Where the phone was. [m]
    distance_m : ndarray of float64
        To the beacon, in three dimensions. [m]
    """

    walk: int
    beacon: int
    time_s: Numbers
    rssi_dbm: Numbers
    channel: NDArray[np.uint8]
    place_m: Numbers
    distance_m: Numbers

    def __len__(self) -> int:
        """Count the readings."""
        return len(self.time_s)

    @property
    def level_dbm(self) -> float:
        """Mean RSSI. [dBm]."""
        return float(self.rssi_dbm.mean())


def links_of(
    venue: Venue, walks: Sequence[tuple[Walk, WalkTruth]], height_m: float, fewest: int = 1
) -> Iterator[Link]:
    """Links of walks, by walk and then beacon.

    Parameters
    ----------
    venue : Venue
        Where the beacons are.
    walks : sequence of Walk and WalkTruth
        Real or simulated.
    height_m : float
        Of the phone. [m]
    fewest : int
        Links with fewer readings are left out.
    """
    for number, (walk, truth) in enumerate(walks):
        readings = walk.observations.readings
        order = np.argsort(readings.beacon, kind="stable")
        bounds = np.searchsorted(readings.beacon[order], np.arange(len(venue.beacons) + 1))
        for beacon in range(len(venue.beacons)):
            rows = order[bounds[beacon] : bounds[beacon + 1]]
            if len(rows) >= fewest:
                chosen = readings.rows(rows)
                yield _link(number, beacon, chosen, truth.trajectory, venue, height_m)


def _link(
    walk: int,
    beacon: int,
    readings: Readings,
    trajectory: Trajectory,
    venue: Venue,
    height_m: float,
) -> Link:
    poses = trajectory.at(readings.time_us)
    place_m = np.stack([poses.x_m, poses.y_m], axis=1)
    there_m = venue.beacon_xyz_m[beacon]
    flat_m = np.hypot(*(place_m - there_m[:2]).T)
    return Link(
        walk=walk,
        beacon=beacon,
        time_s=to_s(readings.time_us),
        rssi_dbm=readings.rssi_dbm.astype(np.float64),
        channel=readings.channel.astype(np.uint8),
        place_m=place_m,
        distance_m=np.hypot(flat_m, height_m - there_m[2]),
    )


def standing_at(x_m: float, y_m: float, heading_rad: float, duration_s: float) -> Trajectory:
    """Trajectory of somebody, or something, that stays where it is."""
    end_us = round(duration_s * MICROSECONDS_PER_SECOND)
    pair = np.ones(2)
    return Trajectory(
        time_us=np.array([0, end_us]),
        x_m=x_m * pair,
        y_m=y_m * pair,
        level=np.zeros(2, dtype=np.int16),
        heading_rad=heading_rad * pair,
        speed_m_s=np.zeros(2),
        edge=np.full(2, NO_EDGE, dtype=np.int32),
        offset_m=np.full(2, np.nan),
        edge_speed_m_s=np.full(2, np.nan),
        state=np.full(2, dict(STATES)["standing"], dtype=np.uint8),
    )


def median_over(values: Sequence[float]) -> float:
    """Median of those that are numbers; NaN if none is."""
    finite = [value for value in values if np.isfinite(value)]
    return float(np.median(finite)) if finite else np.nan
