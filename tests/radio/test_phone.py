import numpy as np
import pytest
from pydantic import ValidationError

from blesim.radio.phone import Receiver, Scanner


def test_scanner_listens_to_one_channel_after_the_other():
    scanner = Scanner(interval_ms=100, window_ms=60)
    in_window, channel = scanner.listens(
        np.array([0, 59_632, 59_633, 100_000, 250_000, 300_000]), 368
    )
    assert in_window.tolist() == [True, True, False, True, True, True]
    assert channel.tolist() == [37, 37, 37, 38, 39, 37]


def test_duty_cycle_is_window_over_interval():
    scanner = Scanner(interval_ms=5120, window_ms=512)
    in_window, _ = scanner.listens(np.arange(0, 60_000_000, 997), 0)
    assert in_window.mean() == pytest.approx(0.1, abs=0.003)


def test_window_longer_than_its_interval_is_refused():
    with pytest.raises(ValidationError, match="window_ms 200 is longer than interval_ms 100"):
        Scanner(interval_ms=100, window_ms=200)


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
