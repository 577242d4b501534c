"""Levels of packets at a phone: everything between the beacon's antenna and the phone's."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blesim.kernels import kernel
from blesim.radio.carrying import Carried
from blesim.radio.fading import FREQUENCY_HZ
from blesim.radio.path_loss import ITU_P1238, floor_loss_db, indoor_loss_db, log_distance_loss_db
from blesim.radio.people import body_loss_db
from blesim.radio.places import Places
from blesim.radio.propagation import Propagation
from blesim.venue.beacons import CHANNELS


class Geometry(NamedTuple):
    """Links of packets, arrays over n packets; heights count from the phone's floor.

    ``cos_body`` is that of the angle between the side of the body where the phone is, ahead if it
    is in the hand, and the way to the beacon, NaN where there is no body; ``floors`` lie between;
    ``way`` is a row of `columns.CARRYINGS`.
    """

    beacon_m: NDArray[np.float64]
    phone_m: NDArray[np.float64]
    distance_m: NDArray[np.float64]
    cos_body: NDArray[np.float64]
    floors: NDArray[np.int64]
    way: NDArray[np.uint8]


def geometry_of(
    beacon_m: NDArray[np.float64],
    row: NDArray[np.int64],
    here: Places,
    carried: Carried,
    way: NDArray[np.uint8],
    floors: NDArray[np.int64],
) -> Geometry:
    """Links from beacons to a phone.

    Parameters
    ----------
    beacon_m : ndarray of float64, (number of beacons, 3)
        Positions; heights from the phone's floor. [m]
    row : ndarray of int64, (n,)
        Beacon of each packet.
    here : Places
        Of the carrier at each packet.
    carried : Carried
        Where the phone is from there, for each way of carrying it.
    way : ndarray of uint8, (n,)
        How it is carried at each packet.
    floors : ndarray of int64, (number of beacons,)
        Between the phone's level and each beacon's. [-]
    """
    count = len(row)
    out = Geometry(
        beacon_m=np.empty((count, 3)),
        phone_m=np.empty((count, 3)),
        distance_m=np.empty(count),
        cos_body=np.empty(count),
        floors=floors[row],
        way=way,
    )
    _fill_geometry(
        beacon_m,
        row,
        here.x_m,
        here.y_m,
        here.cos_heading,
        here.sin_heading,
        way,
        carried.height_m,
        carried.ahead_m,
        carried.side,
        out.beacon_m,
        out.phone_m,
        out.distance_m,
        out.cos_body,
    )
    return out


@kernel
def _fill_geometry(
    beacons: NDArray[np.float64],
    row: NDArray[np.int64],
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    cos_heading: NDArray[np.float64],
    sin_heading: NDArray[np.float64],
    way: NDArray[np.uint8],
    height_m: NDArray[np.float64],
    ahead_m: NDArray[np.float64],
    side: NDArray[np.float64],
    beacon: NDArray[np.float64],
    phone: NDArray[np.float64],
    distance: NDArray[np.float64],
    cos_body: NDArray[np.float64],
) -> None:
    for k in range(len(row)):
        for axis in range(3):
            beacon[k, axis] = beacons[row[k], axis]
        ahead, height = ahead_m[way[k]], height_m[way[k]]
        here_x, here_y = x[k] + ahead * cos_heading[k], y[k] + ahead * sin_heading[k]
        phone[k, 0], phone[k, 1], phone[k, 2] = here_x, here_y, height
        away_x, away_y = beacon[k, 0] - here_x, beacon[k, 1] - here_y
        flat = away_x * away_x + away_y * away_y
        distance[k] = np.sqrt(flat + (beacon[k, 2] - height) ** 2)
        before = away_x * cos_heading[k] + away_y * sin_heading[k]
        left = away_y * cos_heading[k] - away_x * sin_heading[k]
        towards = before * side[way[k], 0] + left * side[way[k], 1]
        # In three dimensions: straight below a beacon no way of standing is towards it.
        cos_body[k] = towards / max(distance[k], 1e-9)


class Budget(NamedTuple):
    """Levels of n packets at the phone, component by component, arrays (n,); see `columns.PACKETS`.

    ``gains_db`` sums up channel gains, antenna and device offset.
    """

    path_loss_db: NDArray[np.float64]
    obstacle_loss_db: NDArray[np.float64]
    shadowing_db: NDArray[np.float64]
    fading_db: NDArray[np.float64]
    body_loss_db: NDArray[np.float64]
    gains_db: NDArray[np.float64]

    def power_dbm(self, measured_power_dbm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Power at the phone, before it measures. [dBm]."""
        return (
            measured_power_dbm
            - self.path_loss_db
            - self.obstacle_loss_db
            + self.shadowing_db
            + self.fading_db
            - self.body_loss_db
            + self.gains_db
        )


def path_loss_db(
    propagation: Propagation,
    geometry: Geometry,
    obstacle_loss_db: NDArray[np.float64],
    channel: NDArray[np.int64],
    headroom_db: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Loss beyond one metre, floors included.

    Parameters
    ----------
    propagation : Propagation
        Which model.
    geometry : Geometry
        Of n packets.
    obstacle_loss_db : ndarray of float64, (n,)
        Decides where the obstructed exponent holds. [dB]
    channel : ndarray of int64, (n,)
        Decides the frequency.
    headroom_db : ndarray of float64, (n,)
        Transmit power less measured power, for the models that start from the former. [dB]

    Returns
    -------
    ndarray of float64, (n,)
        [dB]
    """
    floors_db = floor_loss_db(geometry.floors)
    if propagation.path_loss_model in ITU_P1238:
        model = ITU_P1238[propagation.path_loss_model]
        frequency_hz = np.array([FREQUENCY_HZ[each] for each in CHANNELS])[channel - CHANNELS[0]]
        loss_db = indoor_loss_db(geometry.distance_m, frequency_hz, model)
        return loss_db - headroom_db + floors_db
    decades_db = log_distance_loss_db(geometry.distance_m, 1.0)
    clear, blocked = propagation.path_loss_exponent, propagation.obstructed_exponent
    exponent = np.where(obstacle_loss_db > 0, clear if blocked is None else blocked, clear)
    total_db: NDArray[np.float64] = exponent * decades_db + floors_db
    return total_db


def carrier_loss_db(
    propagation: Propagation, carried: Carried, geometry: Geometry
) -> NDArray[np.float64]:
    """Loss by carrying the phone as it is carried, (n,); a body unknown shadows nothing. [dB]."""
    loss_db = body_loss_db(geometry.cos_body, propagation.people.body_loss_db)
    shadow_db = np.where(np.isnan(loss_db), 0.0, loss_db)
    way = geometry.way if carried.timeline is not None else 0
    total_db: NDArray[np.float64] = carried.body_share[way] * shadow_db + carried.loss_db[way]
    return total_db


def antenna_gain_db(antenna: NDArray[np.float64], geometry: Geometry) -> NDArray[np.float64]:
    """Gain of beacons' antennas over that on boresight: ``-F (1 - cos(angle)) / 2``.

    Parameters
    ----------
    antenna : ndarray of float64, (n, 3)
        Unit vector of the boresight, and F, 0 for an antenna that sends alike to all sides.
        [-], [-], [dB]
    geometry : Geometry
        Of n packets.

    Returns
    -------
    ndarray of float64, (n,)
        Zero or less. [dB]
    """
    away = geometry.phone_m[:, :2] - geometry.beacon_m[:, :2]
    along = away[:, 0] * antenna[:, 0] + away[:, 1] * antenna[:, 1]
    cosine = along / np.maximum(np.hypot(away[:, 0], away[:, 1]), 1e-9)
    return -0.5 * antenna[:, 2] * (1.0 - cosine)
