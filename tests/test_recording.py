import pickle
from types import MappingProxyType
from typing import Any
from uuid import UUID

import numpy as np
import pytest
from shapely import box

from blesim import columns
from blesim.errors import DataError
from blesim.recording import (
    Observations,
    Provenance,
    Recording,
    Truth,
    Walk,
    WalkKind,
    WalkTruth,
)
from blesim.tables import BeaconHistory, Marks, Readings
from blesim.venue.beacons import Beacon
from blesim.venue.floor_plan import FloorPlan, Level
from blesim.venue.venue import Venue

BEACON = Beacon(
    id="b1",
    uuid=UUID(int=1),
    major=0,
    minor=0,
    x_m=1.0,
    y_m=1.0,
    z_m=2.0,
    tx_power_dbm=-12.0,
    measured_power_dbm=-60.0,
    advertising_interval_s=0.1,
)
VENUE = Venue(
    name="hall",
    floor_plan=FloorPlan(levels=(Level(level=0, bounds=box(0, 0, 9, 9)),)),
    beacons=(BEACON,),
)
PROVENANCE = Provenance(title="t", source="s")
DEATH = BeaconHistory(
    time_us=[7],
    beacon=[0],
    event=[0],
    x_m=[1.0],
    y_m=[1.0],
    z_m=[1.0],
    level=[0],
    power_change_db=[0.0],
)


def readings(time_us: list[int], beacon: int = 0) -> Readings:
    count = len(time_us)
    return Readings(
        time_us=time_us, beacon=[beacon] * count, rssi_dbm=[-70] * count, channel=[0] * count
    )


def walk(name: str = "w", beacon: int = 0) -> Walk:
    observations = Observations(readings=readings([1, 5], beacon))
    return Walk(name=name, walker="p", phone="x", observations=observations)


def recording(*walks: Walk) -> Recording:
    return Recording(venue=VENUE, walks=walks, provenance=PROVENANCE)


def test_kinds_are_those_of_the_columns() -> None:
    assert [(kind.name.lower(), kind.value) for kind in WalkKind] == list(columns.KINDS)


def test_streams_come_in_the_order_of_the_columns() -> None:
    assert [t.STREAM for t in Observations().tables()] == list(columns.OBSERVATIONS)
    assert [t.STREAM for t in WalkTruth().tables()] == list(columns.TRUTH)
    assert [len(t) for t in (*Observations().tables(), *WalkTruth().tables())] == [0] * 10


def test_what_happened_between_two_times() -> None:
    marks = Marks(time_us=[0, 20], x_m=[1, 2], y_m=[1, 2], level=[0, 0])
    whole = Observations(readings=readings([0, 10, 10, 20]), marks=marks)
    part = whole.between(10, 20)
    assert part.readings.time_us.tolist() == [10, 10]
    assert len(part.marks) == len(part.imu) == 0
    assert whole.between(0, 21).marks == marks
    assert len(whole.between(20, 10).readings) == 0


def test_blocks_put_together_are_the_whole() -> None:
    times = np.sort(np.random.default_rng(1).integers(0, 1_000, 300)).tolist()
    whole = Observations(readings=readings(times))
    blocks = [whole.between(start, start + 100).readings for start in range(0, 1_000, 100)]
    assert Readings.concatenate(blocks) == whole.readings


def test_walks_by_name() -> None:
    assert recording(walk("a"), walk("b")).by_name["b"].name == "b"


@pytest.mark.parametrize(
    ("walks", "message"),
    [
        ((walk("a"), walk("a")), "two walks of the recording have the same name"),
        ((walk("a", beacon=1),), "walk 'a': reading of beacon row 1, but the venue has 1 beacons"),
        ((walk("a", beacon=-1),), "walk 'a': reading of beacon row -1, but the venue has 1"),
    ],
)
def test_what_is_refused(walks: tuple[Walk, ...], message: str) -> None:
    with pytest.raises(DataError, match=message):
        recording(*walks)


@pytest.mark.parametrize(
    "value",
    [
        recording(walk("a")),
        Truth(venue=VENUE, walks=MappingProxyType({"a": WalkTruth()})),
        Truth(venue=VENUE, walks=MappingProxyType({}), beacon_events=DEATH),
    ],
    ids=["recording", "truth", "history"],
)
def test_it_travels_to_another_process(value: Any) -> None:
    copy = pickle.loads(pickle.dumps(value))  # noqa: S301
    assert copy == value


def test_the_name_of_all_walks_together_is_taken():
    with pytest.raises(DataError, match="walk 'all': the name stands for all walks"):
        Walk(name="all", walker="w", phone="p")
