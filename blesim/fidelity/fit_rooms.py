"""Parameters of chamber and conference room from the phones at the ear and in the back pocket."""

from collections.abc import Iterator, Sequence
from itertools import combinations, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blesim.fidelity.correlation import autocorrelation, channel_correlation
from blesim.fidelity.room_statistics import Cell
from blesim.radio.fading import Fading, MultipathField
from blesim.radio.people import SWAY_STEP_US, People, sway_m
from blesim.venue.beacons import CHANNELS

Numbers = NDArray[np.float64]

_RICE_FACTORS_DB = (-6.0, -3.0, 0.0, 3.0, 6.0)
_SWAYS_M = (0.006, 0.009, 0.012, 0.015, 0.02, 0.025, 0.03)
_SWAYS_S = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
_SPOTS = 24
_SPOT_S = 36.0
_NOISE_DB = 0.4
_LAGS_S = ((0.4, 0.6), (0.9, 1.1), (1.8, 2.2))


class RoomFit(NamedTuple):
    """What people standing in a room say about its parameters.

    Attributes
    ----------
    body_loss_db : float
        Front to back. [dB]
    rice_factor_db, sway_m, sway_s : float
        Of multipath and sway. [dB], [m], [s]
    channel_correlation : float
        Of readings in time. [-]
    """

    body_loss_db: float
    rice_factor_db: float
    sway_m: float
    sway_s: float
    channel_correlation: float


class Standing(NamedTuple):
    """How links to standing people look; medians over channels of cells.

    Attributes
    ----------
    deviation_db : float
        In time, of a channel. [dB]
    between_db : float
        Deviation of the three channels' means. [dB]
    memory : tuple of float
        Autocorrelation after 0.5, 1 and 2 s. [-]
    """

    deviation_db: float
    between_db: float
    memory: tuple[float, ...]

    def distance(self, other: "Standing") -> float:
        """How unlike two are: relative for decibels, absolute for correlations. [-]."""
        ratios = (self.deviation_db / other.deviation_db, self.between_db / other.between_db)
        memories = zip(self.memory, other.memory, strict=True)
        return float(sum(np.log(ratios) ** 2) + sum((a - b) ** 2 for a, b in memories))


def fit_room(cells: Sequence[Cell]) -> RoomFit:
    """Body, multipath and sway of a room, the nearest on a grid of simulated ones.

    Parameters
    ----------
    cells : sequence of Cell
        With the placements that are fitted on.

    Returns
    -------
    RoomFit
    """
    between = channel_correlation_of(cells)
    real = standing_of([[cell.on(channel) for channel in CHANNELS] for cell in cells])
    grid = product(_RICE_FACTORS_DB, _SWAYS_M, _SWAYS_S)
    tried = {key: real.distance(standing_of(list(spots(*key, max(0.0, between))))) for key in grid}
    rice_db, spread_m, memory_s = min(tried, key=lambda key: tried[key])
    return RoomFit(body_loss_db(cells), rice_db, spread_m, memory_s, between)


def body_loss_db(cells: Sequence[Cell]) -> float:
    """Front to back: twice the first harmonic of the mean level over the angle, all placements.

    Where the front of a placement is comes out of the fit as well: a phone at the left ear does not
    look straight ahead. [dB].
    """
    return float(
        np.mean(
            [
                _front_to_back_db([cell for cell in cells if cell.placement == placement])
                for placement in sorted({cell.placement for cell in cells})
            ]
        )
    )


def _front_to_back_db(cells: Sequence[Cell]) -> float:
    angle_rad = np.array([cell.heading_rad for cell in cells])
    level_dbm = np.array([np.nanmean(cell.levels_dbm()) for cell in cells])
    design = np.stack([np.ones(len(cells)), np.cos(angle_rad), np.sin(angle_rad)], axis=1)
    harmonic = np.linalg.lstsq(design, level_dbm, rcond=None)[0]
    return float(2.0 * np.hypot(harmonic[1], harmonic[2]))


def channel_correlation_of(cells: Sequence[Cell]) -> float:
    """Median correlation in time between two channels of a cell. [-]."""
    found = []
    for cell in cells:
        for one, other in combinations(CHANNELS, 2):
            (one_s, one_dbm), (other_s, other_dbm) = cell.on(one), cell.on(other)
            found.append(channel_correlation((one_s, other_s), (one_dbm, other_dbm), 0.02))
    return float(np.nanmedian(found))


def standing_of(cells: Sequence[Sequence[tuple[Numbers, Numbers]]]) -> Standing:
    """Statistics of links given as time and RSSI of each channel of each cell."""
    channels = [channel for cell in cells for channel in cell]
    means = np.array([[rssi.mean() for _, rssi in cell] for cell in cells])
    return Standing(
        deviation_db=float(np.median([rssi.std() for _, rssi in channels])),
        between_db=float(np.median(means.std(axis=1))),
        memory=tuple(
            float(np.nanmedian([autocorrelation(time, rssi, *lag) for time, rssi in channels]))
            for lag in _LAGS_S
        ),
    )


def spots(
    rice_db: float, spread_m: float, memory_s: float, correlation: float
) -> Iterator[list[tuple[Numbers, Numbers]]]:
    """Simulated cells: people who sway in the multipath field, each at a spot of their own."""
    fading = Fading(rice_factor_db=rice_db, channel_correlation=correlation)
    people = People(sway_m=spread_m, sway_s=memory_s)
    noise = np.random.Generator(np.random.Philox(key=[0, 0]))
    time_s = np.arange(0.0, _SPOT_S, SWAY_STEP_US * 1e-6)
    for number in range(_SPOTS):
        moved_m = sway_m(people, number, "", 0, round(_SPOT_S * 1e6))[: len(time_s)]
        x_m, y_m = np.ascontiguousarray(moved_m[:, 0]), np.ascontiguousarray(moved_m[:, 1])
        distance_m = np.hypot(1.83 + x_m, y_m)
        cell = []
        for channel in CHANNELS:
            field = MultipathField.draw(fading, number, "", channel)
            level_db = field.at_db(x_m, y_m, distance_m)
            heard = np.rint(level_db + _NOISE_DB * noise.standard_normal(len(level_db)))
            cell.append((time_s, heard))
        yield cell
