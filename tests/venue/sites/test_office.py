import numpy as np
import pytest

from blesim.venue.sites.office import office_dense, office_sparse


@pytest.mark.parametrize(
    ("build", "count", "in_ring", "spacing_m"),
    [(office_dense, 20, 15, 9.0), (office_sparse, 8, 7, 18.0)],
)
def test_the_published_measures_hold(build, count, in_ring, spacing_m):
    office = build()
    assert office.floor_plan.levels[0].bounds.bounds == (0.0, 0.0, 60.0, 40.0)
    assert len(office.beacons) == count
    for beacon in office.beacons:
        settings = (beacon.z_m, beacon.tx_power_dbm, beacon.advertising_interval_s)
        assert settings == (1.5, -16.0, 0.1)
    ring = [beacon for beacon in office.beacons if beacon.id.startswith("r")]
    assert len(ring) == in_ring
    # Along the ring, 136 m; as the crow flies across its corners it is less.
    assert 136.0 / in_ring == pytest.approx(spacing_m, rel=0.1)
    apart_m = np.linalg.norm(office.beacon_xyz_m[:, None] - office.beacon_xyz_m[None], axis=2)
    np.fill_diagonal(apart_m, np.inf)
    assert apart_m.min(axis=1).mean() == pytest.approx(spacing_m, rel=0.15)


def test_both_are_the_same_building():
    dense, sparse = office_dense(), office_sparse()
    assert dense.graph == sparse.graph
    assert dense.floor_plan == sparse.floor_plan


def test_the_ring_and_the_middle_aisle_hold_20_beacons_9_m_apart():
    graph = office_dense().graph
    names = np.array(graph.branches)[graph.branch]
    assert graph.length_m[~np.char.startswith(names, "cross")].sum() == pytest.approx(180.0)
