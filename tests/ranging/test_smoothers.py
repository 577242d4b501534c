import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.signal import lfilter

from blesim.errors import DataError, UsageError
from blesim.ranging.channels import SLOTS, channel_slot
from blesim.ranging.smoothers import Smoothing
from blesim.ranging.smoothing import SignalWindow
from blesim.tables import Readings

BEACONS = 3
KINDS = ["moving", "exponential", "averaged", "highest"]
SETTINGS = [Smoothing(kind=kind, last=3, window_s=1.0) for kind in KINDS]
SETTINGS += [Smoothing(kind=kind, last=3, window_s=1.0, by_channel=True) for kind in KINDS]
# Times on a coarse grid, so that readings share a moment and are exactly one window old.
READING = st.tuples(
    st.integers(0, 12), st.integers(0, BEACONS - 1), st.integers(-99, -40), st.integers(36, 39)
)


def readings_of(rows):
    columns = np.array(sorted(rows, key=lambda row: row[0]), np.int64).reshape(-1, 4).T
    return Readings(
        time_us=columns[0] * 250_000,
        beacon=columns[1],
        rssi_dbm=columns[2],
        channel=np.where(columns[3] == 36, 0, columns[3]),
    )


def alone(rssi_dbm, seconds=None):
    """Readings of beacon 1 alone, one a tenth of a second unless told."""
    count = len(rssi_dbm)
    return Readings(
        time_us=(np.arange(count) * 0.1 if seconds is None else np.array(seconds)) * 1e6 // 1,
        beacon=np.ones(count, np.int64),
        rssi_dbm=np.array(rssi_dbm),
        channel=np.zeros(count, np.int64),
    )


def plain_value(smoothing, times_us, values_dbm, now_us):
    """Value of one key word by word from all its readings so far; NaN if it has none."""
    window_us = smoothing.window_s * 1e6
    if smoothing.kind in ("averaged", "highest"):
        values_dbm = [
            v for t, v in zip(times_us, values_dbm, strict=True) if t > now_us - window_us
        ]
    else:
        ends = [*times_us, now_us]
        gaps = [i for i in range(len(times_us)) if ends[i + 1] - ends[i] >= window_us]
        values_dbm = values_dbm[gaps[-1] + 1 :] if gaps else values_dbm
    if not values_dbm:
        return np.nan
    if smoothing.kind == "moving":
        return np.mean(values_dbm[-smoothing.last :])
    if smoothing.kind == "highest":
        return max(values_dbm)
    value = values_dbm[0]
    for each in values_dbm[1:]:
        value = smoothing.rate * each + (1 - smoothing.rate) * value
    return value


@given(st.lists(READING, min_size=1, max_size=30), st.sampled_from(SETTINGS))
def test_all_kinds_agree_with_their_equations_word_by_word(rows, smoothing):
    readings = readings_of(rows)
    signals = smoothing.start(BEACONS).signals(readings)
    own = smoothing.start(BEACONS).smoothed(readings)
    slot = channel_slot(readings.channel) if smoothing.by_channel else np.zeros(len(rows), int)
    for row in range(len(readings)):
        now_us, so_far = readings.time_us[row], slice(0, row + 1)
        for key in np.ndindex(signals.shape[1:]):
            mine = readings.beacon[so_far] == key[0]
            mine &= (slot[so_far] == key[1]) if smoothing.by_channel else True
            times_us = readings.time_us[so_far][mine].tolist()
            values_dbm = readings.rssi_dbm[so_far][mine].astype(float).tolist()
            expected = plain_value(smoothing, times_us, values_dbm, now_us)
            assert_allclose(signals[(row, *key)], expected, rtol=0, atol=1e-11)
        mine = (readings.beacon[row], slot[row])[: signals.ndim - 1]
        assert own[row] == signals[(row, *mine)]


@given(
    st.lists(READING, min_size=1, max_size=30),
    st.lists(st.integers(0, 30), max_size=5),
    st.sampled_from(SETTINGS),
)
def test_cuts_between_blocks_change_no_bit(rows, cuts, smoothing):
    readings = readings_of(rows)
    whole, live = smoothing.start(BEACONS), smoothing.start(BEACONS)
    expected = whole.signals(readings)
    ends = [0, *sorted(min(cut, len(readings)) for cut in cuts), len(readings)]
    parts = [live.signals(readings.rows(slice(*pair))) for pair in itertools.pairwise(ends)]
    assert np.concatenate(parts).tobytes() == expected.tobytes()
    later_us = int(readings.time_us[-1]) + 500_000
    assert live.at(later_us).tobytes() == whole.at(later_us).tobytes()


@given(st.lists(READING, min_size=1, max_size=20), st.sampled_from(SETTINGS))
def test_a_moment_later_what_is_old_is_forgotten(rows, smoothing):
    readings = readings_of(rows)
    smoother = smoothing.start(BEACONS)
    last = smoother.signals(readings)[-1]
    now_us = int(readings.time_us[-1])
    assert smoother.at(now_us).tobytes() == last.tobytes()
    assert np.isnan(smoother.at(now_us + 1_000_000)).all()
    # Asking does not change the state.
    assert smoother.at(now_us).tobytes() == last.tobytes()


def test_moving_average_worked_by_hand():
    smoother = Smoothing(kind="moving", last=3).start(2)
    assert smoother.smoothed(alone([-60, -66, -72, -78])).tolist() == [-60, -63, -66, -72]


def test_exponential_average_agrees_with_scipy():
    rssi_dbm = np.random.default_rng(1).integers(-90, -50, 200)
    smoother = Smoothing(kind="exponential", rate=0.3).start(2)
    expected, _ = lfilter([0.3], [1, -0.7], rssi_dbm.astype(float), zi=[0.7 * rssi_dbm[0]])
    assert_allclose(smoother.smoothed(alone(rssi_dbm)), expected)


@pytest.mark.parametrize("kind", ["moving", "exponential"])
def test_a_beacon_not_heard_for_long_begins_anew(kind):
    smoother = Smoothing(kind=kind, window_s=2.0).start(2)
    smoothed = smoother.smoothed(alone([-90, -60, -70], seconds=[0.0, 2.0, 3.9]))
    assert smoothed[1] == -60
    assert -70 < smoothed[2] < -60


def test_windows_are_those_of_the_signal_window():
    readings = readings_of([(t, t % 3, -60 - 7 * t % 11, 37) for t in range(12)])
    window = SignalWindow(beacons=BEACONS, signal="averaged", window_s=1.0, rate=0.25)
    assert_allclose(
        Smoothing(kind="averaged", window_s=1.0).start(BEACONS).signals(readings),
        window.signals(readings),
    )


def test_slots_of_the_channels():
    assert channel_slot(np.array([0, 37, 38, 39], np.uint8)).tolist() == [0, 1, 2, 3]
    assert Smoothing(by_channel=True).start(5).at(0).shape == (5, SLOTS)


@pytest.mark.parametrize("smoothing", SETTINGS)
def test_no_readings_and_time_that_goes_back(smoothing):
    smoother = smoothing.start(BEACONS)
    assert len(smoother.smoothed(Readings.empty())) == 0
    assert np.isnan(smoother.at(0)).all()
    smoother.smoothed(alone([-60], seconds=[5.0]))
    with pytest.raises(DataError, match="order of time"):
        smoother.signals(alone([-60], seconds=[4.0]))
    with pytest.raises(DataError, match="order of time"):
        smoother.at(4_000_000)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"kind": "median"}, "moving, exponential"),
        ({"last": 0}, "last 0"),
        ({"rate": 0.0}, "rate 0"),
        ({"window_s": 0.0}, "window_s 0"),
    ],
)
def test_bad_settings_are_refused(wrong, says):
    with pytest.raises(UsageError, match=says):
        Smoothing(**wrong)
