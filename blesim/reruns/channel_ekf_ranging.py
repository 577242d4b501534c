"""Distances and places without a filter, as in figures 1 to 11 of the channel-separate paper [1]_.

References
----------
.. [1] Channel-separate regression, fingerprints and EKF, 2016; digest "channel-separate-ekf".
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from blesim.ranging.channels import channel_slot
from blesim.ranging.curves import ENOUGH_POINTS
from blesim.ranging.path_loss_fit import fit_path_loss
from blesim.ranging.polynomial_range import fit_polynomial_ranges
from blesim.ranging.radio_map import MapLayout, RadioMap, channel_radio_maps, radio_map
from blesim.ranging.survey_readings import SurveyReadings, calibration_points
from blesim.reruns.channel_ekf_numbers import AGGREGATE, CHANNEL_NAMES, DEGREES, poly
from blesim.tables import Readings
from blesim.units import MICROSECONDS_PER_SECOND
from blesim.venue.beacons import CHANNELS

Array = NDArray[np.float64]
Rows = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DistanceErrors:
    """How far distances at calibration points are off, by models fitted on the same points.

    The paper fits and tries its models on one set of points as well.

    Attributes
    ----------
    beacon, channel : ndarray of int64, (n,)
        Row of the beacon; row of its channel, three a beacon.
    by_model : dict of str to ndarray of float64, (n,)
        Absolute error of the PM and the polynomials of each channel. [m]
    aggregate_beacon : ndarray of int64, (m,)
        Row of the beacon where channels are taken together.
    aggregate : ndarray of float64, (m,)
        Of the polynomials of degree 2 of each beacon. [m]
    level_dbm, exponent : ndarray of float64, (beacons * 3,)
        PM of each channel. [dBm], [-]
    """

    beacon: Rows
    channel: Rows
    by_model: dict[str, Array]
    aggregate_beacon: Rows
    aggregate: Array
    level_dbm: Array
    exponent: Array


def distance_errors(
    survey: SurveyReadings, distance_m: Callable[[SurveyReadings], Array]
) -> DistanceErrors:
    """Errors of distances from the mean RSSI at each point; the survey tells channels.

    Parameters
    ----------
    survey : SurveyReadings
        All readings.
    distance_m : callable
        True distances of readings in space, as surveyed, (n,). [m]
    """
    apart = calibration_points(survey, by_channel=True)
    true_m, of = distance_m(apart), (apart.beacon, apart.channel)
    loss = fit_path_loss(apart, true_m, by="beacon and channel", enough=ENOUGH_POINTS)
    by_model = {"PM": np.abs(loss.of(*of).distance_m(apart.rssi_dbm) - true_m)}
    for degree in DEGREES:
        curves = fit_polynomial_ranges(apart, true_m, degree=degree, enough=ENOUGH_POINTS)
        by_model[poly(degree)] = np.abs(curves.of(*of).distance_m(apart.rssi_dbm) - true_m)
    together = calibration_points(survey, by_channel=False)
    whole_m = distance_m(together)
    curves = fit_polynomial_ranges(together, whole_m, by="beacon", enough=ENOUGH_POINTS)
    whole = curves.of(together.beacon, together.channel).distance_m(together.rssi_dbm)
    beacons = np.repeat(np.arange(survey.beacons), len(CHANNELS))
    each = loss.of(beacons, np.tile(CHANNELS, survey.beacons))
    return DistanceErrors(
        beacon=apart.beacon,
        channel=apart.beacon * len(CHANNELS) + channel_slot(apart.channel) - 1,
        by_model=by_model,
        aggregate_beacon=together.beacon,
        aggregate=np.abs(whole - whole_m),
        level_dbm=np.asarray(each.level_dbm),
        exponent=np.asarray(each.exponent),
    )


def channel_means(errors: DistanceErrors, model: str) -> Array:
    """Mean distance error of each channel that was heard, sorted: a line of figure 5. [m]."""
    count = np.bincount(errors.channel)
    total = np.bincount(errors.channel, errors.by_model[model])
    return np.asarray(np.sort(total[count > 0] / count[count > 0]), np.float64)


def far_error_m(group: Rows, error_m: Array) -> float:
    """Error that 90 % of the readings of a group stay below, mean over the groups. [m]."""
    order = np.argsort(group, kind="stable")
    parts = np.split(error_m[order], np.flatnonzero(np.diff(group[order])) + 1)
    return float(np.mean([np.percentile(part, 90) for part in parts]))


def beacon_errors(errors: DistanceErrors) -> dict[str, float]:
    """Figure 8, where one beacon is the example; here the mean over all. [m]."""
    slot = errors.channel % len(CHANNELS)
    separate = errors.by_model[poly(2)]
    found = {
        name: far_error_m(errors.beacon[slot == row], separate[slot == row])
        for row, name in enumerate(CHANNEL_NAMES)
    }
    return {**found, AGGREGATE: far_error_m(errors.aggregate_beacon, errors.aggregate)}


def place_errors(survey: SurveyReadings) -> dict[str, Array]:
    """Error of each surveyed point located among the others, k = 1: figure 9. [m].

    The paper does not say how its 150 points relate to its database.
    """
    layout = MapLayout()
    maps = zip(CHANNEL_NAMES, channel_radio_maps(survey, layout).values(), strict=True)
    found = {name: left_out_errors_m(each) for name, each in maps}
    return {**found, AGGREGATE: left_out_errors_m(radio_map(survey, layout))}


def left_out_errors_m(surveyed: RadioMap) -> Array:
    """Distance of each fingerprint to the most alike of the others, by Eq 14, (p,). [m]."""
    apart_db = np.empty((len(surveyed), len(surveyed)))
    for row, measured_dbm in enumerate(surveyed.mean_dbm):
        heard = ~np.isnan(measured_dbm)
        off_db = surveyed.fingerprints_dbm[:, heard] - measured_dbm[heard]
        apart_db[row] = np.mean(off_db**2, axis=1)
    np.fill_diagonal(apart_db, np.inf)
    nearest = np.argmin(apart_db, axis=1)
    right_m, up_m = surveyed.x_m[nearest] - surveyed.x_m, surveyed.y_m[nearest] - surveyed.y_m
    return np.asarray(np.hypot(right_m, up_m), np.float64)


def mean_levels(spot: Rows, rssi_dbm: Array) -> tuple[float, float]:
    """Mean and standard deviation of the RSSI at a spot, averaged over spots. [dBm], [dB].

    Left out are spots with fewer than two readings, from which fading keeps the channel: the paper
    shows a beacon of which all channels are heard.
    """
    parts = [rssi_dbm[spot == each] for each in np.unique(spot)]
    heard = [part for part in parts if len(part) > 1]
    means, spreads = np.array([(np.mean(part), np.std(part, ddof=1)) for part in heard]).T
    return float(np.mean(means)), float(np.mean(spreads))


def channels_heard(readings: Readings) -> Rows:
    """Channels of beacons heard in each whole second of a walk, (seconds,): figure 11."""
    second = (readings.time_us - readings.time_us[0]) // MICROSECONDS_PER_SECOND
    row = readings.beacon.astype(np.int64) * len(CHANNELS) + channel_slot(readings.channel) - 1
    pairs = np.unique(np.stack([second, row], axis=1), axis=0)
    return np.bincount(pairs[:, 0].astype(np.int64), minlength=int(second[-1]))[: int(second[-1])]
