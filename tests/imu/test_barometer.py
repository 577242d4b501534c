import numpy as np
import pytest

from blesim.imu.barometer import Barometer, pressure, pressure_hpa
from blesim.tables import Trajectory

EXACT = Barometer(noise_pa=0, offset_pa=0, resolution_pa=0, weather_hpa=0, altitude_m=0)


def on_levels(trajectory, level):
    """The same walk on other levels."""
    columns = {c.field: getattr(trajectory, c.field) for c in Trajectory.STREAM.columns}
    return Trajectory(**{**columns, "level": np.array(level)})


@pytest.mark.parametrize(
    ("altitude_m", "hpa"), [(0.0, 1013.25), (1000.0, 898.746), (5000.0, 540.199)]
)
def test_the_standard_atmosphere(altitude_m, hpa):
    # ICAO Doc 7488, table of pressure by geopotential altitude.
    assert pressure_hpa(np.array([altitude_m]), 1013.25) == pytest.approx([hpa], abs=0.01)


def test_a_level_up_the_pressure_is_lower(route, carried):
    walk = route([(0, 0), (30, 0), (60, 0)], rest_s=20.0)
    climbed = on_levels(walk, [0, 0, 1, 1, 1])
    read = pressure(climbed, carried("hand"), 4.0, EXACT, 1, "w")
    # 12 Pa a metre near the ground; the phone in the hand is at one height.
    assert read.pressure_hpa[0] - read.pressure_hpa[-1] == pytest.approx(0.48, abs=0.01)
    wanted = pressure_hpa(np.array([1.2]), 1013.25)[0]
    assert read.pressure_hpa[0] == pytest.approx(wanted, abs=2e-4)
    # Nobody jumps a floor: steps of a fifth of a second, 4 m in 12 s.
    assert np.abs(np.diff(read.pressure_hpa)).max() < 0.01


def test_from_hand_to_pocket_the_phone_sinks(standing, carried):
    read = pressure(standing(20.0), carried((0, "hand"), (10, "pocket")), 4.0, EXACT, 1, "w")
    assert read.pressure_hpa[-1] - read.pressure_hpa[0] == pytest.approx(0.12 * 0.35, abs=2e-3)


def test_noise_offset_and_resolution_are_as_configured(standing, carried):
    noisy = EXACT.model_copy(update={"noise_pa": 1.3, "resolution_pa": 0.16, "rate_hz": 20.0})
    read = pressure(standing(1000.0), carried("hand"), 4.0, noisy, 1, "w")
    pascal = 100.0 * read.pressure_hpa.astype(float)
    # 20 000 samples: good to half a per cent, here to five times.
    assert pascal.std() == pytest.approx(1.3, rel=0.025)
    assert np.abs(pascal / 0.16 - np.rint(pascal / 0.16)).max() < 0.1
    offset = EXACT.model_copy(update={"offset_pa": 100.0})
    first = [
        pressure(standing(1.0), carried("hand"), 4.0, offset, 1, f"w{n}").pressure_hpa[0]
        for n in range(300)
    ]
    # 300 phones: good to 4 per cent, here to four times.
    assert 100.0 * np.std(first) == pytest.approx(100.0, rel=0.16)


def test_the_weather_is_the_same_for_all_and_slow(standing, carried):
    weather = EXACT.model_copy(update={"weather_hpa": 3.0, "rate_hz": 0.1})
    day = standing(86_400.0)
    reads = [pressure(day, carried("hand"), 4.0, weather, 1, name) for name in ("a", "b")]
    assert reads[0] == reads[1]
    hpa = reads[0].pressure_hpa.astype(float)
    three_hours = hpa[1080:] - hpa[:-1080]
    # sqrt(2 (1 - exp(-3/48))) of 3 hPa is 1.04 hPa; eight independent stretches: within a half.
    assert three_hours.std() == pytest.approx(1.04, rel=0.6)
    assert np.abs(np.diff(hpa)).max() < 0.05


def test_another_rate_reads_the_same_at_the_same_time(standing, carried):
    slow, fast = (
        pressure(standing(10.0), carried("hand"), 4.0, Barometer(rate_hz=rate), 1, "w")
        for rate in (5.0, 10.0)
    )
    assert np.array_equal(fast.time_us[::2], slow.time_us)
    assert np.array_equal(fast.pressure_hpa[::2], slow.pressure_hpa)
