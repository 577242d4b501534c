"""Statistics of people standing with a phone, recorded or simulated, and panels of the picture."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from blesim.fidelity.comparison import Panel, correlation_panel, distribution
from blesim.fidelity.correlation import autocorrelation, channel_correlation, decay_time_s
from blesim.fidelity.reception import gap_s
from blesim.fidelity.scorecard import Statistic
from blesim.venue.beacons import CHANNELS

Numbers = NDArray[np.float64]
_OfChannel = Callable[[Numbers, Numbers], float]

_MEMORY_STEP_S = 0.25
_LONGEST_MEMORY_S = 8.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cell:
    """One person standing with one phone: readings on three channels, in order of time.

    Attributes
    ----------
    placement : str
        Where the phone is carried.
    angle_deg : int
        0 where the person faces the sniffer, 180 with the back to it. [degree]
    rep : int
        The how-manieth repetition.
    time_s, rssi_dbm, channel : ndarray, (n,)
        [s], [dBm]
    """

    placement: str
    angle_deg: int
    rep: int
    time_s: Numbers
    rssi_dbm: Numbers
    channel: NDArray[np.int64]

    @property
    def duration_s(self) -> float:
        """From the first to the last reading. [s]."""
        return float(np.ptp(self.time_s))

    @property
    def heading_rad(self) -> float:
        """Which way the person looks; the sniffer is in direction 0. [rad]."""
        return float(np.deg2rad(self.angle_deg))

    def on(self, channel: int) -> tuple[Numbers, Numbers]:
        """Times and RSSI of one channel. [s], [dBm]."""
        rows = self.channel == channel
        return self.time_s[rows], self.rssi_dbm[rows]

    def levels_dbm(self) -> Numbers:
        """Mean RSSI of each channel, (3,); NaN where nothing was heard. [dBm]."""
        heard = [self.on(channel)[1] for channel in CHANNELS]
        return np.array([rssi.mean() if len(rssi) else np.nan for rssi in heard])


def room_statistics(room: str, cells: Sequence[Cell]) -> list[Statistic]:
    """All statistics of one room; a unit is a cell, a channel of a cell, or a placement."""
    columns: dict[tuple[str, str], list[float]] = {
        ("mean RSSI", "dBm"): [float(np.nanmean(cell.levels_dbm())) for cell in cells],
        ("lowest to highest channel", "dB"): [float(np.ptp(c.levels_dbm())) for c in cells],
        ("deviation of channels", "dB"): [float(np.std(c.levels_dbm())) for c in cells],
        ("body swing over the angles", "dB"): body_swings_db(cells),
        ("standing: deviation of a channel", "dB"): _each(cells, _deviation_db),
        ("standing: 5 to 50 % of RSSI", "dB"): _each(cells, _lower_half_db),
        ("standing: 50 to 95 % of RSSI", "dB"): _each(cells, _upper_half_db),
        ("standing: 1/e time", "s"): _each(cells, _memory_s),
        ("standing: autocorrelation after 0.5 s", "1"): _each(cells, _after_half_a_second),
        ("standing: autocorrelation after 2 s", "1"): _each(cells, _after_two_seconds),
        ("standing: step between packets", "dB"): _each(cells, _step_db),
        ("correlation between channels", "1"): [r for c in cells for r in _between_channels(c)],
        ("median gap of a channel", "s"): _each(cells, _median_gap_s),
    }
    return [
        Statistic(name=f"{room}: {name}", unit=unit, values=np.array(values))
        for (name, unit), values in columns.items()
    ]


def body_swings_db(cells: Sequence[Cell]) -> list[float]:
    """From the weakest to the strongest angle, per placement and channel. [dB]."""
    swings = []
    for placement in sorted({cell.placement for cell in cells}):
        levels = np.array([cell.levels_dbm() for cell in cells if cell.placement == placement])
        swings += (np.nanmax(levels, axis=0) - np.nanmin(levels, axis=0)).tolist()
    return swings


def _each(cells: Sequence[Cell], of: _OfChannel) -> list[float]:
    return [of(*cell.on(channel)) for cell in cells for channel in CHANNELS]


def _deviation_db(_time_s: Numbers, rssi_dbm: Numbers) -> float:
    return float(np.std(rssi_dbm)) if len(rssi_dbm) else np.nan


def _lower_half_db(_time_s: Numbers, rssi_dbm: Numbers) -> float:
    low, middle = np.quantile(rssi_dbm, [0.05, 0.5]) if len(rssi_dbm) else (np.nan, np.nan)
    return float(middle - low)


def _upper_half_db(_time_s: Numbers, rssi_dbm: Numbers) -> float:
    middle, high = np.quantile(rssi_dbm, [0.5, 0.95]) if len(rssi_dbm) else (np.nan, np.nan)
    return float(high - middle)


def _memory_s(time_s: Numbers, rssi_dbm: Numbers) -> float:
    return decay_time_s(time_s, rssi_dbm, _MEMORY_STEP_S, _LONGEST_MEMORY_S)


def _after_half_a_second(time_s: Numbers, rssi_dbm: Numbers) -> float:
    return autocorrelation(time_s, rssi_dbm, 0.4, 0.6)


def _after_two_seconds(time_s: Numbers, rssi_dbm: Numbers) -> float:
    return autocorrelation(time_s, rssi_dbm, 1.8, 2.2)


def _step_db(time_s: Numbers, rssi_dbm: Numbers) -> float:
    """Root mean square step from one packet to the next within 0.1 s."""
    steps_db = np.diff(rssi_dbm)[np.diff(time_s) < 0.1]
    return float(np.sqrt(np.mean(steps_db**2))) if len(steps_db) else np.nan


def _median_gap_s(time_s: Numbers, _rssi_dbm: Numbers) -> float:
    return gap_s(time_s, 0.5)


def _between_channels(cell: Cell) -> list[float]:
    correlations = []
    for pair in combinations(CHANNELS, 2):
        (first_s, first_dbm), (second_s, second_dbm) = (cell.on(channel) for channel in pair)
        correlations.append(
            channel_correlation((first_s, second_s), (first_dbm, second_dbm), within_s=0.02)
        )
    return correlations


def room_panels(room: str, real: Sequence[Cell], simulated: Sequence[Cell]) -> list[Panel]:
    """Panels of the picture: marginals, channel levels, correlation over time."""
    sides = real, simulated
    return [
        distribution(
            f"{room}: about the mean of a channel",
            "RSSI less its mean [dB]",
            *(np.concatenate([_centred(c, ch) for c in s for ch in CHANNELS]) for s in sides),
        ),
        distribution(
            f"{room}: lowest to highest channel",
            "spread of a cell [dB]",
            *([float(np.ptp(c.levels_dbm())) for c in side] for side in sides),
        ),
        _memory_panel(room, real, simulated),
    ]


def _centred(cell: Cell, channel: int) -> Numbers:
    rssi_dbm = cell.on(channel)[1]
    return rssi_dbm - rssi_dbm.mean() if len(rssi_dbm) else rssi_dbm


def _memory_panel(room: str, real: Sequence[Cell], simulated: Sequence[Cell]) -> Panel:
    return correlation_panel(
        f"{room}: correlation over time, standing",
        "channel",
        np.arange(0.125, 6.0, 0.25),
        lambda cells, lag_s: [
            autocorrelation(*cell.on(channel), lag_s - 0.125, lag_s + 0.125)
            for cell in cells
            for channel in CHANNELS
        ],
        real,
        simulated,
    )
