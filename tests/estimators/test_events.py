import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from blesim.estimators.events import Event, cut, event_order, one_reading_each
from blesim.estimators.practice import practice_recording
from blesim.recording import Observations
from blesim.tables import Marks, Readings, Steps

RECORDING = practice_recording()
SEEN = RECORDING.by_name["there"].observations


def readings_at(times_us):
    count = len(times_us)
    return Readings(
        time_us=np.array(times_us),
        beacon=np.arange(count),
        rssi_dbm=np.full(count, -70),
        channel=np.zeros(count),
    )


def joined(blocks):
    columns = zip(*(block.tables() for block in blocks), strict=True)
    return [type(parts[0]).concatenate(parts) for parts in columns]


def test_at_one_moment_steps_precede_marks_and_marks_readings():
    block = Observations(
        readings=readings_at([5, 10, 10]),
        steps=Steps(time_us=np.array([10]), length_m=np.ones(1), heading_rad=np.zeros(1)),
        marks=Marks(time_us=np.array([10]), x_m=np.ones(1), y_m=np.ones(1), level=np.zeros(1)),
    )
    kind, row = event_order(block)
    assert kind.tolist() == [Event.READING, Event.STEP, Event.MARK, Event.READING, Event.READING]
    assert row.tolist() == [0, 0, 0, 1, 2]


def test_events_of_a_walk_are_in_order_of_time_then_kind_then_row():
    kind, row = event_order(SEEN)
    times = {
        Event.IMU: SEEN.imu.time_us,
        Event.HEADING: SEEN.headings.time_us,
        Event.STEP: SEEN.steps.time_us,
        Event.MARK: SEEN.marks.time_us,
        Event.READING: SEEN.readings.time_us,
    }
    keys = [(times[Event(k)][r], k, r) for k, r in zip(kind.tolist(), row.tolist(), strict=True)]
    assert keys == sorted(keys)
    assert len(set(keys)) == sum(len(time_us) for time_us in times.values())


@settings(deadline=None, max_examples=30)
@given(st.lists(st.integers(0, len(event_order(SEEN)[0])), max_size=8))
def test_blocks_hold_every_event_once_and_in_order(ends):
    blocks = list(cut(SEEN, sorted(ends)))
    assert len(blocks) == len(ends) + 1
    assert joined(blocks) == list(SEEN.tables())


def test_a_cut_may_fall_between_events_of_one_moment():
    blocks = list(cut(Observations(readings=readings_at([5, 5])), [1]))
    assert [len(block.readings) for block in blocks] == [1, 1]


def test_live_blocks_end_with_one_reading_each():
    blocks = list(one_reading_each(SEEN))
    assert [len(block.readings) for block in blocks] == [1] * len(SEEN.readings) + [0]
    for block in blocks[:-1]:
        assert all(
            table.time_us[-1] <= block.readings.time_us[0] for table in block.tables() if len(table)
        )
    assert joined(blocks) == list(SEEN.tables())


def test_no_events_make_one_empty_block():
    assert [len(block.readings) for block in one_reading_each(Observations())] == [0]
