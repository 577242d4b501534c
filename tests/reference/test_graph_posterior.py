"""The posterior of the graph particle filter against that of a Bayes filter on a fine grid.

The grid has cells along the edges and velocities. A velocity times the time between readings is a
whole number of cells, so that the motion on it is exact; only the velocities are rounded.
"""

from functools import cache
from uuid import UUID

import numpy as np
import pytest
import shapely
from scipy import sparse, stats

from blesim.estimators.graph_particle_filter import GraphParticleFilter
from blesim.recording import Observations
from blesim.tables import Readings
from blesim.venue.beacons import Beacon
from blesim.venue.floor_plan import FloorPlan, Level
from blesim.venue.graph import AisleGraph, Edge, Node
from blesim.venue.venue import Venue

FALSE_ALARM = 1e-6
RUNS, PARTICLES, READINGS = 40, 10_000, 30
GAP_S = 0.25
SPREAD_M_S, LIMIT_M_S = 2.5, 4.0
SPREADS_DB, EXPONENTS, LEVEL_DBM = (4.0, 6.0), (1.0, 1.3), -77.0
PHONE_M = 1.0
PLACES = {"a": (0, 0), "b": (4, 0), "c": (8, 0), "d": (0, 3), "e": (4, 3), "f": (8, -2)}
# Three junctions and a dead end; the edges are drawn this way and that.
EDGES = (
    ("a", "b", "south"),
    ("c", "b", "south"),
    ("a", "d", "west"),
    ("e", "b", "middle"),
    ("d", "e", "north"),
    ("c", "f", "spur"),
)
BEACONS_M = ((1.0, -1.0), (6.5, -1.0), (2.0, 4.0), (7.0, -2.0))
# On which branch each beacon is, worked by hand.
BEACON_BRANCH = ("south", "south", "north", "spur")


@cache
def venue() -> Venue:
    return Venue(
        name="small",
        floor_plan=FloorPlan(levels=(Level(level=0, bounds=shapely.box(-2, -4, 10, 5)),)),
        beacons=tuple(
            Beacon(
                id=f"B{row}",
                uuid=UUID(int=1),
                major=1,
                minor=row,
                x_m=x_m,
                y_m=y_m,
                z_m=2.0,
                tx_power_dbm=-12.0,
                measured_power_dbm=LEVEL_DBM,
                advertising_interval_s=0.35,
            )
            for row, (x_m, y_m) in enumerate(BEACONS_M)
        ),
        graph=AisleGraph(
            nodes=tuple(Node(id=name, x_m=x, y_m=y) for name, (x, y) in PLACES.items()),
            edges=tuple(Edge(first=a, second=b, branch=branch) for a, b, branch in EDGES),
        ),
    )


@cache
def readings() -> Readings:
    """Of a walk from a by b to e, with the noise of the model and a few from other aisles."""
    rng = np.random.default_rng(71)
    time_us = (np.arange(READINGS) * GAP_S * 1e6).astype(np.int64)
    way_m = np.arange(READINGS) * GAP_S * 0.9
    x_m, y_m = np.interp(way_m, [0, 4, 7], [0, 4, 4]), np.interp(way_m, [0, 4, 7], [0, 0, 3])
    beacon = rng.integers(0, len(BEACONS_M), READINGS)
    apart_m = np.array(BEACONS_M)[beacon] - np.stack([x_m, y_m], axis=1)
    expected_dbm = LEVEL_DBM - 10 * np.log10(np.hypot(np.hypot(*apart_m.T), 1.0))
    rssi_dbm = np.round(expected_dbm + rng.normal(0, 4, READINGS)).astype(np.int64)
    channel = np.zeros(READINGS, np.int64)
    return Readings(time_us=time_us, beacon=beacon, rssi_dbm=rssi_dbm, channel=channel)


class Grid:
    """Bayes filter with cells of one size and velocities of the size that crosses one in a gap."""

    def __init__(self, cell_m: float, turn_back: bool) -> None:
        self.cell_m, self.turn_back = cell_m, turn_back
        self.speed = np.arange(
            -round(LIMIT_M_S * GAP_S / cell_m), round(LIMIT_M_S * GAP_S / cell_m) + 1
        )
        step_m_s = cell_m / GAP_S
        ends_m = [np.array([PLACES[a], PLACES[b]], float) for a, b, _ in EDGES]
        self.cells = [round(np.abs(end[1] - end[0]).sum() / cell_m) for end in ends_m]
        self.edge = np.repeat(np.arange(len(EDGES)), self.cells)
        share = np.concatenate([(np.arange(count) + 0.5) / count for count in self.cells])
        start, end = np.array(ends_m).transpose(1, 0, 2)
        self.xy_m = start[self.edge] + share[:, None] * (end - start)[self.edge]
        self.first = np.cumsum([0, *self.cells])
        self.motion = self.motion_matrix()
        # U(-V_d, V_d) on steps of velocity, each its part of the range; the cap at the ends.
        apart = step_m_s * np.arange(-len(self.speed), len(self.speed) + 1)
        upper = np.minimum(apart + step_m_s / 2, SPREAD_M_S)
        lower = np.maximum(apart - step_m_s / 2, -SPREAD_M_S)
        inside = np.clip(upper - lower, 0, None) / (2 * SPREAD_M_S)
        self.perturbation = np.zeros((len(self.speed), len(self.speed)))
        for row in range(len(self.speed)):
            to = np.clip(
                row + np.arange(-len(self.speed), len(self.speed) + 1), 0, len(self.speed) - 1
            )
            np.add.at(self.perturbation[row], to, inside)

    def motion_matrix(self) -> sparse.csr_matrix:
        """What comes (rows) of each cell and velocity (columns) in a gap."""
        rows, columns, shares = [], [], []
        count = len(self.speed)
        for cell in range(len(self.edge)):
            for v, cells in enumerate(self.speed):
                for to, to_cells, share in self.arrivals(cell, int(cells)):
                    rows.append(to * count + int(np.searchsorted(self.speed, to_cells)))
                    columns.append(cell * count + v)
                    shares.append(share)
        size = len(self.edge) * count
        return sparse.coo_matrix((shares, (rows, columns)), shape=(size, size)).tocsr()

    def arrivals(self, cell: int, way: int) -> list[tuple[int, int, float]]:
        """Cells, velocities and shares after a way that crosses one node at most."""
        edge = self.edge[cell]
        target = cell + way
        if self.first[edge] <= target < self.first[edge + 1]:
            return [(target, way, 1.0)]
        beyond = target - self.first[edge + 1] if way > 0 else self.first[edge] - 1 - target
        node = EDGES[edge][1 if way > 0 else 0]
        doors = [
            (other, end)
            for other, names in enumerate(EDGES)
            for end in (0, 1)
            if names[end] == node
        ]
        here = (edge, 1 if way > 0 else 0)
        if not self.turn_back and len(doors) > 1:
            doors = [door for door in doors if door != here]
        return [
            (self.first[other] + beyond, abs(way), 1 / len(doors))
            if end == 0
            else (self.first[other + 1] - 1 - beyond, -abs(way), 1 / len(doors))
            for other, end in doors
        ]

    def likelihood(self, beacon: int, rssi_dbm: float) -> np.ndarray:
        """Eq 8 in every cell."""
        apart_m = self.xy_m - BEACONS_M[beacon]
        range_m = np.hypot(np.hypot(*apart_m.T), 2.0 - PHONE_M)
        same = np.array([EDGES[e][2] == BEACON_BRANCH[beacon] for e in self.edge])
        exponent = np.where(same, *EXPONENTS)
        spread_db = np.where(same, *SPREADS_DB)
        return stats.norm.pdf(rssi_dbm, LEVEL_DBM - 10 * exponent * np.log10(range_m), spread_db)

    def follow(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Means before and after each reading, (n, 2) each, and the last share of each edge."""
        velocity = np.ones(len(self.speed))
        velocity[[0, -1]] = 0.5
        mass = np.outer(np.ones(len(self.edge)), velocity)
        mass /= mass.sum()
        predicted, updated = [], []
        for row, (beacon, rssi_dbm) in enumerate(
            zip(readings().beacon, readings().rssi_dbm, strict=True)
        ):
            if row:
                mass = (self.motion @ mass.reshape(-1)).reshape(mass.shape)
            predicted.append(mass.sum(axis=1) @ self.xy_m)
            mass = mass * self.likelihood(beacon, float(rssi_dbm))[:, None]
            mass /= mass.sum()
            updated.append(mass.sum(axis=1) @ self.xy_m)
            mass = mass @ self.perturbation
        return np.array(predicted), np.array(updated), np.bincount(self.edge, mass.sum(axis=1))


@cache
def exact(turn_back: bool) -> tuple[tuple[np.ndarray, ...], float]:
    """Grid with cells of 5 cm, and how far one of 10 cm is off it at most."""
    fine, coarse = (Grid(cell_m, turn_back).follow() for cell_m in (0.05, 0.1))
    return fine, max(float(np.max(np.abs(a - b))) for a, b in zip(fine, coarse, strict=True))


def runs(estimator: GraphParticleFilter) -> tuple[np.ndarray, np.ndarray]:
    """Means of all runs, (runs, readings, 2), and shares of the edges at the end."""
    fitted = estimator.fit(venue(), ())
    means, shares = [], []
    for seed in range(RUNS):
        tracker = fitted.start(None, np.random.default_rng(1000 + seed))
        track = tracker.advance(Observations(readings=readings()))
        means.append(np.stack([track.x_m, track.y_m], axis=1))
        cloud = tracker.cloud
        shares.append(np.bincount(cloud.edge, cloud.weights, minlength=len(EDGES)))
    return np.array(means), np.array(shares)


def assert_equal_on_average(drawn: np.ndarray, expected: np.ndarray, tolerance: float) -> None:
    """False alarms: one in a million for all numbers together (Bonferroni, Student's t)."""
    error = drawn.std(axis=0, ddof=1) / np.sqrt(RUNS)
    limit = stats.t.isf(FALSE_ALARM / expected.size / 2, RUNS - 1)
    apart = np.abs(drawn.mean(axis=0) - expected)
    assert np.all(apart <= limit * error + tolerance), np.max(apart - limit * error)


def test_the_grid_is_fine_enough() -> None:
    for turn_back in (True, False):
        (predicted, _, shares), off = exact(turn_back)
        assert off < 0.02
        assert shares.sum() == pytest.approx(1.0)
        # The walk is told from a stay at the middle of the map.
        assert np.ptp(predicted[:, 0]) > 1.0


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"turn_back": False},
        {"estimate": "updated", "scheme": "systematic"},
        {"resample_below": 0.5, "scheme": "residual"},
        {"resample_below": 0.0, "particles": 40_000},
    ],
    ids=str,
)
def test_the_posterior_is_that_of_the_fine_grid(settings: dict[str, object]) -> None:
    estimator = GraphParticleFilter(**{"particles": PARTICLES, **settings})
    (predicted, updated, on_edge), tolerance = exact(estimator.turn_back)
    means, shares = runs(estimator)
    assert_equal_on_average(
        means, updated if estimator.estimate == "updated" else predicted, tolerance
    )
    assert_equal_on_average(shares, on_edge, tolerance)


@pytest.mark.parametrize(
    "wrong", [{"exponent_other": 1.1}, {"turn_back": False}, {"velocity_spread_m_s": 1.0}], ids=str
)
def test_a_wrong_model_is_told_from_the_right_one(wrong: dict[str, object]) -> None:
    (predicted, _, _), tolerance = exact(True)
    means, _ = runs(GraphParticleFilter(**{"particles": PARTICLES, **wrong}))
    with pytest.raises(AssertionError):
        assert_equal_on_average(means, predicted, tolerance)
