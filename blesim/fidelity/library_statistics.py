"""Statistics of a library campaign, recorded or simulated, and the panels of its picture."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from blesim.fidelity.comparison import Panel, distribution
from blesim.fidelity.correlation import correlation_between_places
from blesim.fidelity.path_fit import PathFit, fit_path
from blesim.fidelity.scorecard import Statistic
from blesim.radio.profiles import LIBRARY_HEIGHT_M
from blesim.recording import Walk, WalkTruth
from blesim.units import wrap_angle
from blesim.venue.line_of_sight import LineOfSight
from blesim.venue.venue import Venue

Numbers = NDArray[np.float64]

PHONES = ("A5", "BQ", "S6")
_SCANS = 6
# Above this no packet is lost for weakness, below the other some are.
STRONG_DBM, WEAK_DBM = -80.0, -88.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Point:
    """What one phone heard at one point.

    Attributes
    ----------
    phone : str
        Which.
    place_m : ndarray of float64, (2,)
        [m]
    heading_rad : float
        Which way the carrier looks. [rad]
    rssi_dbm : ndarray of float64, (scans, beacons)
        NaN where a beacon was not heard in a scan. [dBm]
    """

    phone: str
    place_m: Numbers
    heading_rad: float
    rssi_dbm: Numbers

    def level_dbm(self) -> Numbers:
        """Mean over scans, (beacons,); NaN where never heard. [dBm]."""
        heard = np.isfinite(self.rssi_dbm).sum(axis=0)
        total = np.nansum(self.rssi_dbm, axis=0)
        return np.where(heard > 0, total / np.maximum(heard, 1), np.nan)

    def detected(self) -> Numbers:
        """Share of scans in which each beacon was heard, (beacons,). [-]."""
        share: Numbers = np.isfinite(self.rssi_dbm).mean(axis=0)
        return share


@dataclass(frozen=True, slots=True, kw_only=True)
class Library:
    """One campaign in the library, recorded or simulated."""

    venue: Venue
    walks: Sequence[tuple[Walk, WalkTruth]]

    def points(self) -> list[Point]:
        """What was heard at each point."""
        return [_point(walk, truth, len(self.venue.beacons)) for walk, truth in self.walks]


def _point(walk: Walk, truth: WalkTruth, beacons: int) -> Point:
    """Readings by scan: the first of each beacon, as a scanner that reports each only once does."""
    readings, ends_us = walk.observations.readings, walk.observations.marks.time_us
    rssi_dbm = np.full((len(ends_us), beacons), np.nan)
    scan = np.searchsorted(ends_us, readings.time_us)
    for row in np.flatnonzero(scan < len(ends_us))[::-1].tolist():
        rssi_dbm[scan[row], readings.beacon[row]] = readings.rssi_dbm[row]
    place_m = np.array([truth.trajectory.x_m[0], truth.trajectory.y_m[0]])
    # Six scans make a visit; the first of each starts the scanner up.
    running = np.arange(len(ends_us)) % _SCANS > 0
    return Point(
        phone=walk.phone,
        place_m=place_m,
        heading_rad=float(truth.trajectory.heading_rad[0]),
        rssi_dbm=rssi_dbm[running],
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Links:
    """All links of a phone and its points; arrays (points, beacons).

    Attributes
    ----------
    places_m : ndarray of float64, (points, 2)
        [m]
    level_dbm, detected : ndarray of float64
        Mean RSSI, share of scans. [dBm], [-]
    distance_m : ndarray of float64
        [m]
    crossings : ndarray of float64, (points, beacons, 3)
        Bookcases and pillars between, and how far the carrier's back is turned: 0 to 1. [-]
    """

    places_m: Numbers
    level_dbm: Numbers
    detected: Numbers
    distance_m: Numbers
    crossings: Numbers

    def fit(self, beacon: int | None = None, *, obstacles: bool) -> PathFit:
        """Fit of the mean RSSI over distance, of one beacon or of all."""
        chosen = np.isfinite(self.level_dbm)
        if beacon is not None:
            chosen &= np.arange(chosen.shape[1]) == beacon
        crossings = self.crossings[chosen] if obstacles else None
        return fit_path(self.distance_m[chosen], self.level_dbm[chosen], crossings)

    def residual_correlation(self, beacon: int, low_m: float, high_m: float) -> float:
        """Correlation of residuals with obstacles and body, of places some way apart. [-]."""
        heard = np.isfinite(self.level_dbm[:, beacon])
        residuals_db = self.fit(beacon, obstacles=True).residuals_db
        return correlation_between_places(self.places_m[heard], residuals_db, low_m, high_m)


def links_of_phone(library: Library, points: Sequence[Point]) -> Links:
    """Links between points and all beacons."""
    places_m = np.array([[*point.place_m, LIBRARY_HEIGHT_M] for point in points])
    beacons_m = library.venue.beacon_xyz_m
    start_m = np.repeat(places_m, len(beacons_m), axis=0)
    end_m = np.tile(beacons_m, (len(places_m), 1))
    obstacles = library.venue.floor_plan.obstacles
    counts = [
        (LineOfSight.through(kind).lengths_m(end_m, start_m) > 0).sum(axis=1)
        for kind in (
            [o for o in obstacles if o.material == material] for material in ("bookcase", "pillar")
        )
    ]
    away_m = end_m - start_m
    heading_rad = np.repeat([point.heading_rad for point in points], len(beacons_m))
    turned = wrap_angle(np.arctan2(away_m[:, 1], away_m[:, 0]) - heading_rad)
    shape = len(places_m), len(beacons_m)
    behind = (1.0 - np.cos(turned)) / 2.0
    return Links(
        places_m=places_m[:, :2],
        level_dbm=np.array([point.level_dbm() for point in points]),
        detected=np.array([point.detected() for point in points]),
        distance_m=np.linalg.norm(start_m - end_m, axis=1).reshape(shape),
        crossings=np.stack([*counts, behind], axis=1).reshape(*shape, 3),
    )


def library_statistics(library: Library) -> list[Statistic]:
    """All statistics of a campaign; a unit is a beacon as one phone hears it, or a point."""
    points = library.points()
    mine = {phone: [point for point in points if point.phone == phone] for phone in PHONES}
    links = {phone: links_of_phone(library, mine[phone]) for phone in PHONES}
    return [
        *_distance_statistics(links),
        *_place_statistics(links),
        *_phone_statistics(links),
        *(each for phone in PHONES for each in _statistics_of(phone, mine[phone], links[phone])),
        Statistic(
            name="deviation over scans of a link",
            unit="dB",
            values=np.concatenate([over_scans_db(point) for point in points]),
        ),
    ]


def _distance_statistics(links: Mapping[str, Links]) -> list[Statistic]:
    """Per phone and beacon, over points."""
    units = [(mine, row) for mine in links.values() for row in range(mine.level_dbm.shape[1])]
    plain = [mine.fit(row, obstacles=False) for mine, row in units]
    through = [mine.fit(row, obstacles=True) for mine, row in units]
    columns: dict[tuple[str, str], list[float]] = {
        ("path loss exponent, n", "1"): [fit.exponent for fit in plain],
        ("residual spread, sigma", "dB"): [fit.deviation_db for fit in plain],
        ("path loss exponent with obstacles and body", "1"): [fit.exponent for fit in through],
        ("residual spread with obstacles and body", "dB"): [fit.deviation_db for fit in through],
        ("loss of a bookcase", "dB"): [float(fit.loss_db[0]) for fit in through],
        ("loss of a pillar", "dB"): [float(fit.loss_db[1]) for fit in through],
        ("loss of the body, front to back", "dB"): [float(fit.loss_db[2]) for fit in through],
    }
    return [
        Statistic(name=name, unit=unit, values=np.array(values))
        for (name, unit), values in columns.items()
    ]


def _place_statistics(links: Mapping[str, Links]) -> list[Statistic]:
    """Per phone and beacon: how alike the residuals are of visits to places some way apart."""
    limits = {"looking the other way, same place": (-0.1, 0.1), "1 to 2.2 m": (1.0, 2.2)}
    return [
        Statistic(
            name=f"residual correlation, {name}",
            unit="1",
            values=np.array(
                [
                    mine.residual_correlation(row, *apart)
                    for mine in links.values()
                    for row in range(mine.level_dbm.shape[1])
                ]
            ),
        )
        for name, apart in limits.items()
    ]


def _phone_statistics(links: Mapping[str, Links]) -> list[Statistic]:
    """Per beacon: how much stronger one phone reads than the other at the same points."""
    found = []
    for one, other in (("A5", "BQ"), ("BQ", "S6")):
        difference_db = links[one].level_dbm - links[other].level_dbm
        medians = [
            float(np.median(column[np.isfinite(column)])) if np.isfinite(column).any() else np.nan
            for column in difference_db.T
        ]
        found.append(Statistic(name=f"{one} above {other}", unit="dB", values=np.array(medians)))
    return found


def _statistics_of(phone: str, points: Sequence[Point], links: Links) -> list[Statistic]:
    heard = [point.rssi_dbm[np.isfinite(point.rssi_dbm)] for point in points]
    per_scan = [float(np.isfinite(point.rssi_dbm).sum(axis=1).mean()) for point in points]
    columns: dict[tuple[str, str], list[float]] = {
        **{
            (f"{100 * share:g} % of RSSI", "dBm"): [
                float(np.quantile(rssi, share)) if len(rssi) else np.nan for rssi in heard
            ]
            for share in (0.05, 0.5, 0.95)
        },
        ("beacons heard in a scan", "1"): per_scan,
        (f"heard above {STRONG_DBM:g} dBm", "1"): _detection(links, STRONG_DBM, 0.0),
        (f"heard below {WEAK_DBM:g} dBm", "1"): _detection(links, -130.0, WEAK_DBM),
    }
    return [
        Statistic(name=f"{phone}: {name}", unit=unit, values=np.array(values))
        for (name, unit), values in columns.items()
    ]


def _detection(links: Links, low_dbm: float, high_dbm: float) -> list[float]:
    """Per beacon: share of scans it is heard in, where its level lies between the two."""
    between = (links.level_dbm >= low_dbm) & (links.level_dbm < high_dbm)
    return [
        float(share[rows].mean()) if rows.any() else np.nan
        for share, rows in zip(links.detected.T, between.T, strict=True)
    ]


def over_scans_db(point: Point) -> Numbers:
    """Standard deviation of each link of a point that was heard at least three times. [dB]."""
    often = np.isfinite(point.rssi_dbm).sum(axis=0) >= 3
    spread: Numbers = np.nanstd(point.rssi_dbm[:, often], axis=0, ddof=1)
    return spread


def library_panels(real: Library, simulated: Library) -> tuple[Panel, ...]:
    """Panels of the picture: marginals, spread over scans, reception."""
    sides = real.points(), simulated.points()
    by_phone = [
        distribution(
            f"{phone}: all readings",
            "RSSI [dBm]",
            *(_heard_by(side, phone) for side in sides),
        )
        for phone in PHONES
    ]
    return (
        *by_phone,
        distribution(
            "Deviation over the scans of a link",
            "standard deviation [dB]",
            *(np.concatenate([over_scans_db(point) for point in side]) for side in sides),
        ),
        _reception_panel(real, simulated),
        distribution(
            "Beacons heard in a scan",
            "beacons [-]",
            *(
                np.concatenate([np.isfinite(p.rssi_dbm).sum(axis=1) for p in side])
                for side in sides
            ),
        ),
    )


def _heard_by(points: Sequence[Point], phone: str) -> Numbers:
    heard = [p.rssi_dbm[np.isfinite(p.rssi_dbm)] for p in points if p.phone == phone]
    return np.concatenate([np.empty(0), *heard])


def _reception_panel(real: Library, simulated: Library) -> Panel:
    """Reception of the S6, which hears most, over the mean level of a link."""
    edges_dbm = np.arange(-100.0, -55.0, 3.0)
    curves = []
    for side in (real, simulated):
        links = links_of_phone(side, [point for point in side.points() if point.phone == "S6"])
        curve = [
            np.mean(links.detected[(links.level_dbm >= low) & (links.level_dbm < low + 3.0)])
            if np.any((links.level_dbm >= low) & (links.level_dbm < low + 3.0))
            else np.nan
            for low in edges_dbm.tolist()
        ]
        curves.append(np.array([edges_dbm + 1.5, curve]))
    return Panel(
        title="S6: reception over level",
        x_label="mean RSSI of a link [dBm]",
        y_label="share of scans it is heard in [-]",
        kind="curve",
        real=curves[0],
        simulated=curves[1],
    )
