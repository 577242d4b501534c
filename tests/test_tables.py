import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from blesim import columns, tables
from blesim.columns import Stream
from blesim.errors import DataError
from blesim.tables import Marks, Readings, Steps, Table, Track, Trajectory

TABLES = (
    tables.Readings,
    tables.Imu,
    tables.Steps,
    tables.Marks,
    tables.Trajectory,
    tables.Headings,
    tables.Pressures,
    tables.StepTruth,
    tables.Carrying,
    tables.Visits,
    tables.Packets,
    tables.BeaconHistory,
    tables.Track,
)


def readings(**changes: Any) -> Readings:
    values = {"time_us": [1, 2, 2], "beacon": [0, 1, 0], "rssi_dbm": [-60, -71, -80]}
    return Readings(**{**values, "channel": [0, 37, 39], **changes})


def test_a_reading_tells_no_proximity_class_unless_one_is_given() -> None:
    assert readings().proximity.tolist() == [0, 0, 0]
    assert readings(proximity=[1, 2, 3]).proximity.tolist() == [1, 2, 3]
    assert Readings(time_us=[], beacon=[], rssi_dbm=[], channel=[]) == Readings.empty()
    with pytest.raises(DataError, match="'proximity': 0"):
        readings(proximity=[])


def random_table(kind: type[Table], rows: int, seed: int) -> Table:
    rng = np.random.default_rng(seed)
    values: dict[str, Any] = {}
    for column in kind.STREAM.columns:
        low, high = column.valid_range or (0, 1)
        drawn = rng.uniform(max(low, -1e4), min(high, 1e4), rows)
        values[column.field] = np.floor(drawn) if column.numpy_dtype.kind in "iu" else drawn
    values["time_us"] = np.sort(values["time_us"])
    return kind(**values)


@pytest.mark.parametrize("kind", TABLES)
def test_fields_are_the_columns(kind: type[Table]) -> None:
    assert tables.field_names(kind) == tuple(column.field for column in kind.STREAM.columns)


def test_a_carrying_mode_holds_until_the_next() -> None:
    carrying = tables.Carrying(time_us=[10, 20], carrying=[0, 3])
    assert carrying.at(np.array([0, 10, 19, 20, 99])).tolist() == [0, 0, 0, 3, 3]


def test_every_stream_of_the_file_has_its_table() -> None:
    streams: set[Stream] = {kind.STREAM for kind in TABLES}
    assert streams == {*columns.OBSERVATIONS, *columns.TRUTH, *columns.HISTORY, columns.TRACK}
    declared = {thing for thing in vars(tables).values() if isinstance(thing, type)}
    assert set(TABLES) == {kind for kind in declared if issubclass(kind, Table)} - {Table}


@pytest.mark.parametrize("kind", TABLES)
def test_columns_have_their_recorded_type_and_are_read_only(kind: type[Table]) -> None:
    table = random_table(kind, 20, seed=1)
    for column, values in zip(kind.STREAM.columns, table.arrays(), strict=True):
        assert values.dtype == column.numpy_dtype
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 0


@pytest.mark.parametrize("kind", TABLES)
def test_building_again_changes_nothing(kind: type[Table]) -> None:
    table = random_table(kind, 500, seed=2)
    again = kind(**{column.field: table[column] for column in kind.STREAM.columns})
    assert again == table
    for one, other in zip(table.arrays(), again.arrays(), strict=True):
        assert one.tobytes() == other.tobytes()


@given(st.lists(st.floats(-1e5, 1e5), max_size=30))
def test_decimals_are_kept_and_stay(x_m: list[float]) -> None:
    zeros = np.zeros(len(x_m))
    marks = Marks(time_us=zeros, x_m=x_m, y_m=zeros, level=zeros)
    np.testing.assert_allclose(marks.x_m, x_m, rtol=0, atol=0.5001e-6)
    again = Marks(time_us=zeros, x_m=marks.x_m, y_m=zeros, level=zeros)
    assert again.x_m.tobytes() == marks.x_m.tobytes()


def test_last_bits_never_reach_the_file() -> None:
    one, other = 0.1 + 0.2, 0.3
    assert one != other
    assert steps(length_m=[one]).length_m.tobytes() == steps(length_m=[other]).length_m.tobytes()


def steps(**changes: Any) -> Steps:
    return Steps(**{"time_us": [1], "length_m": [0.7], "heading_rad": [0.0], **changes})


@pytest.mark.parametrize("value", [-0.0, -1e-9])
def test_there_is_no_minus_zero(value: float) -> None:
    assert not np.signbit(steps(heading_rad=[value]).heading_rad[0])


def test_the_caller_keeps_an_array_of_its_own() -> None:
    time_us = np.array([1, 2, 3], dtype=np.int64)
    mine = readings(time_us=time_us)
    time_us[0] = -5
    assert mine.time_us.tolist() == [1, 2, 3]
    assert time_us.flags.writeable


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"beacon": [0, 1]}, "/rssi: columns of different length: .*'beacon': 2"),
        ({"time_us": [1, 3, 2]}, "/rssi: times go backwards; sort the rows"),
        ({"beacon": [[0, 1, 0]]}, "column beacon: one value a row is needed, not 2-D"),
        ({"beacon": 0}, "column beacon: one value a row is needed, not 0-D"),
        ({"rssi_dbm": [-60, 200, -80]}, "column rssi_dbm: 200 in row 1 does not fit int8"),
        ({"rssi_dbm": [-60, -71.5, -80]}, "column rssi_dbm: -71.5 in row 1 does not fit int8"),
        ({"rssi_dbm": [np.nan, -71, -80]}, "column rssi_dbm: nan in row 0 does not fit int8"),
        ({"channel": [0, 37, -1]}, "column channel: -1 in row 2 does not fit uint8"),
        ({"time_us": [1, 2, 2.5]}, "column time_us: 2.5 in row 2 does not fit int64"),
        ({"beacon": [0, 2**31, 0]}, "column beacon: 2147483648 in row 1 does not fit int32"),
    ],
)
def test_what_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(DataError, match=message):
        readings(**changes)


def test_whole_numbers_may_come_as_floats() -> None:
    assert readings(rssi_dbm=np.array([-60.0, -71.0, -80.0])) == readings()


def test_rows_of_a_slice_are_views() -> None:
    whole = readings()
    part = whole.rows(slice(1, 3))
    assert np.shares_memory(part.rssi_dbm, whole.rssi_dbm)
    assert (len(part), part.rssi_dbm.tolist()) == (2, [-71, -80])
    assert not part.rssi_dbm.flags.writeable


def test_rows_of_a_mask_and_of_numbers() -> None:
    whole = readings()
    heard = whole.rows(whole.channel > 0)
    assert heard.beacon.tolist() == [1, 0]
    assert heard == whole.rows(np.array([1, 2]))
    assert not heard.beacon.flags.writeable
    assert whole.channel.tolist() == [0, 37, 39]


@pytest.mark.parametrize("kind", TABLES)
def test_cut_and_joined_is_the_same(kind: type[Table]) -> None:
    whole = random_table(kind, 50, seed=3)
    parts = [whole.rows(slice(0, 0)), whole.rows(slice(0, 17)), whole.rows(slice(17, 50))]
    assert kind.concatenate(parts) == whole


def test_joining_out_of_order_is_refused() -> None:
    with pytest.raises(DataError, match="times go backwards"):
        Readings.concatenate([readings(), readings()])


@pytest.mark.parametrize("kind", TABLES)
def test_empty_tables(kind: type[Table]) -> None:
    empty = kind.empty()
    assert len(empty) == 0
    assert empty == kind.concatenate([]) == kind.concatenate([empty, empty])
    assert [values.dtype for values in empty.arrays()] == [
        column.numpy_dtype for column in kind.STREAM.columns
    ]


def test_equality() -> None:
    assert readings() == readings()
    assert readings() != readings(rssi_dbm=[-60, -71, -81])
    assert readings() != readings().rows(slice(0, 2))
    assert readings() != "readings"
    assert Readings.empty() != Marks.empty()
    with pytest.raises(TypeError, match="unhashable"):
        hash(readings())


def test_unknown_equals_unknown() -> None:
    assert knots([0, 9], edge=[-1, -1], offset_m=[np.nan, np.nan]) == knots(
        [0, 9], edge=[-1, -1], offset_m=[np.nan, np.nan]
    )
    assert knots([0, 9], offset_m=[np.nan, 0.0]) != knots([0, 9], offset_m=[0.0, 0.0])


def test_a_table_stays_read_only_in_another_process() -> None:
    for protocol in range(2, pickle.HIGHEST_PROTOCOL + 1):
        copy = pickle.loads(pickle.dumps(readings(), protocol=protocol))  # noqa: S301
        assert copy == readings()
        assert not copy.rssi_dbm.flags.writeable


def knots(time_us: list[int], **changes: Any) -> Trajectory:
    zeros = np.zeros(len(time_us))
    names = tables.field_names(Trajectory)[1:]
    return Trajectory(**{"time_us": time_us, **dict.fromkeys(names, zeros), **changes})


# 10 m east in 10 s, a turn on the spot to the north in 2 s, 3 m north in 4 s at half speed.
CORNER = knots(
    [0, 10_000_000, 12_000_000, 16_000_000],
    x_m=[0.0, 10.0, 10.0, 10.0],
    y_m=[5.0, 5.0, 5.0, 8.0],
    heading_rad=[0.0, 0.0, 1.570796, 1.570796],
    speed_m_s=[1.0, 0.0, 0.75, 0.0],
    edge=[4, 7, 7, 7],
    offset_m=[2.0, 3.0, 3.0, 0.0],
    edge_speed_m_s=[1.0, 0.0, -0.75, 0.0],
    state=[1, 2, 1, 0],
    level=[0, 0, 0, 1],
)


def test_poses_worked_by_hand() -> None:
    poses = CORNER.at(np.array([2_500_000, 11_000_000, 13_000_000, 0]))
    assert poses.x_m.tolist() == [2.5, 10.0, 10.0, 0.0]
    assert poses.y_m.tolist() == [5.0, 5.0, 5.75, 5.0]
    np.testing.assert_allclose(poses.heading_rad, [0.0, 0.785398, 1.570796, 0.0], atol=1e-12)
    assert poses.speed_m_s.tolist() == [1.0, 0.0, 0.75, 1.0]
    assert poses.edge.tolist() == [4, 7, 7, 4]
    np.testing.assert_allclose(poses.offset_m, [4.5, 3.0, 2.25, 2.0], atol=1e-12)
    assert poses.state.tolist() == [1, 2, 1, 1]
    assert poses.level.tolist() == [0, 0, 0, 0]


def test_poses_at_the_knots_are_the_knots() -> None:
    poses = CORNER.at(CORNER.time_us)
    for name in ("x_m", "y_m", "speed_m_s", "edge", "offset_m", "state", "level"):
        np.testing.assert_array_equal(getattr(poses, name), getattr(CORNER, name))
    np.testing.assert_allclose(poses.heading_rad, CORNER.heading_rad, atol=1e-15)


def test_positions_are_those_of_numpy() -> None:
    rng = np.random.default_rng(7)
    time_us = np.concatenate([[0], np.cumsum(rng.integers(1, 5_000_000, 40))])
    walk = knots(time_us.tolist(), x_m=rng.normal(0, 30, 41), y_m=rng.normal(0, 30, 41))
    asked = rng.integers(0, time_us[-1] + 1, 1_000)
    poses = walk.at(asked)
    np.testing.assert_allclose(poses.x_m, np.interp(asked, time_us, walk.x_m), atol=1e-9)
    np.testing.assert_allclose(poses.y_m, np.interp(asked, time_us, walk.y_m), atol=1e-9)


@pytest.mark.parametrize("time_us", [-1, 16_000_001])
def test_times_outside_the_walk_are_refused(time_us: int) -> None:
    with pytest.raises(DataError, match="outside the walk, which lasts from 0 to 16000000 us"):
        CORNER.at(np.array([5, time_us]))


def test_no_times_and_no_walk() -> None:
    assert len(Trajectory.empty().at(np.empty(0, np.int64)).x_m) == 0
    with pytest.raises(DataError, match="no trajectory"):
        Trajectory.empty().at(np.array([0]))


def test_a_walk_of_one_knot() -> None:
    poses = knots([5], x_m=[3.0]).at(np.array([5, 5]))
    assert poses.x_m.tolist() == [3.0, 3.0]


@pytest.mark.parametrize(
    ("before", "after", "middle"),
    [(3.0, -3.0, np.pi), (-3.0, 3.0, np.pi), (0.5, -0.5, 0.0), (-2.0, 2.0, np.pi)],
)
def test_a_heading_turns_the_short_way(before: float, after: float, middle: float) -> None:
    heading = knots([0, 2], heading_rad=[before, after]).at(np.array([1])).heading_rad[0]
    assert np.cos(heading - middle) == pytest.approx(1.0)


def test_a_turn_to_the_opposite_passes_a_right_angle() -> None:
    heading = knots([0, 2], heading_rad=[0.0, np.pi]).at(np.array([1])).heading_rad[0]
    assert abs(heading) == pytest.approx(np.pi / 2, abs=1e-6)


def test_a_u_turn_in_no_time_jumps() -> None:
    # Two knots at 2 s: before it the first heading holds, from it on the second.
    walk = knots(
        [0, 2_000_000, 2_000_000, 4_000_000],
        x_m=[0.0, 2.0, 2.0, 0.0],
        heading_rad=[0.0, 0.0, 3.141592, 3.141592],
        speed_m_s=[1.0, 0.0, 1.0, 0.0],
        edge_speed_m_s=[1.0, 0.0, -1.0, 0.0],
        offset_m=[0.0, 2.0, 2.0, 0.0],
    )
    poses = walk.at(np.array([1_999_999, 2_000_000, 3_000_000]))
    np.testing.assert_allclose(poses.x_m, [1.999999, 2.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(np.cos(poses.heading_rad), [1.0, -1.0, -1.0], atol=1e-9)
    np.testing.assert_allclose(poses.offset_m, [1.999999, 2.0, 1.0], atol=1e-12)
    assert poses.speed_m_s.tolist() == [1.0, 1.0, 1.0]


def test_poses_off_the_graph_have_no_offset() -> None:
    nan = [np.nan, np.nan]
    poses = knots([0, 2], edge=[-1, -1], offset_m=nan, edge_speed_m_s=nan).at(np.array([1]))
    assert poses.edge.tolist() == [-1]
    assert np.isnan(poses.offset_m[0])


def test_a_track_keeps_its_covariance_unrounded() -> None:
    tiny = 1.23456789e-9
    zero = dict.fromkeys(tables.field_names(Track), np.zeros(1))
    assert Track(**{**zero, "variance_x_m2": [tiny]}).variance_x_m2[0] == tiny


def test_an_accelerating_walker_is_where_the_formula_says() -> None:
    # From rest at 0.5 m/s2 for 4 s: 4 m; then steady at 2 m/s for 1 s.
    walked = knots(
        [0, 4_000_000, 5_000_000],
        x_m=[0.0, 4.0, 6.0],
        speed_m_s=[0.0, 2.0, 0.0],
        acceleration_m_s2=[0.5, 0.0, 0.0],
        offset_m=[10.0, 6.0, 4.0],
        edge_speed_m_s=[-1.0, -2.0, 0.0],
    )
    poses = walked.at(np.array([0, 1_000_000, 2_000_000, 4_000_000, 4_500_000]))
    np.testing.assert_allclose(poses.x_m, [0.0, 0.25, 1.0, 4.0, 5.0], atol=1e-12)
    np.testing.assert_allclose(poses.speed_m_s, [0.0, 0.5, 1.0, 2.0, 2.0], atol=1e-12)
    np.testing.assert_allclose(poses.offset_m, [10.0, 9.75, 9.0, 6.0, 5.0], atol=1e-12)


def test_a_walker_who_brakes_to_rest_meets_the_next_knot() -> None:
    walked = knots(
        [0, 2_000_000], x_m=[3.0, 5.0], speed_m_s=[2.0, 0.0], acceleration_m_s2=[-1.0, 0.0]
    )
    poses = walked.at(np.array([1_000_000, 2_000_000]))
    np.testing.assert_allclose(poses.x_m, [4.5, 5.0], atol=1e-12)
    np.testing.assert_allclose(poses.speed_m_s, [1.0, 0.0], atol=1e-12)
