"""Air pressure at the phone: height over the sea, weather, and a sensor's errors."""

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim.imu.carriage import HEIGHT, MODES
from blesim.imu.drift import drift
from blesim.rng import Draws
from blesim.settings import Settings
from blesim.tables import Carrying, Pressures, Trajectory
from blesim.units import MICROSECONDS_PER_SECOND, to_us

# International standard atmosphere: L / T0, and g M / (R L).
_LAPSE_PER_M = 0.0065 / 288.15
_EXPONENT = 5.25588
_WEATHER_STEP_S = 600.0
# Stairs, lifts and ramps take about so long from one level to the next; assumed.
_CLIMB_S = 12.0


class Barometer(Settings):
    """A barometer, by default like Bosch's BMP280 (data sheet BST-BMP280-DS001).

    Attributes
    ----------
    rate_hz : float
        Samples a second. [Hz]
    noise_pa : float
        Spread of a sample: 1.3 over the full bandwidth at the highest resolution (typical, not
        verified against the data sheet), 0.2 with the strongest filter (its table 7: 1.6 cm). [Pa]
    offset_pa : float
        Spread, from phone to phone, of the constant error: absolute accuracy 100 (data sheet). [Pa]
    resolution_pa : float
        Step of the readings: 0.16 (data sheet, table 4); 0 for none. [Pa]
    sea_level_hpa : float
        Mean pressure at sea level; 1013.25 in the standard atmosphere. [hPa]
    weather_hpa, weather_s : float
        Spread of the weather about it, and the time after which it is forgotten to 1/e; assumed so
        that the pressure changes by about 1 hPa in three hours. [hPa], [s]
    altitude_m : float
        Of level 0 over the sea. [m]
    """

    rate_hz: float = Field(default=5.0, ge=0.1, le=200)
    noise_pa: float = Field(default=1.3, ge=0, le=1000)
    offset_pa: float = Field(default=100.0, ge=0, le=1000)
    resolution_pa: float = Field(default=0.16, ge=0, le=100)
    sea_level_hpa: float = Field(default=1013.25, ge=850, le=1100)
    weather_hpa: float = Field(default=3.0, ge=0, le=50)
    weather_s: float = Field(default=172_800.0, ge=600, le=1e7)
    altitude_m: float = Field(default=50.0, ge=-400, le=5000)


def pressure_hpa(
    altitude_m: NDArray[np.float64], sea_level_hpa: NDArray[np.float64] | float
) -> NDArray[np.float64]:
    """Air pressure of the standard atmosphere: ``p0 (1 - L h / T0)^5.25588``.

    Parameters
    ----------
    altitude_m : ndarray of float64, (n,)
        Up to 11 km. [m]
    sea_level_hpa : ndarray of float64, (n,), or float
        [hPa]

    Returns
    -------
    ndarray of float64, (n,)
        [hPa]

    References
    ----------
    .. [1] "Manual of the ICAO Standard Atmosphere", ICAO Doc 7488, 3rd ed., 1993.
    """
    base = 1.0 - _LAPSE_PER_M * np.asarray(altitude_m, dtype=np.float64)
    return np.asarray(sea_level_hpa * np.power(base, _EXPONENT), dtype=np.float64)


def pressure(
    trajectory: Trajectory,
    carrying: Carrying,
    level_height_m: float,
    barometer: Barometer,
    seed: int,
    walker: str,
) -> Pressures:
    """Pressures that a phone measures on a walk.

    Parameters
    ----------
    trajectory : Trajectory
        The walk; between two levels the height changes steadily over some seconds.
    carrying : Carrying
        How, and so how high, the phone is carried.
    level_height_m : float
        From one level's floor to the next. [m]
    barometer : Barometer
        The sensor, and the weather.
    seed, walker : int, str
        Address of the draws; the weather is the same for all walkers.

    Returns
    -------
    Pressures
        At a regular rate from the first to the last time of the walk.
    """
    start_us, end_us = int(trajectory.time_us[0]), int(trajectory.time_us[-1])
    period_us = MICROSECONDS_PER_SECOND / barometer.rate_hz
    count = int((end_us - start_us) / period_us + 1e-6) + 1
    time_us = start_us + np.rint(np.arange(count) * period_us).astype(np.int64)
    height_m = MODES[carrying.at(time_us), HEIGHT]
    altitude_m = barometer.altitude_m + height_m + _floor_m(trajectory, level_height_m, time_us)
    true_hpa = pressure_hpa(altitude_m, _weather_hpa(barometer, seed, time_us))
    once = Draws(seed=seed, purpose="pressure offset", walker=walker).normals(np.zeros(1, int))
    # The ordinal is the time, so that another rate leaves common samples as they are.
    noise = Draws(seed=seed, purpose="pressure", walker=walker).normals(time_us - start_us)[:, 0]
    read_pa = 100.0 * true_hpa + barometer.offset_pa * once[0, 0] + barometer.noise_pa * noise
    if barometer.resolution_pa > 0:
        read_pa = barometer.resolution_pa * np.rint(read_pa / barometer.resolution_pa)
    return Pressures(time_us=time_us, pressure_hpa=0.01 * read_pa)


def _floor_m(
    trajectory: Trajectory, level_height_m: float, time_us: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Height of the floor over level 0, (n,): the mean over the time that a climb takes. [m]."""
    half_us = to_us(_CLIMB_S / 2.0)
    beyond = [int(trajectory.time_us[0]) - half_us, int(trajectory.time_us[-1]) + half_us]
    knots_us = np.concatenate([beyond[:1], trajectory.time_us[1:], beyond[1:]])
    total = np.concatenate([[0.0], np.cumsum(np.diff(knots_us) * trajectory.level)])
    after = np.interp(time_us + half_us, knots_us, total)
    before = np.interp(time_us - half_us, knots_us, total)
    mean: NDArray[np.float64] = level_height_m * (after - before) / (2.0 * half_us)
    return mean


def _weather_hpa(
    barometer: Barometer, seed: int, time_us: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Pressure at sea level at some times, (n,): smooth over minutes. [hPa]."""
    place_s = time_us / MICROSECONDS_PER_SECOND
    count = int(place_s.max(initial=0.0) / _WEATHER_STEP_S) + 2
    kept = float(np.exp(-_WEATHER_STEP_S / barometer.weather_s))
    weather = drift(Draws(seed=seed, purpose="weather"), count, kept)[:, 0]
    grid_s = _WEATHER_STEP_S * np.arange(count)
    return barometer.sea_level_hpa + barometer.weather_hpa * np.interp(place_s, grid_s, weather)
