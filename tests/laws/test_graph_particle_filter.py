"""What the graph particle filter keeps to: more particles, less noise, a mirrored venue."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from scipy import stats

from blesim.estimators.graph_particle_filter import GraphParticleFilter
from blesim.recording import Observations
from blesim.tables import Readings
from blesim.venue.floor_plan import FloorPlan, Level
from blesim.venue.graph import AisleGraph
from blesim.venue.venue import Venue

WALKS = 24
FALSE_ALARM = 1e-6
GAP_US = 80_000
# Along the middle aisle of the section, up the east side and back along the next aisle.
CORNERS_M = np.array([[8.0, 8.1], [54.3, 8.1], [54.3, 13.5], [30.0, 13.5]])


def walked(
    venue: Venue, seed: int, noise_db: float, exponent: float, count: int = 900
) -> tuple[np.ndarray, Observations]:
    """Places (n, 2) and readings after Eq 1 with one exponent, of beacons within 15 m."""
    rng = np.random.default_rng(seed)
    passed_m = np.append(0.0, np.cumsum(np.hypot(*np.diff(CORNERS_M, axis=0).T)))
    time_us = np.arange(count) * GAP_US
    way_m = passed_m[-1] * np.arange(count) / count
    xy_m = np.stack([np.interp(way_m, passed_m, axis) for axis in CORNERS_M.T], axis=1)
    apart_m = venue.beacon_xyz_m[None] - np.column_stack([xy_m, np.ones(count)])[:, None]
    range_m = np.linalg.norm(apart_m, axis=2)
    beacon = np.argmax(rng.random(range_m.shape) * (range_m < 15.0), axis=1)
    expected_dbm = -77 - 10 * exponent * np.log10(range_m[np.arange(count), beacon])
    rssi_dbm = np.round(expected_dbm + noise_db * rng.normal(size=count))
    readings = Readings(
        time_us=time_us,
        beacon=beacon,
        rssi_dbm=np.maximum(rssi_dbm, -127).astype(np.int64),
        channel=np.zeros(count, np.int64),
    )
    return xy_m, Observations(readings=readings)


def error_m(venue: Venue, estimator: GraphParticleFilter, seed: int, *how: float) -> float:
    """Mean error of one walk, the first tenth left out."""
    xy_m, seen = walked(venue, seed, *how)
    track = estimator.fit(venue, ()).start(None, np.random.default_rng(seed)).advance(seen)
    errors_m = np.hypot(track.x_m - xy_m[:, 0], track.y_m - xy_m[:, 1])
    return float(errors_m[len(errors_m) // 10 :].mean())


def test_the_walk_is_along_the_aisles(section: Venue) -> None:
    assert section.graph is not None
    xy_m, _ = walked(section, 1, 4.0, 1.0)
    _, _, off_m = section.graph.nearest(xy_m[:, 0], xy_m[:, 1], np.zeros(len(xy_m)))
    assert off_m.max() < 1e-6


def test_more_particles_are_never_worse_on_average(section: Venue) -> None:
    """Paired by walk; false alarms one in a million by Student's t."""
    numbers = (30, 120, 480)
    errors_m = np.array(
        [
            [
                error_m(
                    section,
                    GraphParticleFilter(particles=number, exponent_other=1.0, spread_other_db=4.0),
                    seed,
                    4.0,
                    1.0,
                )
                for number in numbers
            ]
            for seed in range(WALKS)
        ]
    )
    limit = stats.t.isf(FALSE_ALARM / (len(numbers) - 1), WALKS - 1)
    gained_m = -np.diff(errors_m, axis=1)
    assert np.all(gained_m.mean(axis=0) > -limit * gained_m.std(axis=0, ddof=1) / np.sqrt(WALKS))
    # The first few count for much.
    assert gained_m[:, 0].mean() > 0.2


def test_without_noise_the_error_goes_to_the_rounding(section: Venue) -> None:
    """RSSI falls steeply here, so that whole decibels tell a range to a few per cent."""
    sharp = {"exponent_same": 4.0, "exponent_other": 4.0, "particles": 1000, "estimate": "updated"}
    errors_m = []
    for noise_db, spread_db in ((8.0, 8.0), (4.0, 4.0), (2.0, 2.0), (0.0, 0.5)):
        estimator = GraphParticleFilter(
            spread_same_db=spread_db, spread_other_db=spread_db, **sharp
        )
        walks = [error_m(section, estimator, seed, noise_db, 4.0) for seed in range(6)]
        errors_m.append(float(np.mean(walks)))
    assert errors_m == sorted(errors_m, reverse=True)
    assert errors_m[-1] < 0.15


@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_mirrored_venue_gives_mirrored_tracks(section: Venue, axis: str) -> None:
    # Edges, offsets and draws are the same; only the map is turned over.
    estimator = GraphParticleFilter(particles=200)
    _, seen = walked(section, 5, 4.0, 1.0, count=400)
    here, there = (
        estimator.fit(venue, ()).start(None, np.random.default_rng(6)).advance(seen)
        for venue in (section, mirrored(section, axis))
    )
    sign_x, sign_y = (-1, 1) if axis == "x" else (1, -1)
    np.testing.assert_allclose(there.x_m, sign_x * here.x_m, rtol=0, atol=2e-6)
    np.testing.assert_allclose(there.y_m, sign_y * here.y_m, rtol=0, atol=2e-6)
    np.testing.assert_allclose(there.variance_x_m2, here.variance_x_m2, rtol=1e-5)
    np.testing.assert_allclose(there.covariance_xy_m2, -here.covariance_xy_m2, rtol=1e-5, atol=1e-5)


def mirrored(venue: Venue, axis: str) -> Venue:
    """The aisles and beacons with one coordinate negated, without shelves."""
    graph = venue.graph
    assert graph is not None
    name = f"{axis}_m"
    nodes = tuple(replace(node, **{name: -getattr(node, name)}) for node in graph.nodes)
    return Venue(
        name="mirrored",
        floor_plan=FloorPlan(levels=(Level(level=0, bounds=shapely.box(-200, -200, 200, 200)),)),
        beacons=tuple(b.model_copy(update={name: -getattr(b, name)}) for b in venue.beacons),
        graph=AisleGraph(nodes=nodes, edges=graph.edges),
    )
