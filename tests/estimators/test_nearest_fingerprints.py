from dataclasses import replace

import numpy as np
import pytest

from blesim.errors import DataError, UsageError
from blesim.estimators.base import Need
from blesim.estimators.check import check_estimator
from blesim.estimators.nearest_fingerprints import NearestFingerprintEstimator
from blesim.estimators.practice import practice_recording
from blesim.recording import Observations, Walk, WalkKind
from blesim.rng import Draws
from blesim.tables import Marks, Readings

# RSSI of beacons 0 and 1 at each spot of the survey. [dBm]
SPOTS = {(2.0, 2.0): (-60, -80), (6.0, 2.0): (-70, -70), (10.0, 2.0): (-80, -60)}


def surveyed(spots=SPOTS):
    """Survey that stands for a second at each spot and hears two beacons there."""
    recording = practice_recording()
    walks = []
    for number, ((x_m, y_m), rssi_dbm) in enumerate(spots.items()):
        marks = Marks(time_us=[0, 1_000_000], x_m=[x_m] * 2, y_m=[y_m] * 2, level=[0, 0])
        readings = Readings(
            time_us=[100, 200], beacon=[0, 1], rssi_dbm=list(rssi_dbm), channel=[0, 0]
        )
        walks.append(
            Walk(
                name=f"spot {number}",
                walker="tester",
                phone="any",
                kind=WalkKind.SURVEY,
                observations=Observations(readings=readings, marks=marks),
            )
        )
    return replace(recording, walks=tuple(walks))


def follow(estimator, survey, *rows):
    time_us, beacon, rssi_dbm = np.array(rows, np.int64).reshape(-1, 3).T
    readings = Readings(
        time_us=time_us, beacon=beacon, rssi_dbm=rssi_dbm, channel=np.zeros(len(rows))
    )
    tracker = estimator.fit(survey.venue, (survey,)).start(
        None, Draws(seed=1, purpose="test").generator()
    )
    return tracker.advance(Observations(readings=readings))


def test_what_was_heard_at_a_spot_leads_there():
    rows = (0, 0, -70), (100, 1, -70)
    track = follow(NearestFingerprintEstimator(k=1), surveyed(), *rows)
    assert (track.x_m[-1], track.y_m[-1]) == (6.0, 2.0)


def test_the_nearest_are_weighted_by_likeness():
    # ED to (2, 2): sqrt((5^2 + 5^2) / 2) = 5, to (6, 2): 5, to (10, 2): 15.
    rows = (0, 0, -65), (100, 1, -75)
    two = follow(NearestFingerprintEstimator(k=2), surveyed(), *rows)
    assert two.x_m[-1] == pytest.approx(4.0)
    three = follow(NearestFingerprintEstimator(k=3), surveyed(), *rows)
    assert three.x_m[-1] == pytest.approx((2 / 5 + 6 / 5 + 10 / 15) / (2 / 5 + 1 / 15))
    # Two places 2 m off their mean, and squares 4 m wide.
    assert two.variance_x_m2[-1] == pytest.approx(4 + 16 / 12)


def test_beacons_not_heard_count_only_where_all_are_compared():
    # Beacon 0 alone at -80 is that of (10, 2); with beacon 1 missing at -100 it is (2, 2) that has
    # the weaker of the others: (20^2 + 20^2), (10^2 + 30^2), (0 + 40^2).
    heard = follow(NearestFingerprintEstimator(k=1), surveyed(), (0, 0, -80))
    every = follow(NearestFingerprintEstimator(k=1, compared="all"), surveyed(), (0, 0, -80))
    assert heard.x_m[-1] == 10.0
    assert every.x_m[-1] == 2.0
    louder = NearestFingerprintEstimator(k=1, compared="all", missing_dbm=-60.0)
    assert follow(louder, surveyed(), (0, 0, -80)).x_m[-1] == 10.0


def test_a_beacon_that_the_survey_did_not_hear_is_skipped():
    rows = (0, 5, -50), (100, 0, -60), (200, 5, -50), (300, 99, -40)
    track = follow(NearestFingerprintEstimator(k=1), surveyed(), *rows)
    assert track.time_us.tolist() == [100]
    assert track.x_m.tolist() == [2.0]


def test_where_nobody_stood_the_walk_is_cut_into_cells():
    recording = practice_recording()
    survey = replace(recording, walks=recording.walks[:1])
    learned = NearestFingerprintEstimator().fit(recording.venue, (survey,)).fingerprints
    assert learned.nearest.radio_map.layout.cell_m == 2.0
    finer = NearestFingerprintEstimator(cell_m=1.0).fit(recording.venue, (survey,)).fingerprints
    assert len(finer.nearest.radio_map) > len(learned.nearest.radio_map)


def test_a_survey_without_marks_is_refused():
    survey = surveyed()
    blind = tuple(
        replace(walk, observations=replace(walk.observations, marks=Marks.empty()))
        for walk in survey.walks
    )
    with pytest.raises(DataError, match="survey"):
        NearestFingerprintEstimator().fit(survey.venue, (replace(survey, walks=blind),))


def test_it_needs_a_survey_and_asks_to_be_fitted():
    assert NearestFingerprintEstimator.needs == {Need.SURVEY}
    with pytest.raises(UsageError, match="call fit"):
        NearestFingerprintEstimator().start(None, Draws(seed=1, purpose="test").generator())


@pytest.mark.parametrize("wrong", [{"k": 0}, {"compared": "some"}, {"cell_m": 0.0}])
def test_bad_settings_are_refused(wrong):
    with pytest.raises(UsageError, match=next(iter(wrong))):
        NearestFingerprintEstimator(**wrong)


def test_other_settings_keep_the_contract():
    check_estimator(NearestFingerprintEstimator(k=1, compared="all", cell_m=1.0, signal="highest"))
