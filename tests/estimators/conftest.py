"""An invented office without noise, on which a range or a fingerprint has one right answer."""

from types import SimpleNamespace
from uuid import UUID

import numpy as np
import pytest
import shapely

from blesim.recording import Observations, Provenance, Recording, Walk, WalkKind
from blesim.rng import Draws
from blesim.tables import Marks, Readings
from blesim.venue.beacons import Beacon
from blesim.venue.floor_plan import FloorPlan, Level
from blesim.venue.venue import Venue

BEACONS_M = ((1.0, 1.0), (11.0, 1.0), (11.0, 9.0), (1.0, 9.0), (6.0, 5.5))
ALL_BEACONS = tuple(range(len(BEACONS_M)))
HEIGHT_M, PHONE_HEIGHT_M = 2.2, 1.2
LEVEL_DBM = {0: -50.0, 37: -48.0, 38: -50.0, 39: -52.0}
EXPONENT = 2.0
READING_US = 20_000


def office_venue():
    beacons = tuple(
        Beacon(
            id=f"B{row + 1}",
            uuid=UUID(int=0xB1E),
            major=1,
            minor=row,
            x_m=x_m,
            y_m=y_m,
            z_m=HEIGHT_M,
            tx_power_dbm=0.0,
            measured_power_dbm=-50.0,
            advertising_interval_s=0.1,
        )
        for row, (x_m, y_m) in enumerate(BEACONS_M)
    )
    level = Level(level=0, bounds=shapely.box(0.0, 0.0, 12.0, 10.0))
    return Venue(name="office", floor_plan=FloorPlan(levels=(level,)), beacons=beacons)


def heard(time_us, x_m, y_m, beacon, channel):
    """Readings without noise, but whole dBm, at places of all shapes (n,)."""
    beacons_m = np.array(BEACONS_M)[beacon]
    apart_m = np.hypot(x_m - beacons_m[:, 0], y_m - beacons_m[:, 1])
    distance_m = np.hypot(apart_m, HEIGHT_M - PHONE_HEIGHT_M)
    level_dbm = np.array([LEVEL_DBM[each] for each in channel.tolist()])
    rssi_dbm = np.rint(level_dbm - 10.0 * EXPONENT * np.log10(distance_m))
    return Readings(time_us=time_us, beacon=beacon, rssi_dbm=rssi_dbm, channel=channel)


def walked(from_m, to_m, duration_s, *, channels=(0,), beacons=ALL_BEACONS):
    """Readings on a straight way, in turn of all beacons and channels, and the way itself."""
    time_us = np.arange(0, round(duration_s * 1e6), READING_US)
    turn, share = np.arange(len(time_us)), time_us / (duration_s * 1e6)
    beacon = np.array(beacons)[turn % len(beacons)]
    channel = np.array(channels)[(turn // len(beacons)) % len(channels)]
    way_m = np.array(from_m) + share[:, None] * (np.array(to_m) - np.array(from_m))
    return heard(time_us, way_m[:, 0], way_m[:, 1], beacon, channel)


def office_survey(channels=(0,)):
    """Survey that stands a second at every metre of the office."""
    x_m, y_m = (axis.ravel() for axis in np.meshgrid(np.arange(1.0, 12.0), np.arange(1.0, 10.0)))
    second_us, count = 1_000_000, len(BEACONS_M) * len(channels)
    begins_us = np.arange(len(x_m)) * 2 * second_us
    time_us = (begins_us[:, None] + np.arange(2 * count) * READING_US).ravel()
    place, turn = np.repeat(np.arange(len(x_m)), 2 * count), np.tile(np.arange(2 * count), len(x_m))
    beacon, channel = (
        turn % len(BEACONS_M),
        np.array(channels)[turn // len(BEACONS_M) % len(channels)],
    )
    marks_us = (begins_us[:, None] + [0, second_us]).ravel()
    walk = Walk(
        name="survey",
        walker="tester",
        phone="any",
        kind=WalkKind.SURVEY,
        observations=Observations(
            readings=heard(time_us, x_m[place], y_m[place], beacon, channel),
            marks=Marks(
                time_us=marks_us,
                x_m=np.repeat(x_m, 2),
                y_m=np.repeat(y_m, 2),
                level=np.zeros(len(marks_us), np.int16),
            ),
        ),
    )
    provenance = Provenance(title="Office", source="test")
    return Recording(venue=office_venue(), walks=(walk,), provenance=provenance)


def follow(estimator, readings, *, channels=(0,), venue=None):
    """Track of an estimator fitted on the office, and its tracker."""
    recording = office_survey(channels)
    fitted = estimator.fit(recording.venue if venue is None else venue, (recording,))
    tracker = fitted.start(None, Draws(seed=1, purpose="test").generator())
    return tracker.advance(Observations(readings=readings)), tracker


@pytest.fixture(scope="session")
def office():
    """The office: its venue, its survey, readings on a way through it, and the run of a system."""
    return SimpleNamespace(
        venue=office_venue(),
        beacons_m=np.array([(*place, HEIGHT_M) for place in BEACONS_M]),
        phone_height_m=PHONE_HEIGHT_M,
        survey=office_survey,
        heard=heard,
        walked=walked,
        follow=follow,
    )
