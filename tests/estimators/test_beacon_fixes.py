import numpy as np
import pytest

from blesim.estimators.beacon_fixes import BeaconFixes, only, zone_thresholds_dbm
from blesim.estimators.practice import practice_venue
from blesim.ranging.smoothing import SignalWindow
from blesim.tables import Readings


def fixes_of(*rows, threshold_dbm=-74.0, blocks=(slice(None),)):
    """Fixes of readings (time in s, beacon, RSSI) of three beacons."""
    window = SignalWindow(beacons=3, signal="averaged", window_s=1.0, rate=0.5)
    fixes = BeaconFixes(window, np.broadcast_to(threshold_dbm, 3).astype(float), 1.0)
    time_s, beacon, rssi_dbm = np.array(rows, float).T
    readings = Readings(
        time_us=(time_s * 1e6).astype(int),
        beacon=beacon,
        rssi_dbm=rssi_dbm,
        channel=np.zeros(len(rows)),
    )
    parts = [fixes.advance(readings.rows(block)) for block in blocks]
    return [(row, beacon) for rows, beacons in parts for row, beacon in zip(rows, beacons)]  # noqa: B905


def test_once_a_second_the_first_reading_asks():
    rows = [(0.0, 0, -60), (0.5, 1, -50), (1.1, 1, -50), (1.9, 2, -40), (2.1, 2, -40)]
    assert fixes_of(*rows) == [(0, 0), (2, 1), (4, 2)]


def test_outside_all_zones_there_is_none():
    assert fixes_of((0.0, 0, -75), (1.0, 1, -74)) == [(1, 1)]


def test_the_average_of_the_window_decides():
    # Beacon 0: 0.5 * -90 + 0.5 * -60 = -75, under the threshold; alone -90 is in the next window.
    assert fixes_of((-0.0, 1, -99), (0.4, 0, -60), (1.0, 0, -90), (2.0, 0, -60)) == [(3, 0)]


def test_a_beacon_that_is_none_is_never_a_fix():
    limited = only(np.full(3, -74.0), np.array([1]))
    assert fixes_of((0.0, 0, -30), (1.0, 1, -70), (2.5, 0, -30), threshold_dbm=limited) == [(1, 1)]


def test_cuts_between_readings_of_one_moment_change_nothing():
    rows = [(0.0, 0, -60), (1.0, 1, -60), (1.0, 2, -50), (2.0, 0, -60), (2.0, 2, -40)]
    whole = fixes_of(*rows)
    parts = fixes_of(*rows, blocks=[slice(k, k + 1) for k in range(5)])
    assert [beacon for _, beacon in parts] == [beacon for _, beacon in whole]


def test_the_zone_of_an_announced_power():
    # -61 dBm at 1 m is 20 log10(5) = 13.98 dB weaker at 5 m.
    told = zone_thresholds_dbm(practice_venue(), zone_dbm=None, zone_m=5.0)
    np.testing.assert_allclose(told, -61 - 13.9794, atol=1e-4)
    assert set(zone_thresholds_dbm(practice_venue(), zone_dbm=-74.0, zone_m=5.0)) == {-74.0}


@pytest.mark.parametrize("count", [0])
def test_no_readings_no_fixes(count):
    window = SignalWindow(beacons=count, signal="averaged", window_s=1.0, rate=0.5)
    rows, beacons = BeaconFixes(window, np.empty(count), 1.0).advance(Readings.empty())
    assert len(rows) == len(beacons) == 0
