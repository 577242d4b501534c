"""Small venues, walks and tracks, written down by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from blesim.estimators.base import make_track
from blesim.estimators.practice import practice_venue
from blesim.recording import Observations, Provenance, Recording, Walk, WalkKind
from blesim.tables import Readings, Trajectory

S = 1_000_000


def readings_at(*time_s):
    count = len(time_s)
    return Readings(
        time_us=np.round(np.array(time_s) * S),
        beacon=np.zeros(count),
        rssi_dbm=np.full(count, -70),
        channel=np.zeros(count),
    )


def along_aisle_1(*, edge=0, level=0):
    """12 s along aisle 1 of the practice venue at 1 m/s: from (2, 2) to (14, 2), edge 0."""
    return Trajectory(
        time_us=np.array([0, 12 * S]),
        x_m=np.array([2.0, 14.0]),
        y_m=np.array([2.0, 2.0]),
        level=np.full(2, level),
        heading_rad=np.zeros(2),
        speed_m_s=np.array([1.0, 0.0]),
        edge=np.full(2, edge),
        offset_m=np.array([0.0, 12.0]) if edge >= 0 else np.full(2, np.nan),
        edge_speed_m_s=np.array([1.0, 0.0]) if edge >= 0 else np.full(2, np.nan),
        state=np.array([1, 0]),
    )


def track_of(time_s, x_m, y_m, **columns):
    time_us = np.round(np.atleast_1d(np.asarray(time_s, float)) * S)
    return make_track(
        time_us=time_us, x_m=x_m, y_m=y_m, variance_x_m2=1.0, variance_y_m2=1.0, **columns
    )


def walk_of(name, readings, kind=WalkKind.WALK):
    return Walk(
        name=name,
        walker="tester",
        phone="any",
        kind=kind,
        observations=Observations(readings=readings),
    )


def recording_of(*walks, venue=None):
    return Recording(
        venue=practice_venue() if venue is None else venue,
        walks=walks,
        provenance=Provenance(title="By hand", source="test"),
    )


@pytest.fixture(scope="session")
def by_hand():
    """The functions of this file."""
    return SimpleNamespace(
        readings_at=readings_at,
        along_aisle_1=along_aisle_1,
        track_of=track_of,
        walk_of=walk_of,
        recording_of=recording_of,
    )
