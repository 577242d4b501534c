import numpy as np
import pytest
from pydantic import ValidationError

from blesim.radio.phone import SCAN_MODES, Receiver, Scanner


def test_window_longer_than_its_interval_is_refused():
    with pytest.raises(ValidationError, match="window_ms 200 is longer than interval_ms 100"):
        Scanner(interval_ms=100, window_ms=200)


@pytest.mark.parametrize(
    ("mode", "window_us", "interval_us"),
    # Android Open Source Project, ScanManager: Android 5, 7 and the current one.
    [
        ("android-2014-low-power", 500_000, 5_000_000),
        ("android-2014-low-latency", 5_000_000, 5_000_000),
        ("android-2016-balanced", 1_024_000, 4_096_000),
        ("android-2023-low-power", 140_000, 1_400_000),
        ("android-2023-balanced", 183_000, 730_000),
        ("android-2023-low-latency", 100_000, 100_000),
    ],
)
def test_modes_have_the_times_of_their_source(mode, window_us, interval_us):
    scanner = Scanner(mode=mode)
    assert (scanner.window_us, scanner.interval_us) == (window_us, interval_us)
    assert scanner.cycle_us == 3 * interval_us


def test_every_mode_is_a_scanner_that_can_be():
    assert all(Scanner(mode=mode).window_us > 0 for mode in SCAN_MODES)


def test_without_setting_it_is_low_latency_and_without_window_it_never_pauses():
    assert (Scanner().window_us, Scanner().interval_us) == (4_096_000, 4_096_000)
    assert Scanner(interval_ms=30.0).window_us == 30_000


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"mode": "android-2023-balanced", "window_ms": 50.0}, "either 'mode' or 'interval_ms'"),
        ({"window_ms": 50.0}, "give 'interval_ms' together with 'window_ms'"),
        ({"mode": "android-1999"}, "android-2023-low-latency"),
    ],
)
def test_a_timing_is_given_once_and_whole(settings, message):
    with pytest.raises(ValidationError, match=message):
        Scanner(**settings)


@pytest.mark.parametrize(
    ("power_dbm", "measured", "tolerance"),
    # Measured reception at each level; the model's own table says how far off it is.
    [(-87.0, 0.86, 0.03), (-91.0, 0.79, 0.03), (-93.0, 0.65, 0.03), (-98.5, 0.13, 0.06)],
)
def test_reception_follows_the_measured_edge(power_dbm, measured, tolerance):
    receiver = Receiver()
    heard = (1 - receiver.random_loss) * receiver.reception(np.array([power_dbm]))[0]
    assert heard == pytest.approx(measured, abs=tolerance)


def test_reception_is_half_at_the_sensitivity_and_certain_far_above():
    power_dbm = np.array([-400.0, -95.0, 0.0])
    assert Receiver().reception(power_dbm) == pytest.approx([0, 0.5, 1])


def test_rssi_is_whole_and_within_the_register():
    rssi = Receiver(noise_db=0.0).rssi_dbm(np.array([-80.4, -80.6, -300.0, 90.0]), np.zeros(4))
    assert rssi.tolist() == [-80, -81, -127, 20]


def test_rounding_and_noise_spread_a_steady_level_as_measured():
    # Within a level 0.49 dB measured (0.30 to 0.76): 0.4 dB of noise and rounding to 1 dB.
    generator = np.random.default_rng(3)
    power_dbm = np.repeat(generator.uniform(-90, -60, 400), 200)
    rssi = Receiver().rssi_dbm(power_dbm, generator.standard_normal(len(power_dbm)))
    spread = rssi.reshape(400, 200).std(axis=1)
    assert np.median(spread) == pytest.approx(0.49, abs=0.06)
    assert 0.25 < np.quantile(spread, 0.05) <= np.quantile(spread, 0.95) < 0.76
