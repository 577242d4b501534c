"""Statistics of the hall of Danis et al., recorded or simulated, and the panels of its picture."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from blesim.fidelity.comparison import Panel, correlation_panel, distribution
from blesim.fidelity.correlation import autocorrelation, correlation_between_places
from blesim.fidelity.levels import (
    drift_db,
    explained_share,
    level_deviation_db,
    level_noise_db,
    level_spread_db,
)
from blesim.fidelity.links import Link, links_of
from blesim.fidelity.path_fit import PathFit, fit_path
from blesim.fidelity.reception import gap_s, received_share, reception_at
from blesim.fidelity.scorecard import Statistic
from blesim.recording import Walk, WalkTruth
from blesim.units import to_s
from blesim.venue.venue import Venue

Numbers = NDArray[np.float64]
Walks = Sequence[tuple[Walk, WalkTruth]]

POINT_HEIGHT_M = 1.85
TRACK_HEIGHT_M = 1.75
_FEWEST = 50
# The advertising interval and the mean of the delay before each event.
EVENT_S = 0.455


@dataclass(frozen=True, slots=True, kw_only=True)
class Hall:
    """Points and tracks of the hall, recorded or simulated."""

    venue: Venue
    points: Walks
    tracks: Walks

    def point_links(self) -> list[Link]:
        """Links that stand still."""
        return list(links_of(self.venue, self.points, POINT_HEIGHT_M, _FEWEST))

    def track_links(self) -> list[Link]:
        """Links that move."""
        return list(links_of(self.venue, self.tracks, TRACK_HEIGHT_M, _FEWEST))


def hall_statistics(hall: Hall) -> list[Statistic]:
    """All statistics of the hall, recorded or simulated."""
    points, tracks = hall.point_links(), hall.track_links()
    return [
        *_distance_statistics(points, len(hall.venue.beacons)),
        *_level_statistics(points),
        *_standing_statistics(points),
        *_reception_statistics(points, hall),
        *_moving_statistics(tracks, len(hall.tracks)),
    ]


def _statistic(name: str, unit: str, values: Sequence[float]) -> Statistic:
    return Statistic(name=name, unit=unit, values=np.array(values, dtype=np.float64))


def point_fits(points: Sequence[Link], receivers: int) -> list[tuple[PathFit, Numbers]]:
    """Fit of mean RSSI over distance for each receiver, and its places, (n, 2). [m]."""
    fits = []
    for row in range(receivers):
        mine = [link for link in points if link.beacon == row]
        distance_m = np.array([link.distance_m[0] for link in mine])
        level_dbm = np.array([link.level_dbm for link in mine])
        places_m = np.array([link.place_m[0] for link in mine]).reshape(-1, 2)
        fits.append((fit_path(distance_m, level_dbm), places_m))
    return fits


def _distance_statistics(points: Sequence[Link], receivers: int) -> list[Statistic]:
    """Per receiver, over points."""
    fits = point_fits(points, receivers)
    nearby = [
        _statistic(
            f"points: residual correlation, {name}",
            "1",
            [correlation_between_places(places, fit.residuals_db, *limits) for fit, places in fits],
        )
        for name, limits in (("2 to 2.6 m", (1.9, 2.6)), ("3.5 to 5 m", (3.5, 5.0)))
    ]
    return [
        _statistic("points: level at 1 m, A", "dBm", [fit.level_dbm for fit, _ in fits]),
        _statistic("points: path loss exponent, n", "1", [fit.exponent for fit, _ in fits]),
        _statistic("points: residual spread, sigma", "dB", [fit.deviation_db for fit, _ in fits]),
        *nearby,
        _statistic("points: mean RSSI", "dBm", [link.level_dbm for link in points]),
    ]


def _level_statistics(points: Sequence[Link]) -> list[Statistic]:
    """Per link that stands still."""
    rssi = [link.rssi_dbm for link in points]
    return [
        _statistic("link: variance explained by 3 levels", "1", list(map(explained_share, rssi))),
        _statistic("link: lowest to highest level", "dB", list(map(level_spread_db, rssi))),
        _statistic("link: deviation of levels", "dB", list(map(level_deviation_db, rssi))),
        _statistic("link: noise within a level", "dB", list(map(level_noise_db, rssi))),
        _statistic(
            "link: drift over a minute",
            "dB",
            [drift_db(link.time_s, link.rssi_dbm, 60.0) for link in points],
        ),
    ]


def _standing_statistics(points: Sequence[Link]) -> list[Statistic]:
    """Per link that stands still: correlation after some events, and after a minute."""
    lags_s = ((1, 0.30, 0.60), (2, 0.76, 1.06), (3, 1.21, 1.51), (6, 2.58, 2.88))
    return [
        *(
            _statistic(
                f"standing: autocorrelation after {lag * EVENT_S:.2f} s",
                "1",
                [autocorrelation(link.time_s, link.rssi_dbm, low, high) for link in points],
            )
            for lag, low, high in lags_s
        ),
        _statistic(
            "standing: autocorrelation after 60 s",
            "1",
            [autocorrelation(link.time_s, link.rssi_dbm, 55.0, 65.0) for link in points],
        ),
    ]


def _reception_statistics(points: Sequence[Link], hall: Hall) -> list[Statistic]:
    duration_s = [to_s(truth.trajectory.time_us[-1]).item() for _, truth in hall.points]
    received = [received_share(link.time_s, duration_s[link.walk], EVENT_S) for link in points]
    return [
        _statistic("link: median gap", "s", [gap_s(link.time_s, 0.5) for link in points]),
        _statistic("link: 95 % gap", "s", [gap_s(link.time_s, 0.95) for link in points]),
        *(
            _statistic(
                f"receiver: events received at {name}",
                "1",
                [
                    reception_at(*_level_and_share(points, received, row), low, high)
                    for row in range(len(hall.venue.beacons))
                ],
            )
            for name, low, high in (
                ("-100 to -84 dBm", -100.0, -84.0),
                ("-84 to -76 dBm", -84.0, -76.0),
                ("-76 to -40 dBm", -76.0, -40.0),
            )
        ),
    ]


def _level_and_share(
    points: Sequence[Link], received: Sequence[float], row: int
) -> tuple[Numbers, Numbers]:
    mine = [number for number, link in enumerate(points) if link.beacon == row]
    return (
        np.array([points[number].level_dbm for number in mine]),
        np.array([received[number] for number in mine]),
    )


def _moving_statistics(tracks: Sequence[Link], count: int) -> list[Statistic]:
    """Per track: RSSI over distance. Per link: how long and how far its residuals are alike."""
    fits = [_track_fit([link for link in tracks if link.walk == number]) for number in range(count)]
    residuals = [fit_path(link.distance_m, link.rssi_dbm).residuals_db for link in tracks]
    moved = list(zip(tracks, residuals, strict=True))
    return [
        _statistic("tracks: level at 1 m, A", "dBm", [fit.level_dbm for fit in fits]),
        _statistic("tracks: path loss exponent, n", "1", [fit.exponent for fit in fits]),
        _statistic("tracks: residual spread, sigma", "dB", [fit.deviation_db for fit in fits]),
        _statistic("moving: spread about the path loss", "dB", [r.std() for r in residuals]),
        *(
            _statistic(
                f"moving: autocorrelation after {name} s",
                "1",
                [autocorrelation(link.time_s, r, low, high) for link, r in moved],
            )
            for name, low, high in (("0.46", 0.3, 0.6), ("0.91", 0.76, 1.06), ("2.73", 2.58, 2.88))
        ),
        *(
            _statistic(
                f"moving: autocorrelation over {low:g} to {high:g} m",
                "1",
                [autocorrelation(_travelled_m(link), r, low, high) for link, r in moved],
            )
            for low, high in ((0.0, 0.25), (0.5, 1.0), (1.5, 2.5))
        ),
    ]


def _track_fit(links: Sequence[Link]) -> PathFit:
    return fit_path(
        np.concatenate([np.empty(0), *(link.distance_m for link in links)]),
        np.concatenate([np.empty(0), *(link.rssi_dbm for link in links)]),
    )


def _travelled_m(link: Link) -> Numbers:
    steps_m = np.hypot(*np.diff(link.place_m, axis=0).T)
    return np.concatenate([[0.0], np.cumsum(steps_m)])


def hall_panels(real: Hall, simulated: Hall) -> tuple[Panel, ...]:
    """Panels of the picture: marginals, levels, gaps, correlation over time."""
    points = real.point_links(), simulated.point_links()
    tracks = real.track_links(), simulated.track_links()
    return (
        distribution(
            "All readings at the points",
            "RSSI [dBm]",
            *(np.concatenate([link.rssi_dbm for link in side]) for side in points),
        ),
        distribution(
            "Lowest to highest of three levels",
            "spread of a link [dB]",
            *([level_spread_db(link.rssi_dbm) for link in side] for side in points),
        ),
        distribution(
            "Noise within a level",
            "standard deviation [dB]",
            *([level_noise_db(link.rssi_dbm) for link in side] for side in points),
        ),
        distribution(
            "Gaps",
            "from reading to reading of a link, up to 3 s [s]",
            *(_gaps_s(side, 3.0) for side in points),
        ),
        _autocorrelation_panel("Standing", points[0], points[1]),
        _autocorrelation_panel("Moving", tracks[0], tracks[1]),
    )


def _gaps_s(links: Sequence[Link], longest_s: float) -> Numbers:
    gaps_s = np.concatenate([np.diff(link.time_s) for link in links])
    return gaps_s[gaps_s <= longest_s]


def _autocorrelation_panel(title: str, real: Sequence[Link], simulated: Sequence[Link]) -> Panel:
    return correlation_panel(
        f"{title}: correlation over time",
        "link",
        EVENT_S * np.arange(1.0, 13.0, dtype=np.float64),
        lambda links, lag_s: [_alike(link, lag_s) for link in links],
        real,
        simulated,
    )


def _alike(link: Link, lag_s: float) -> float:
    return autocorrelation(link.time_s, _residual_db(link), lag_s - 0.15, lag_s + 0.15)


def _residual_db(link: Link) -> Numbers:
    if np.ptp(link.distance_m) == 0:
        return link.rssi_dbm
    return fit_path(link.distance_m, link.rssi_dbm).residuals_db
