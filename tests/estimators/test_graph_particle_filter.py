from dataclasses import replace

import numpy as np
import pytest

from blesim.errors import UsageError
from blesim.estimators.base import Need
from blesim.estimators.check import check_estimator
from blesim.estimators.events import cut, event_order, one_reading_each
from blesim.estimators.graph_particle_filter import GraphParticleFilter
from blesim.estimators.practice import practice_recording, practice_venue
from blesim.estimators.run import surveys_of
from blesim.recording import Observations
from blesim.tables import Readings, Steps, Track
from blesim.venue.floor_plan import FloorPlan
from blesim.venue.graph import AisleGraph, Edge, Node

# Edge 0 leads from (2, 2) to (14, 2), edge 1 on to (14, 6), edge 2 back to (2, 6).
STILL = {"velocity_spread_m_s": 0.0, "particles": 64}


def readings_of(*rows):
    time_us, beacon, rssi_dbm = np.array(rows).T
    return Readings(time_us=time_us, beacon=beacon, rssi_dbm=rssi_dbm, channel=np.zeros(len(rows)))


def seen_of(*rows, steps=()):
    time_us, length_m, heading_rad = np.array(steps, float).reshape(-1, 3).T
    told = Steps(time_us=time_us.astype(np.int64), length_m=length_m, heading_rad=heading_rad)
    return Observations(readings=readings_of(*rows) if rows else Readings.empty(), steps=told)


def started(settings, venue=None, seed=1):
    fitted = GraphParticleFilter(**settings).fit(practice_venue() if venue is None else venue, ())
    return fitted.start(None, np.random.default_rng(seed))


def placed(settings, edge, offset_m, velocity_m_s):
    """Tracker whose particles have all been put to one place at time 0."""
    tracker = started(settings)
    tracker.advance(seen_of((0, 0, -70)))
    tracker.cloud.edge[:] = edge
    tracker.cloud.offset_m[:] = offset_m
    tracker.cloud.velocity_m_s[:] = velocity_m_s
    return tracker


def two_levels():
    """The practice venue with a second level: one aisle from (2, 4) to (14, 4), beacons 4 to 7."""
    venue = practice_venue()
    nodes = (
        *venue.graph.nodes,
        Node(id="e", x_m=2.0, y_m=4.0, level=1),
        Node(id="f", x_m=14.0, y_m=4.0, level=1),
    )
    edges = (*venue.graph.edges, Edge(first="e", second="f", branch="upstairs"))
    upper = replace(venue.floor_plan.levels[0], level=1)
    return replace(
        venue,
        floor_plan=FloorPlan(levels=(venue.floor_plan.levels[0], upper)),
        graph=AisleGraph(nodes=nodes, edges=edges),
        beacons=tuple(
            beacon.model_copy(update={"level": int(row >= 4)})
            for row, beacon in enumerate(venue.beacons)
        ),
    )


def test_particles_walk_on_with_their_velocity():
    # Eq 7: from 3 m at 1.5 m/s for 2 s to 6 m, which is x = 8.
    track = placed(STILL, 0, 3.0, 1.5).advance(seen_of((2_000_000, 1, -70)))
    assert (track.x_m[0], track.y_m[0]) == (8.0, 2.0)
    assert (track.edge[0], track.offset_m[0]) == (0, 6.0)
    # All at one place: only the half metre off the centre line is left.
    assert (track.variance_x_m2[0], track.variance_y_m2[0]) == (0.25, 0.25)


def test_the_estimate_is_the_mean_of_the_particles_on_the_map():
    tracker = placed(STILL, 0, 11.0, 0.0)
    tracker.cloud.edge[32:], tracker.cloud.offset_m[32:] = 1, 3.0
    track = tracker.advance(seen_of((1, 1, -70)))
    # Half of them at (13, 2), half at (14, 5); the nearest aisle is 0.5 m to the east.
    assert (track.x_m[0], track.y_m[0]) == (13.5, 3.5)
    assert (track.edge[0], track.offset_m[0]) == (1, 1.5)
    assert track.variance_x_m2[0] == pytest.approx(0.25 + 0.25)
    assert track.variance_y_m2[0] == pytest.approx(2.25 + 0.25)
    assert track.covariance_xy_m2[0] == pytest.approx(0.75)


def test_particles_are_weighed_by_the_likelihood_of_the_reading():
    # Eq 1 and 8 by hand, beacon 0 at (2, 0.5), 1 m above the phone, -61 dBm at 1 m. On its aisle
    # at (8, 2): d^2 = 36 + 2.25 + 1; on the other at (8, 6): 36 + 30.25 + 1.
    tracker = placed({**STILL, "resample_below": 0.0}, 0, 6.0, 0.0)
    tracker.cloud.edge[32:] = 2
    tracker.cloud.weights[:], tracker.cloud.log_weights[:] = 1 / 64, 0.0
    tracker.advance(seen_of((1, 0, -70)))
    same = np.exp(-0.5 * ((-70 + 61 + 5 * np.log10(39.25)) / 4) ** 2) / 4
    other = np.exp(-0.5 * ((-70 + 61 + 6.5 * np.log10(67.25)) / 6) ** 2) / 6
    weights = tracker.cloud.weights
    assert weights[0] / weights[63] == pytest.approx(same / other)
    assert weights.sum() == pytest.approx(1.0)


def test_resampling_prefers_the_likely_and_can_be_left_to_need():
    # -75 dBm of beacon 1 at (6, 0.5) is far more likely from far away.
    def after(**settings):
        tracker = placed({**STILL, **settings}, 0, 4.0, 0.0)
        tracker.cloud.offset_m[:32] = 12.0
        tracker.advance(seen_of((1, 1, -75)))
        return tracker.cloud

    for scheme in ("multinomial", "stratified", "systematic", "residual"):
        cloud = after(scheme=scheme)
        assert np.count_nonzero(cloud.offset_m == 12.0) > 50
        np.testing.assert_array_equal(cloud.weights, 1 / 64)
    # Their effective sample size is half of them, as nearly all weight is on one half.
    assert np.count_nonzero(after(resample_below=0.3).offset_m == 12.0) == 32
    assert np.count_nonzero(after(resample_below=0.8).offset_m == 12.0) > 50


def test_velocities_change_within_the_spread_and_the_limit():
    settings = {"particles": 4001, "velocity_spread_m_s": 2.0, "velocity_limit_m_s": 3.0}
    tracker = placed(settings, 0, 6.0, 2.0)
    tracker.advance(seen_of((0, 0, -70)))
    velocity = tracker.cloud.velocity_m_s
    assert 0.0 <= velocity.min() < 0.05
    # U(0, 4) with all above 3 m/s, a quarter, set to 3: 5.7 standard deviations, one in 1e8.
    share = np.mean(velocity == 3.0)
    assert abs(share - 0.25) < 5.7 * np.sqrt(0.25 * 0.75 / 4001)
    below = velocity[velocity < 3.0]
    assert abs(below.mean() - 1.5) < 5.7 * 3 / np.sqrt(12 * len(below))


def test_it_begins_anywhere_on_the_graph():
    # 32 m of aisle around (8, 4): variances of a uniform place, worked by hand: on the 12 m edges
    # 12^2 / 12, on the 4 m edges 36; and 4 and 16 / 12. Five standard errors.
    track = started({"particles": 20_000}).advance(seen_of((0, 0, -70)))
    assert track.x_m[0] == pytest.approx(8.0, abs=0.15)
    assert track.y_m[0] == pytest.approx(4.0, abs=0.07)
    assert track.variance_x_m2[0] == pytest.approx(0.75 * 12 + 0.25 * 36 + 0.25, abs=0.6)
    assert track.variance_y_m2[0] == pytest.approx(0.75 * 4 + 0.25 * 4 / 3 + 0.25, abs=0.1)


@pytest.mark.parametrize(("turn_back", "expected"), [(False, 0), (True, 2000)])
def test_turning_back_at_a_node_is_a_setting(turn_back, expected):
    settings = {**STILL, "particles": 4000, "turn_back": turn_back, "resample_below": 0.0}
    tracker = placed(settings, 0, 11.0, 2.0)
    tracker.advance(seen_of((1_000_000, 0, -70)))
    back = np.count_nonzero(tracker.cloud.edge == 0)
    assert abs(back - expected) <= (5.7 * np.sqrt(1000) if expected else 0)


def test_the_estimate_can_wait_for_the_reading():
    # After the first reading of beacon 0 the cloud is nearer to it than before.
    before, after = (
        started({"estimate": when, "particles": 5000}).advance(seen_of((0, 0, -55))).x_m[0]
        for when in ("predicted", "updated")
    )
    assert after < before - 1.0


def test_presets_are_the_rows_of_the_tables():
    names = ("particles", "spread_same_db", "spread_other_db", "velocity_spread_m_s", "velocity_limit_m_s")  # fmt: skip # noqa: E501 (one row)
    rows = {"table-1-500": (500, 4, 6, 2.5, 4), "table-3-250": (250, 4, 6, 3, 6), "table-3-1000": (1000, 4, 5, 2.5, 4)}  # fmt: skip # noqa: E501 (a table)
    for preset, row in rows.items():
        tuning = GraphParticleFilter(preset=preset).tuning
        assert tuple(getattr(tuning, name) for name in names) == row
    assert GraphParticleFilter() == GraphParticleFilter(preset="table-1-500")
    own = GraphParticleFilter(preset="table-3-250", particles=7).tuning
    assert (own.particles, own.velocity_limit_m_s) == (7, 6.0)


def test_needs_follow_the_settings():
    assert GraphParticleFilter().needs == {Need.GRAPH}
    assert GraphParticleFilter(motion="steps").needs == {Need.GRAPH, Need.STEPS}
    assert GraphParticleFilter(curve="survey").needs == {Need.GRAPH, Need.SURVEY}


def test_the_survey_gives_the_curve():
    recording = practice_recording()
    fitted = GraphParticleFilter(curve="survey").fit(recording.venue, surveys_of(recording))
    # Made with -61 dBm at one metre and exponent 2, aisle or not.
    np.testing.assert_allclose(fitted.curves.exponents, 2.0, atol=0.3)
    np.testing.assert_allclose(fitted.curves.level_dbm, -61.0, atol=3.0)


def exact_steps(**settings):
    still = {"step_spread": 0.0, "heading_spread_rad": 0.0, "wander_m_s": 0.0}
    return {"motion": "steps", "particles": 64, **still, **settings}


def test_steps_move_the_particles():
    # Two steps of 0.6 m to the east, one round the corner at (14, 2) to the north.
    tracker = placed(exact_steps(), 0, 10.9, 0.0)
    east, north = 0.0, np.pi / 2 - 0.1
    steps = ((500_000, 0.6, east), (1_000_000, 0.4, east), (1_500_000, 0.7, north))
    track = tracker.advance(seen_of((900_000, 0, -70), (2_000_000, 0, -70), steps=steps))
    # To (13.5, 2), 0.4 m on, 0.1 m to the corner and 0.6 m beyond it.
    assert list(zip(track.x_m, track.y_m, strict=True)) == [(13.5, 2.0), (14.0, 2.6)]


def test_steps_without_length_or_heading_are_passed_over():
    tracker = placed(exact_steps(), 0, 6.0, 0.0)
    seen = seen_of((900_000, 0, -70), steps=((1, np.nan, 0.0), (2, 0.6, np.nan), (3, 0.6, 0.0)))
    assert tracker.advance(seen).x_m[0] == 8.6


def test_spreads_of_steps_spread_the_particles():
    def spread_m(**settings):
        tracker = placed(exact_steps(**settings), 0, 6.0, 0.0)
        seen = seen_of((1_000_000, 0, -70), steps=((1, 0.5, 0.0),))
        return np.sqrt(tracker.advance(seen).variance_x_m2[0] - 0.25)

    assert spread_m() == pytest.approx(0.0, abs=1e-6)
    assert spread_m(step_spread=0.2, particles=4000) == pytest.approx(0.1, rel=0.1)
    assert spread_m(wander_m_s=0.3, particles=4000) == pytest.approx(0.3, rel=0.1)
    # Headings so unsure that a good many step back.
    assert spread_m(heading_spread_rad=1.5, particles=4000) > 0.3


def test_the_level_is_where_it_is_heard_strongest():
    rows = ((0, 0, -80), (1, 4, -85), (2, 1, -70), (3, 5, -60), (4, 0, -65))
    track = started({"particles": 100}, two_levels()).advance(seen_of(*rows))
    assert track.level.tolist() == [0, 0, 0, 1, 1]
    # The aisle upstairs is edge 4 at y = 4.
    assert track.edge.tolist()[3:] == [4, 4]
    np.testing.assert_allclose(track.y_m[3:], 4.0)
    # A beacon of another level moves the particles on but does not weigh them.
    assert np.all(track.variance_y_m2[:3] > 0.3)


def test_blocks_do_not_matter_on_several_levels():
    recording = practice_recording()
    seen = recording.by_name["there"].observations
    for motion in ("velocity", "steps"):
        settings = {"particles": 40, "motion": motion, "level_window_s": 0.7}
        fitted = GraphParticleFilter(**settings).fit(two_levels(), ())

        def follow(blocks, fitted=fitted):
            tracker = fitted.start(None, np.random.default_rng(4))
            return Track.concatenate([tracker.advance(block) for block in blocks])

        whole = follow([seen])
        assert len(set(whole.level.tolist())) == 2
        assert follow(one_reading_each(seen)) == whole
        assert follow(cut(seen, range(0, len(event_order(seen)[0]), 7))) == whole


def test_beacons_on_levels_without_aisles_are_passed_over():
    venue = two_levels()
    ground = replace(
        venue, graph=AisleGraph(nodes=venue.graph.nodes[:4], edges=venue.graph.edges[:4])
    )
    track = started({"particles": 50}, ground).advance(seen_of((0, 5, -50), (7, 0, -70)))
    assert (track.time_us.tolist(), track.level.tolist()) == ([7], [0])


def test_a_long_silence_leaves_them_anywhere():
    tracker = started({"particles": 3000})
    near = tracker.advance(seen_of(*((k * 1000, 0, -58) for k in range(50))))
    later = tracker.advance(seen_of((10**12, 0, -58)))
    assert later.variance_x_m2[0] > 15.0 > near.variance_x_m2[-1]


def test_one_beacon_and_one_aisle_will_do():
    venue = practice_venue()
    alone = replace(
        venue,
        beacons=venue.beacons[:1],
        graph=AisleGraph(nodes=venue.graph.nodes[:2], edges=venue.graph.edges[:1]),
    )
    rows = [(k * 100_000, 0, -65) for k in range(100)]
    track = started({}, alone).advance(seen_of(*rows))
    assert len(track) == 100
    np.testing.assert_allclose(track.y_m, 2.0)


def test_no_readings_give_no_track_and_it_asks_to_be_fitted():
    assert len(started({}).advance(Observations())) == 0
    assert len(started(exact_steps()).advance(seen_of(steps=((1, 0.6, 0.0),)))) == 0
    with pytest.raises(UsageError, match="call fit"):
        GraphParticleFilter().start(None, np.random.default_rng(1))
    with pytest.raises(UsageError, match="no aisle graph"):
        GraphParticleFilter().fit(replace(practice_venue(), graph=None), ())


@pytest.mark.parametrize(
    "settings",
    [
        {"scheme": "residual", "resample_below": 0.5, "estimate": "updated", "turn_back": False},
        {"motion": "steps", "scheme": "systematic"},
        {"curve": "survey", "particles": 1},
    ],
    ids=str,
)
def test_it_keeps_the_contract_at_other_settings(settings):
    check_estimator(GraphParticleFilter(**{"particles": 41, **settings}))


@pytest.mark.parametrize(
    "wrong",
    [
        {"particles": 0},
        {"spread_same_db": 0.0},
        {"spread_other_db": np.inf},
        {"velocity_spread_m_s": -1.0},
        {"velocity_limit_m_s": np.nan},
        {"preset": "table-2"},
        {"curve": "guess"},
        {"exponent_same": 0.0},
        {"exponent_other": 20.0},
        {"phone_height_m": -1.0},
        {"scheme": "best"},
        {"resample_below": 1.5},
        {"estimate": "later"},
        {"motion": "wheels"},
        {"step_spread": -0.1},
        {"heading_spread_rad": 4.0},
        {"wander_m_s": -1.0},
        {"level_window_s": 0.0},
    ],
    ids=str,
)
def test_bad_settings_are_refused(wrong):
    with pytest.raises(UsageError, match=next(iter(wrong))):
        GraphParticleFilter(**wrong)
