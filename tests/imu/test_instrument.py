"""Sensors at rest: what is configured is what an Allan deviation finds."""

import numpy as np
import pytest
from scipy.stats import binom

from blesim.imu.instrument import Instrument, sample_times
from blesim.imu.sensors import ImuSettings
from blesim.imu.signal import GRAVITY_M_S2
from blesim.rng import Draws

RATE_HZ = 50.0
HOURS = 4
COUNT = round(HOURS * 3600 * RATE_HZ)
# Specific force, angular rate and field of a phone that lies on a table.
STILL = np.array([0.0, 0.0, GRAVITY_M_S2, 0.0, 0.0, 0.0, 0.0, 20.0, -45.0])
UNITS = {
    "accelerometer": GRAVITY_M_S2 * 1e-6,
    "gyroscope": np.radians(1e-3),
    "magnetometer": 1.0,
}
COLUMNS = {name: slice(3 * row, 3 * row + 3) for row, name in enumerate(UNITS)}


def changed(phone, **by_sensor):
    """The phone with some settings of its sensors replaced."""
    return phone.model_copy(
        update={
            name: getattr(phone, name).model_copy(update=update)
            for name, update in by_sensor.items()
        }
    )


def lying(phone, count=COUNT, seed=4, walker="w"):
    regular_us = np.rint(np.arange(count) * 1e6 / phone.rate_hz).astype(np.int64)
    time_s = regular_us * 1e-6
    out = np.tile(STILL, (count, 1))
    Instrument.of(phone, time_s[-1], seed, walker).add_to(regular_us, time_s, out)
    return out


def allan_deviation(values, cluster):
    """Overlapping Allan deviation of each column over a number of samples."""
    total = np.cumsum(np.vstack([np.zeros(values.shape[1]), values - values.mean(axis=0)]), axis=0)
    second = total[2 * cluster :] - 2.0 * total[cluster:-cluster] + total[: -2 * cluster]
    return np.sqrt(np.mean(second**2, axis=0) / 2.0) / cluster


def of_drift(spread, memory_s, tau_s):
    """Allan deviation of a first-order Gauss-Markov process (IEEE Std 952-1997, C.1)."""
    x = memory_s / tau_s
    decay = np.exp(-1.0 / x)
    return spread * np.sqrt(2.0 * x * (1.0 - x / 2.0 * (3.0 - 4.0 * decay + decay**2)))


NOISE = {
    "accelerometer": {"noise_ug_per_rthz": 180.0},
    "gyroscope": {"noise_mdps_per_rthz": 7.0},
    # 0.6 uT a sample at 50 Hz is 0.12 uT per root hertz over the bandwidth of 25 Hz.
    "magnetometer": {"noise_ut": 0.6},
}
DENSITY = {"accelerometer": 180.0, "gyroscope": 7.0, "magnetometer": 0.12}


@pytest.mark.parametrize("sensor", sorted(UNITS))
@pytest.mark.parametrize("times", [1.0, 2.0])
def test_allan_deviation_recovers_the_white_noise(sensor, times, perfect):
    noise = {name: value * times for name, value in NOISE[sensor].items()}
    read = lying(changed(perfect, **{sensor: noise}))[:, COLUMNS[sensor]]
    for tau_s in (0.1, 1.0):
        found = allan_deviation(read, round(tau_s * RATE_HZ))
        wanted = times * DENSITY[sensor] * UNITS[sensor] / np.sqrt(2.0 * tau_s)
        # 14400 clusters of a second or more: each axis is good to 0.6 per cent, here to five times.
        assert found == pytest.approx(wanted, rel=0.03)


DRIFT = {
    "accelerometer": ({"instability_ug": 400.0}, 400.0),
    "gyroscope": ({"instability_dph": 60.0}, 60.0 / 3.6),
    "magnetometer": ({"instability_ut": 0.5}, 0.5),
}


@pytest.mark.parametrize("sensor", sorted(UNITS))
def test_allan_deviation_recovers_the_instability(sensor, perfect):
    memory_s = 40.0
    update, spread = DRIFT[sensor]
    phone = changed(perfect, **{sensor: {**update, "instability_s": memory_s}})
    read = lying(phone)[:, COLUMNS[sensor]]
    # At the top of the curve there are 190 clusters on each of three axes: good to 3 per cent.
    for tau_s in (20.0, 1.89 * memory_s):
        found = np.sqrt(np.mean(allan_deviation(read, round(tau_s * RATE_HZ)) ** 2))
        wanted = of_drift(spread * UNITS[sensor], memory_s, tau_s)
        assert found == pytest.approx(wanted, rel=0.12)


def test_turn_on_bias_spreads_over_phones_as_configured(perfect):
    phone = changed(
        perfect,
        accelerometer={"bias_mg": 20.0},
        gyroscope={"bias_dps": 0.5},
        magnetometer={"hard_iron_ut": 3.0},
    )
    offsets = np.array([lying(phone, 1, walker=f"w{n}")[0] - STILL for n in range(300)])
    wanted = [0.02 * GRAVITY_M_S2, np.radians(0.5), 3.0]
    # 900 values a sensor: good to 2.4 per cent, here to four times.
    assert offsets.reshape(300, 3, 3).std(axis=(0, 2)) == pytest.approx(wanted, rel=0.1)


def test_scale_and_misalignment_mix_the_axes_of_one_sensor_alone(perfect):
    phone = changed(perfect, accelerometer={"scale_percent": 2.0, "misalignment_deg": 1.0})
    errors = np.array([lying(phone, 1, walker=f"w{n}")[0] - STILL for n in range(400)])
    assert np.all(errors[:, 3:] == 0.0)
    wanted = np.array([np.radians(1.0), np.radians(1.0), 0.02]) * GRAVITY_M_S2
    # 400 values: good to 3.5 per cent, here to four times.
    assert errors[:, :3].std(axis=0) == pytest.approx(wanted, rel=0.14)


def test_readings_are_multiples_of_the_resolution(felt, route, axes):
    phone = ImuSettings()
    imu, _ = felt(phone, route([(0, 0), (20, 0)]), "pocket")
    for name, step in (
        ("acceleration", phone.accelerometer.resolution_m_s2),
        ("angular_rate", phone.gyroscope.resolution_rad_s),
        ("magnetic_field", phone.magnetometer.resolution_ut),
    ):
        digits = axes(imu, name) / step
        # Recordings keep five decimals, and 24 bits.
        assert np.abs(digits - np.rint(digits)).max() < 1e-5 / step


def test_readings_stay_within_the_range(perfect):
    phone = changed(perfect, accelerometer={"range_m_s2": 9.0}, magnetometer={"range_ut": 30.0})
    read = lying(phone, 10)
    assert np.all(read[:, 2] == 9.0)
    assert np.all(read[:, 7] == 20.0)
    assert np.all(read[:, 8] == -30.0)


def test_samples_are_lost_and_late_as_configured(perfect):
    phone = perfect.model_copy(update={"dropped": 0.1, "jitter_ms": 0.5})
    count = 20_000
    end_us = count * 20_000
    address = Draws(seed=4, purpose="sample time", walker="w")
    regular_us, time_us = sample_times(phone, 1000, end_us, 0, count, address)
    # Nothing but chance is wrong once in a million runs.
    low, high = binom.ppf([5e-7, 1 - 5e-7], count, 0.9)
    assert low <= len(time_us) <= high
    late_us = (time_us - 1000 - regular_us)[1:]
    # 18000 values: the spread is good to half a per cent, here to five times.
    assert late_us.std() == pytest.approx(500.0, rel=0.026)
    assert np.all(np.diff(time_us) > 0)
    assert time_us[0] >= 1000


def test_however_large_the_jitter_samples_keep_their_order(perfect):
    phone = perfect.model_copy(update={"jitter_ms": 20.0})
    _, time_us = sample_times(
        phone, 0, 10**9, 0, 5000, Draws(seed=4, purpose="sample time", walker="w")
    )
    assert np.all(np.diff(time_us) > 0)


def test_another_rate_draws_the_same_numbers_at_the_same_times(perfect):
    noisy = changed(perfect, gyroscope={"noise_mdps_per_rthz": 7.0})
    slow = lying(noisy, 100)
    fast = lying(noisy.model_copy(update={"rate_hz": 100.0}), 200)
    assert fast[::2, 3:6] == pytest.approx(slow[:, 3:6] * np.sqrt(2.0), rel=1e-12)


def test_noise_is_normal(perfect):
    read = lying(changed(perfect, magnetometer={"noise_ut": 1.0}), 200_000)[:, 6:] - STILL[6:]
    z = np.sort(read.ravel())
    # 600 000 values: beyond 3 there are 1620 +- 40, beyond 4 there are 38 +- 6.
    assert np.sum(np.abs(z) > 3.0) == pytest.approx(1620, abs=200)
    assert np.sum(np.abs(z) > 4.0) == pytest.approx(38, abs=30)
    assert z.std() == pytest.approx(1.0, abs=0.005)
