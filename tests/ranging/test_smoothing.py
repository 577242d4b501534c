import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from blesim.errors import DataError, UsageError
from blesim.ranging.smoothing import SignalWindow
from blesim.tables import Readings

BEACONS = 4
WINDOW_S = 1.0

# Times on a coarse grid, so that windows end exactly on a reading and readings share a moment.
READING = st.tuples(st.integers(0, 8), st.integers(0, BEACONS - 1), st.integers(-95, -90))


def readings_of(rows):
    time_us, beacon, rssi_dbm = zip(*sorted(rows, key=lambda row: row[0]), strict=True)
    return Readings(
        time_us=np.array(time_us) * 250_000,
        beacon=np.array(beacon),
        rssi_dbm=np.array(rssi_dbm),
        channel=np.zeros(len(time_us)),
    )


def window(signal="highest", rate=0.25, window_s=WINDOW_S):
    return SignalWindow(beacons=BEACONS, signal=signal, window_s=window_s, rate=rate)


def plain_signals(readings, row, signal, rate):
    """Eq 3 and Eq 4 word by word: values by beacon, and the row at which each was heard last."""
    now_us = readings.time_us[row]
    values, heard = {}, {}
    for beacon in range(BEACONS):
        rows = [
            i
            for i in range(row + 1)
            if readings.beacon[i] == beacon and readings.time_us[i] > now_us - WINDOW_S * 1e6
        ]
        if not rows:
            continue
        rssi = [float(readings.rssi_dbm[i]) for i in rows]
        smooth = rssi[0]
        for r in rssi[1:]:
            smooth = rate * r + (1 - rate) * smooth
        values[beacon] = max(rssi) if signal == "highest" else smooth
        heard[beacon] = rows[-1]
    return values, heard


@settings(deadline=None)
@given(st.lists(READING, min_size=1, max_size=30), st.sampled_from(["highest", "averaged"]))
def test_kernel_agrees_with_the_equations_word_by_word(rows, signal):
    readings = readings_of(rows)
    signals = window(signal).signals(readings)
    strongest = window(signal).strongest(readings)
    for row in range(len(readings)):
        values, heard = plain_signals(readings, row, signal, 0.25)
        expected = [values.get(beacon, np.nan) for beacon in range(BEACONS)]
        np.testing.assert_allclose(signals[row], expected, rtol=0, atol=1e-12)
        best = max(signals[row][beacon] for beacon in values)
        tied = [beacon for beacon in values if signals[row][beacon] == best]
        assert strongest[row] == max(tied, key=lambda beacon: heard[beacon])


@settings(deadline=None)
@given(
    st.lists(READING, min_size=1, max_size=30),
    st.lists(st.integers(0, 30), max_size=5),
    st.sampled_from(["highest", "averaged"]),
)
def test_cuts_between_blocks_change_no_bit(rows, cuts, signal):
    readings = readings_of(rows)
    whole = window(signal).signals(readings)
    live = window(signal)
    ends = [0, *sorted(min(cut, len(readings)) for cut in cuts), len(readings)]
    parts = [
        live.signals(readings.rows(slice(first, last))) for first, last in itertools.pairwise(ends)
    ]
    assert np.concatenate(parts).tobytes() == whole.tobytes()


def test_average_worked_by_hand():
    # -80; then 0.25 * -60 + 0.75 * -80 = -75; then 0.25 * -71 + 0.75 * -75 = -74 (Eq 3).
    readings = readings_of([(0, 2, -80), (1, 2, -60), (2, 2, -71)])
    assert window("averaged").signals(readings)[:, 2].tolist() == [-80.0, -75.0, -74.0]


def test_average_starts_again_at_the_oldest_reading_left():
    # At 1.0 s the reading of 0.0 s is exactly one window old and out: S starts at -60.
    readings = readings_of([(0, 2, -80), (1, 2, -60), (4, 2, -72)])
    assert window("averaged").signals(readings)[-1, 2] == 0.25 * -72 + 0.75 * -60


def test_highest_forgets_a_reading_one_window_old():
    readings = readings_of([(0, 0, -60), (3, 1, -70), (4, 2, -80)])
    assert window().strongest(readings).tolist() == [0, 0, 1]


def test_of_equally_strong_beacons_the_one_heard_last_wins():
    readings = readings_of([(0, 3, -70), (1, 1, -70), (2, 0, -90), (3, 3, -75)])
    # Beacon 3 is still worth -70 at the end and was just heard, though weaker.
    assert window().strongest(readings).tolist() == [3, 1, 1, 3]


def test_a_beacon_out_of_the_window_has_no_value():
    signals = window().signals(readings_of([(0, 0, -60), (8, 1, -70)]))
    assert np.isnan(signals[1, 0])
    assert np.isnan(signals[0, 1])


def test_no_readings_give_no_values():
    assert window().signals(Readings.empty()).shape == (0, BEACONS)
    assert window().strongest(Readings.empty()).shape == (0,)


def test_blocks_that_go_back_in_time_are_refused():
    live = window()
    live.strongest(readings_of([(4, 0, -60)]))
    with pytest.raises(DataError, match="order of time"):
        live.strongest(readings_of([(3, 0, -60)]))


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"window_s": 0.0}, "window_s 0"),
        ({"window_s": float("nan")}, "window_s nan"),
        ({"window_s": float("inf")}, "window_s inf"),
        ({"rate": 0.0}, "rate 0"),
        ({"rate": 1.5}, "rate 1.5"),
        ({"signal": "loudest"}, "highest, averaged"),
    ],
)
def test_bad_parameters_are_refused(wrong, says):
    with pytest.raises(UsageError, match=says):
        window(**wrong)
