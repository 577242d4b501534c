from collections import Counter

import numpy as np
import pytest

from blesim import columns
from blesim.columns import Column, Stream

STREAMS = [thing for thing in vars(columns).values() if isinstance(thing, Stream)]
COLUMNS = [
    pytest.param(column, id=f"{stream.group}/{column.name}")
    for stream in STREAMS
    for column in stream.columns
]
# UDUNITS names of everything recorded; a new unit is looked up there before it is added here.
UNITS = {"1", "hPa", "microseconds", "s", "m", "m2", "m s-1", "m s-2", "radian", "radian s-1"} | {
    "dBm",
    "dB",
    "microtesla",
}
# What a field's name ends in, for each unit that a name can carry.
SUFFIX = {
    "hPa": "_hpa",
    "microseconds": "_us",
    "s": "_s",
    "m": "_m",
    "m2": "_m2",
    "m s-1": "_m_s",
    "m s-2": "_m_s2",
    "radian": "_rad",
    "radian s-1": "_rad_s",
    "dBm": "_dbm",
    "dB": "_db",
    "microtesla": "_ut",
}


def repeated(names: list[str]) -> list[str]:
    return [name for name, count in Counter(names).items() if count > 1]


@pytest.mark.parametrize("stream", STREAMS, ids=lambda stream: stream.group)
def test_names_in_a_stream_are_unique(stream: Stream) -> None:
    assert not repeated([column.name for column in stream.columns])
    assert not repeated([column.field for column in stream.columns])


def test_groups_and_row_sizes_are_unique() -> None:
    assert not repeated([stream.group for stream in STREAMS])
    assert not repeated([s.row_size for s in (*columns.OBSERVATIONS, *columns.TRUTH)])


def test_row_size_is_spelled_from_the_group() -> None:
    assert columns.RSSI.row_size == "rssi_row_size"
    assert columns.PACKETS.row_size == "truth_rssi_row_size"


@pytest.mark.parametrize(
    "stream", [*columns.OBSERVATIONS, *columns.TRUTH, *columns.HISTORY, columns.TRACK]
)
def test_a_stream_begins_with_its_time(stream: Stream) -> None:
    first = stream.columns[0]
    assert (first.field, first.dtype, stream.ascending) == ("time_us", "int64", True)


@pytest.mark.parametrize("column", COLUMNS)
def test_the_unit_is_known_and_in_the_name(column: Column) -> None:
    if column.is_text:
        assert column.units == ""
        return
    assert column.units in UNITS
    assert column.field == column.name + SUFFIX.get(column.units, "")


@pytest.mark.parametrize("column", COLUMNS)
def test_the_meaning_is_one_line(column: Column) -> None:
    assert column.long_name
    assert "\n" not in column.long_name
    assert column.long_name.isascii()


@pytest.mark.parametrize("column", COLUMNS)
def test_the_type_holds_the_valid_range(column: Column) -> None:
    if column.valid_range is None:
        return
    low, high = column.valid_range
    assert low < high
    if column.numpy_dtype.kind in "iu":
        limits = np.iinfo(column.dtype)
        assert limits.min <= low
        assert high <= limits.max
        assert float(low).is_integer()
        assert float(high).is_integer()


@pytest.mark.parametrize("column", COLUMNS)
def test_flags_are_distinct_and_fit(column: Column) -> None:
    names = [name for name, _ in column.flags]
    values = [value for _, value in column.flags]
    assert len(set(names)) == len(names)
    assert len(set(values)) == len(values)
    assert all(name.replace("_", "").isalnum() for name in names), "CF flag_meanings hold words"
    assert [int(v) for v in np.array(values, column.numpy_dtype)] == values


@pytest.mark.parametrize("column", COLUMNS)
def test_only_floats_have_decimals_or_may_be_missing(column: Column) -> None:
    if column.numpy_dtype.kind != "f":
        assert column.decimals is None
        assert not column.missing


@pytest.mark.parametrize("column", COLUMNS)
def test_columns_of_one_name_agree_in_type_and_unit(column: Column) -> None:
    for stream in STREAMS:
        for other in stream.columns:
            if other.field == column.field and not (column.is_text or other.is_text):
                assert (other.dtype, other.units) == (column.dtype, column.units)
