"""Delivery: what the operating system hands to the application out of what the radio received."""

from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from blesim import columns
from blesim.columns import CHANNEL_NOT_TOLD
from blesim.kernels import kernel
from blesim.settings import Settings
from blesim.tables import IntArray, Readings
from blesim.units import MICROSECONDS_PER_SECOND, to_us

_PROXIMITY = dict(columns.PROXIMITIES)


class Delivery(Settings):
    """How readings reach the application.

    Attributes
    ----------
    mode : str
        ``each``: every packet as it comes, as Android does. ``one-second-mean``: once a second, for
        every beacon heard in that second, the mean RSSI in whole dB and a proximity class, as iOS
        does when it ranges beacons.
    batch_s : float
        Readings are held back and arrive together at the end of each interval of this length, as
        with Android's report delay; 0 for none. [s]
    immediate_m, near_m : float
        Up to which distance a beacon is ``immediate`` or ``near``; farther it is ``far``. Apple
        publishes no thresholds: 0.5 and 3 m are what field reports say. [m]
    path_loss_exponent : float
        From which the system takes the distance; assumed. [-]
    smoothing_s : float
        Time constant with which the level is averaged before it is made a distance, 0 for none;
        assumed. [s]

    References
    ----------
    Apple Developer Documentation, CLProximity and CLBeacon.rssi; Android Developers,
    ScanSettings.Builder.setReportDelay.
    """

    mode: Literal["each", "one-second-mean"] = "each"
    batch_s: float = Field(default=0.0, ge=0, le=3600)
    immediate_m: float = Field(default=0.5, gt=0, le=100)
    near_m: float = Field(default=3.0, gt=0, le=100)
    path_loss_exponent: float = Field(default=2.0, gt=0, le=8)
    smoothing_s: float = Field(default=3.0, ge=0, le=60)

    @model_validator(mode="after")
    def _classes_ascend(self) -> Self:
        if self.immediate_m > self.near_m:
            raise ValueError(
                f"immediate_m {self.immediate_m:g} is farther than near_m {self.near_m:g}"
            )
        return self


def deliver(
    readings: Readings,
    delivery: Delivery,
    measured_power_dbm: NDArray[np.float64],
    start_us: int,
    end_us: int,
) -> Readings:
    """Readings as the application gets them, at the time at which it gets them.

    Seconds and batches are counted from the start of the walk. What would arrive after its end
    never does.

    Parameters
    ----------
    readings : Readings
        One a packet.
    delivery : Delivery
        What the system does with them.
    measured_power_dbm : ndarray of float64, (number of beacons,)
        RSSI at one metre that each beacon announces. [dBm]
    start_us, end_us : int
        Of the walk. [us]

    Returns
    -------
    Readings
        In order of time; those that arrive together in order of the beacon for means, of the
        packets otherwise.
    """
    if delivery.mode == "one-second-mean":
        readings = _second_means(readings, delivery, measured_power_dbm, start_us)
    if delivery.batch_s > 0:
        readings = _batched(readings, start_us, to_us(delivery.batch_s))
    return readings.rows(slice(int(np.searchsorted(readings.time_us, end_us, side="right"))))


def _batched(readings: Readings, start_us: int, batch_us: int) -> Readings:
    return Readings(
        time_us=_next_end(readings.time_us, start_us, batch_us),
        beacon=readings.beacon,
        rssi_dbm=readings.rssi_dbm,
        channel=readings.channel,
        proximity=readings.proximity,
    )


def _next_end(time_us: IntArray, start_us: int, interval_us: int) -> NDArray[np.int64]:
    """End of the interval each time lies in; what comes at an end waits for the next. [us]."""
    before = (time_us.astype(np.int64) - start_us) // interval_us
    return start_us + (before + 1) * interval_us


def _second_means(
    readings: Readings,
    delivery: Delivery,
    measured_power_dbm: NDArray[np.float64],
    start_us: int,
) -> Readings:
    ends_us = _next_end(readings.time_us, start_us, MICROSECONDS_PER_SECOND)
    together = np.stack([ends_us, readings.beacon.astype(np.int64)], axis=1)
    pairs, of_pair = np.unique(together, axis=0, return_inverse=True)
    totals = np.bincount(of_pair.reshape(-1), weights=readings.rssi_dbm, minlength=len(pairs))
    means_dbm = totals / np.bincount(of_pair.reshape(-1), minlength=len(pairs))
    time_us, beacon = pairs[:, 0], pairs[:, 1]
    smooth_dbm = np.empty(len(pairs))
    state_dbm, heard_us = np.zeros(len(measured_power_dbm)), np.zeros(len(measured_power_dbm))
    _smooth(time_us, beacon, means_dbm, delivery.smoothing_s * 1e6, state_dbm, heard_us, smooth_dbm)
    loss_db = measured_power_dbm[beacon] - smooth_dbm
    return Readings(
        time_us=time_us,
        beacon=beacon,
        rssi_dbm=np.rint(means_dbm),
        channel=np.full(len(pairs), CHANNEL_NOT_TOLD),
        proximity=_proximity(10.0 ** (loss_db / (10.0 * delivery.path_loss_exponent)), delivery),
    )


def _proximity(distance_m: NDArray[np.float64], delivery: Delivery) -> NDArray[np.int64]:
    """Proximity class of distances, (n,)."""
    near = np.where(distance_m <= delivery.near_m, _PROXIMITY["near"], _PROXIMITY["far"])
    return np.where(distance_m <= delivery.immediate_m, _PROXIMITY["immediate"], near)


@kernel
def _smooth(
    time_us: NDArray[np.int64],
    beacon: NDArray[np.int64],
    level_dbm: NDArray[np.float64],
    time_constant_us: float,
    state_dbm: NDArray[np.float64],
    heard_us: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """Average each beacon's levels exponentially over time; `heard_us` 0 is never yet."""
    for row in range(len(time_us)):
        which = beacon[row]
        share = 1.0
        if heard_us[which] > 0.0 and time_constant_us > 0.0:
            share = 1.0 - np.exp((heard_us[which] - time_us[row]) / time_constant_us)
        state_dbm[which] += share * (level_dbm[row] - state_dbm[which])
        heard_us[which] = time_us[row]
        out[row] = state_dbm[which]
