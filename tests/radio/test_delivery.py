import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from blesim import columns
from blesim.radio.delivery import Delivery, deliver
from blesim.tables import Readings

CLASS = dict(columns.PROXIMITIES)
POWER_DBM = np.array([-60.0, -70.0])


def readings(*rows: tuple[int, int, int]) -> Readings:
    time_us, beacon, rssi_dbm = zip(*rows, strict=True) if rows else ((), (), ())
    return Readings(
        time_us=np.array(time_us, np.int64),
        beacon=np.array(beacon, np.int64),
        rssi_dbm=np.array(rssi_dbm, np.int64),
        channel=np.full(len(rows), 38),
    )


def delivered(given: Readings, start_us: int = 0, end_us: int = 10_000_000, **settings: object):
    return deliver(given, Delivery(**settings), POWER_DBM, start_us, end_us)


def test_each_packet_is_handed_over_as_it_comes():
    given = readings((5, 0, -60), (7, 1, -70))
    assert delivered(given) == given


def test_once_a_second_the_mean_of_each_beacon_heard_in_it():
    given = readings(
        (2_100_000, 0, -60), (2_200_000, 1, -80), (2_900_000, 0, -63), (3_400_000, 0, -50)
    )
    got = delivered(given, start_us=2_000_000, mode="one-second-mean")
    assert got.time_us.tolist() == [3_000_000, 3_000_000, 4_000_000]
    assert got.beacon.tolist() == [0, 1, 0]
    # -61.5 is rounded half to even.
    assert got.rssi_dbm.tolist() == [-62, -80, -50]
    assert got.channel.tolist() == [0, 0, 0]


def test_a_packet_at_the_turn_of_a_second_counts_for_the_next():
    got = delivered(readings((999_999, 0, -60), (1_000_000, 0, -70)), mode="one-second-mean")
    assert got.time_us.tolist() == [1_000_000, 2_000_000]
    assert got.rssi_dbm.tolist() == [-60, -70]


@pytest.mark.parametrize(
    ("distance_m", "expected"),
    [(0.3, "immediate"), (0.44, "immediate"), (0.55, "near"), (2.7, "near"), (3.3, "far")],
)
def test_proximity_classes_follow_the_distance(distance_m, expected):
    rssi_dbm = round(-60.0 - 20.0 * np.log10(distance_m))
    got = delivered(readings((1, 0, rssi_dbm)), mode="one-second-mean")
    assert got.proximity.tolist() == [CLASS[expected]]


def test_thresholds_exponent_and_measured_power_are_settings():
    # 12 dB below the measured power: 4 m with an exponent of 2, 2 m with one of 4.
    given = readings((1, 0, -72), (2, 1, -72))
    far, near = delivered(given, mode="one-second-mean").proximity
    assert (far, near) == (CLASS["far"], CLASS["near"])
    steep = delivered(given, mode="one-second-mean", path_loss_exponent=4.0)
    assert steep.proximity[0] == CLASS["near"]
    wide = delivered(given, mode="one-second-mean", near_m=5.0)
    assert wide.proximity[0] == CLASS["near"]


def test_a_single_strong_second_does_not_change_the_class_of_a_smoothed_beacon():
    weak = [(second * 1_000_000 + 1, 0, -80) for second in range(9)]
    given = readings(*weak[:8], (8_000_001, 0, -66))
    smooth = delivered(given, mode="one-second-mean", smoothing_s=10.0)
    raw = delivered(given, mode="one-second-mean", smoothing_s=0.0)
    assert smooth.proximity[-1] == CLASS["far"]
    assert raw.proximity[-1] == CLASS["near"]
    assert smooth.rssi_dbm.tolist() == raw.rssi_dbm.tolist() == [-80] * 8 + [-66]


def test_smoothing_follows_its_time_constant():
    # After one constant 1 - 1/e of a step of 20 dB has come: -80 + 12.64 = -67.4 dBm, 2.3 m.
    given = readings((1, 0, -80), (1_000_001, 0, -60))
    near = delivered(given, mode="one-second-mean", smoothing_s=1.0, near_m=2.4)
    far = delivered(given, mode="one-second-mean", smoothing_s=1.0, near_m=2.3)
    assert (near.proximity[1], far.proximity[1]) == (CLASS["near"], CLASS["far"])


def test_batches_arrive_together_in_the_order_of_the_packets():
    given = readings((10, 1, -60), (20, 0, -61), (1_999_999, 1, -62), (2_000_000, 0, -63))
    got = delivered(given, batch_s=2.0)
    assert got.time_us.tolist() == [2_000_000] * 3 + [4_000_000]
    assert got.rssi_dbm.tolist() == [-60, -61, -62, -63]
    assert got.channel.tolist() == [38] * 4


def test_what_would_arrive_after_the_end_never_does():
    given = readings((10, 0, -60), (1_500_000, 0, -61))
    assert len(delivered(given, end_us=1_999_999, mode="one-second-mean")) == 1
    assert len(delivered(given, end_us=2_000_000, mode="one-second-mean")) == 2
    assert len(delivered(given, end_us=1_500_000, batch_s=1.0)) == 1


@pytest.mark.parametrize("settings", [{}, {"mode": "one-second-mean"}, {"batch_s": 3.0}])
def test_nothing_heard_is_nothing_delivered(settings):
    assert delivered(readings(), **settings) == Readings.empty()


@given(
    rows=st.lists(
        st.tuples(st.integers(5_000_000, 60_000_000), st.integers(0, 1), st.integers(-100, -40)),
        max_size=60,
    ).map(sorted),
    batch_s=st.sampled_from([0.0, 0.7, 5.0]),
)
def test_means_lie_within_what_was_heard_and_nothing_arrives_early(rows, batch_s):
    given = readings(*rows)
    got = delivered(
        given, start_us=5_000_000, end_us=10**9, mode="one-second-mean", batch_s=batch_s
    )
    seconds = {((time_us - 5_000_000) // 1_000_000, beacon) for time_us, beacon, _ in rows}
    assert len(got) == len(seconds)
    for beacon in (0, 1):
        heard, told = (t.rssi_dbm[t.beacon == beacon] for t in (given, got))
        assert len(told) == 0 or heard.min() <= told.min() <= told.max() <= heard.max()
    if rows:
        assert got.time_us[-1] > rows[-1][0]


def test_classes_must_ascend():
    with pytest.raises(ValidationError, match="immediate_m 4 is farther than near_m 3"):
        Delivery(immediate_m=4.0)
