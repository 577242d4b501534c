import json
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest

from blesim.errors import DataError
from blesim.metrics.score import score
from blesim.recording import Failure, Truth, WalkKind, WalkTruth
from blesim.venue.graph import AisleGraph

KEYS = [
    "estimator", "walk", "n", "unmatched", "mean_m", "std_m", "rmse_m", "median_m", "p75_m",
    "p90_m", "ce50_m", "ce95_m", "max_m", "wrong_level", "wrong_aisle", "graph_mean_m", "failure",
]  # fmt: skip


@pytest.fixture
def world(by_hand):
    """Two walks along aisle 1, of 1 and of 3 readings, and a survey; their truth."""
    recording = by_hand.recording_of(
        by_hand.walk_of("survey", by_hand.readings_at(1), WalkKind.SURVEY),
        by_hand.walk_of("short", by_hand.readings_at(6)),
        by_hand.walk_of("long", by_hand.readings_at(2, 4, 6)),
    )
    walked = WalkTruth(trajectory=by_hand.along_aisle_1())
    walks = MappingProxyType(dict.fromkeys(("survey", "short", "long"), walked))
    return recording, Truth(venue=recording.venue, walks=walks)


def test_the_last_row_pools_readings_and_not_walks(by_hand, world):
    # The walker is at x = 2 + t; the estimate stays at x = 8: errors 0, and 4, 2, 0.
    track = by_hand.track_of([0], 8.0, 2.0)
    rows = score(*world, {("a", "long"): track, ("a", "short"): track})
    assert [row.walk for row in rows] == ["short", "long", "all"]
    assert [row.summary.n for row in rows] == [1, 3, 4]
    assert [row.summary.mean_m for row in rows] == pytest.approx([0.0, 2.0, 1.5])


def test_estimators_keep_their_order_and_surveys_are_not_scored(by_hand, world):
    track = by_hand.track_of([0], 8.0, 2.0)
    names = ("survey", "short", "long")
    rows = score(*world, {(label, walk): track for label in ("b", "a") for walk in names})
    assert [(row.estimator, row.walk) for row in rows] == [
        (label, walk) for label in ("b", "a") for walk in ("short", "long", "all")
    ]


def test_a_failure_counts_its_readings_as_unmatched(by_hand, world):
    track = by_hand.track_of([0], 8.0, 2.0)
    rows = score(*world, {("a", "short"): track, ("a", "long"): Failure(reason="no luck")})
    assert [row.failure for row in rows] == [None, "no luck", "no track of long"]
    assert [(row.summary.n, row.summary.unmatched) for row in rows] == [(1, 0), (0, 3), (1, 3)]
    assert rows[1].summary.mean_m is None


def test_a_walk_without_a_track_is_not_passed_over(by_hand, world):
    rows = score(*world, {("a", "short"): by_hand.track_of([0], 8.0, 2.0)})
    assert [row.failure for row in rows] == [None, "no track of this walk", "no track of long"]
    assert rows[-1].summary.unmatched == 3


def test_rows_are_what_json_can_hold(by_hand, world):
    tracks = {("a", "short"): by_hand.track_of([0], 8.0, 2.0), ("a", "long"): Failure(reason="x")}
    rows = [row.as_dict() for row in score(*world, tracks)]
    assert json.loads(json.dumps(rows, allow_nan=False)) == rows
    assert all(list(row) == KEYS for row in rows)
    assert rows[0]["wrong_aisle"] == 0.0
    assert rows[0]["graph_mean_m"] == pytest.approx(0.0)


def test_without_a_graph_there_is_no_aisle_to_miss(by_hand, world):
    recording, truth = world
    plain = replace(recording.venue, graph=None)
    track = by_hand.track_of([0], 8.0, 2.0)
    rows = score(
        replace(recording, venue=plain), replace(truth, venue=plain), {("a", "short"): track}
    )
    assert rows[0].summary.mean_m == 0.0
    assert rows[0].summary.wrong_aisle is None
    assert rows[0].summary.graph_mean_m is None


def test_edges_of_another_graph_than_the_true_one_are_not_believed(by_hand, world):
    recording, truth = world
    graph = recording.venue.graph
    turned = AisleGraph(nodes=graph.nodes, edges=graph.edges[::-1])
    surveyed = replace(recording, venue=replace(recording.venue, graph=turned))
    # Row 3 is aisle 1 on the surveyed map, but the west cross aisle on the true one.
    track = by_hand.track_of([0], 8.0, 2.0, edge=3, offset_m=6.0)
    assert score(surveyed, truth, {("a", "short"): track})[0].summary.wrong_aisle == 0.0


def test_tracks_of_another_recording_are_refused(by_hand, world):
    track = by_hand.track_of([0], 8.0, 2.0)
    with pytest.raises(DataError, match=r"'a' is of walk 'unknown'.*survey, short, long"):
        score(*world, {("a", "unknown"): track})
    with pytest.raises(DataError, match=r"walk 'short': .*outside the walk"):
        score(*world, {("a", "short"): by_hand.track_of([0, 13], 8.0, 2.0)})


def test_a_walk_without_truth_is_refused(by_hand, world):
    recording, truth = world
    empty = replace(truth, walks=MappingProxyType({}))
    with pytest.raises(DataError, match="walk 'short' has no truth"):
        score(recording, empty, {("a", "short"): by_hand.track_of([0], 8.0, 2.0)})


def test_no_tracks_have_no_rows(world):
    assert score(*world, {}) == []


def test_figures_do_not_depend_on_the_order_of_walks(by_hand, world):
    recording, truth = world
    track = by_hand.track_of([0], 8.0, 2.5)
    tracks = {("a", "short"): track, ("a", "long"): track}
    there = score(recording, truth, tracks)[-1].summary
    back = score(replace(recording, walks=recording.walks[::-1]), truth, tracks)[-1].summary
    np.testing.assert_allclose(there.mean_m, back.mean_m)
    assert there.ce95_m == back.ce95_m


def test_an_edge_before_the_first_is_refused(by_hand, world):
    track = by_hand.track_of([0], 8.0, 2.0, edge=-7, offset_m=1.0)
    with pytest.raises(DataError, match="names an edge that the aisle graph lacks"):
        score(*world, {("a", "short"): track})
