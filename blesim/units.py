"""Conversions between the units blesim names: the only place where they are written down."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

MICROSECONDS_PER_SECOND = 1_000_000


def to_us(time_s: float) -> int:
    """Whole microseconds nearest to a time in seconds.

    Parameters
    ----------
    time_s : float
        Time or duration. [s]

    Returns
    -------
    int
        The same, rounded half to even. [us]

    Examples
    --------
    >>> to_us(0.35)
    350000
    """
    return round(time_s * MICROSECONDS_PER_SECOND)


def to_s(time_us: ArrayLike) -> NDArray[np.float64]:
    """Seconds of a time in microseconds, any shape. [s]."""
    return np.asarray(time_us, dtype=np.float64) / MICROSECONDS_PER_SECOND


def dbm_to_mw(power_dbm: ArrayLike) -> NDArray[np.float64]:
    """Power in milliwatts of a level in dBm, any shape: ``10^(P/10)``. [mW]."""
    return np.power(10.0, np.asarray(power_dbm, dtype=np.float64) / 10.0)


def mw_to_dbm(power_mw: ArrayLike) -> NDArray[np.float64]:
    """Level in dBm of a power in milliwatts, any shape: ``10 log10(P)``. [dBm]."""
    return 10.0 * np.log10(np.asarray(power_mw, dtype=np.float64))


def wrap_angle(angle_rad: ArrayLike) -> NDArray[np.float64]:
    """The same direction in [-pi, pi), any shape. [rad].

    Examples
    --------
    >>> float(wrap_angle(3 * np.pi / 2)) == -np.pi / 2
    True
    """
    wrapped = (np.asarray(angle_rad, dtype=np.float64) + np.pi) % (2.0 * np.pi) - np.pi
    # Just below -pi the remainder rounds up to a whole turn.
    return np.where(wrapped >= np.pi, -np.pi, wrapped)


def heading_to_azimuth(heading_rad: ArrayLike) -> NDArray[np.float64]:
    """Azimuth of a heading, any shape, in [-pi, pi). [rad].

    A heading is counted from the map's +x axis counter-clockwise, an azimuth from the map's +y
    axis ("north") clockwise. The conversion is its own inverse.
    """
    return wrap_angle(np.pi / 2.0 - np.asarray(heading_rad, dtype=np.float64))


def azimuth_to_heading(azimuth_rad: ArrayLike) -> NDArray[np.float64]:
    """Heading of an azimuth, any shape, in [-pi, pi); see `heading_to_azimuth`. [rad]."""
    return heading_to_azimuth(azimuth_rad)
