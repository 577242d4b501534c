from uuid import UUID

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from blesim.venue.beacons import INTERVAL_STEP_S, Beacon

VALUES = {
    "id": "D1",
    "uuid": UUID("f7826da6-4fa2-4e98-8024-bc5b71e0893e"),
    "major": 1,
    "minor": 2,
    "x_m": 3.0,
    "y_m": 4.0,
    "z_m": 2.0,
    "tx_power_dbm": -12.0,
    "measured_power_dbm": -77.0,
    "advertising_interval_s": 0.35,
}


def beacon(**changes: object) -> Beacon:
    return Beacon(**{**VALUES, **changes})  # type: ignore[arg-type]


def test_the_good_case() -> None:
    assert (beacon().level, beacon().channel_gain_db) == (0, (0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("id", ""),
        ("major", -1),
        ("major", 65536),
        ("minor", 1.0),
        ("x_m", float("nan")),
        ("y_m", float("inf")),
        ("z_m", -0.1),
        ("tx_power_dbm", 21.0),
        ("tx_power_dbm", -41.0),
        ("measured_power_dbm", 0.5),
        ("measured_power_dbm", -128.0),
        ("advertising_interval_s", 0.019375),
        ("advertising_interval_s", 10.240625),
        ("id", "D\n1"),
        ("x_m", 1e6),
        ("y_m", -1e6),
        ("z_m", 1e6),
        ("level", 201),
        ("channel_gain_db", (1.0, 2.0)),
        ("channel_gain_db", (0.0, 0.0, 30.5)),
        ("channel_gain_db", (-30.5, 0.0, 0.0)),
        ("uuid", "f7826da6"),
        ("level", 0.5),
        ("payload", "altbeacon"),
        ("packet_spacing_us", 399),
        ("packet_spacing_us", 1000.5),
        ("facing_deg", 361.0),
        ("front_to_back_db", -1.0),
        ("front_to_back_db", 6.0),
    ],
)
def test_impossible_values(field: str, value: object) -> None:
    with pytest.raises(ValidationError) as refusal:
        beacon(**{field: value})
    assert {fault["loc"][0] for fault in refusal.value.errors()} == {field}


@given(st.integers(32, 16384))
def test_every_interval_of_the_standard_is_accepted(steps: int) -> None:
    # Bluetooth Core 5.4, Vol 6 Part B 4.4.2.2.1: 20 ms to 10.24 s in steps of 0.625 ms.
    assert beacon(advertising_interval_s=steps * INTERVAL_STEP_S)
    assert beacon(advertising_interval_s=round(steps * INTERVAL_STEP_S, 6))


def test_an_interval_between_the_steps_names_the_nearest() -> None:
    with pytest.raises(ValidationError, match=r"multiple of 0\.625 ms; the nearest is 0\.318125 s"):
        beacon(advertising_interval_s=0.318)


@pytest.mark.parametrize(
    ("payload", "duration_us"),
    # 8 us a byte and 16 bytes of overhead; 30 bytes of data in an iBeacon, 31 in an Eddystone-UID.
    [("ibeacon", 8 * (16 + 30)), ("eddystone-uid", 8 * (16 + 31))],
)
def test_a_packet_is_as_long_as_its_payload(payload: str, duration_us: int) -> None:
    assert beacon(payload=payload).packet_duration_us == duration_us


def test_an_antenna_with_a_front_faces_somewhere() -> None:
    assert beacon(facing_deg=90.0, front_to_back_db=6.0).front_to_back_db == 6.0


def test_a_beacon_is_frozen() -> None:
    with pytest.raises(ValidationError, match="frozen"):
        beacon().x_m = 5.0  # type: ignore[misc]
