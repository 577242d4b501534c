import math
from dataclasses import replace

import numpy as np
import pytest

from blesim.errors import DataError, UsageError
from blesim.estimators.base import Need, StartInfo
from blesim.estimators.check import check_estimator
from blesim.estimators.pdr_fingerprint import PdrFingerprint, drawn_to
from blesim.estimators.practice import practice_recording, practice_venue
from blesim.recording import Observations, Provenance, Recording, Walk, WalkKind
from blesim.rng import Draws
from blesim.tables import Marks, Readings, Steps

# Beacons row 0 at (2, 0.5) and row 3 at (14, 0.5), -61 dBm at 1 m.
EAST, NORTH, WEST, SOUTH = 0.0, math.pi / 2, math.pi, -math.pi / 2
# Digest: the vectors of one point in four directions.
POINT = {
    EAST: (-66, -85, -76, -79),
    NORTH: (-79, -84, -76, -81),
    WEST: (-72, -85, -79, -77),
    SOUTH: (-71, -79, -74, -69),
}
SETTINGS = {"source": "system", "step_variance_m2": 0.5, "fix_variance_m2": 4.0}
MARK = PdrFingerprint(begin="mark", start_m=2.0, correction=False, **SETTINGS)
START = StartInfo(x_m=0.0, y_m=0.0)


def heard(*rows):
    """Readings of (time in s, beacon, RSSI)."""
    time_s, beacon, rssi_dbm = np.array(rows, float).reshape(-1, 3).T
    return Readings(
        time_us=(time_s * 1e6).astype(int),
        beacon=beacon,
        rssi_dbm=rssi_dbm,
        channel=np.zeros(len(rows)),
    )


def walked(*rows):
    """Step events of (time in s, heading), their own length 0.9 m."""
    time_s, heading_rad = np.array(rows, float).reshape(-1, 2).T
    return Steps(
        time_us=(time_s * 1e6).astype(int),
        length_m=np.full(len(rows), 0.9),
        heading_rad=heading_rad,
    )


def surveyed(*stands):
    """Survey that stands at each (x, y, heading, RSSI of the first second and of the second)."""
    marks, readings = [], []
    for k, (x_m, y_m, heading_rad, *vectors) in enumerate(stands):
        marks += [(4 * k, x_m, y_m, heading_rad), (4 * k + 2, x_m, y_m, math.nan)]
        readings += [
            (4 * k + 0.1 * (1 + n) + late, n, dbm)
            for late in (0.0, 1.0)
            for n, dbm in enumerate(vectors[round(late) % len(vectors)])
        ]
    time_s, x_m, y_m, heading_rad = np.array(marks).T
    observations = Observations(
        readings=heard(*readings),
        marks=Marks(
            time_us=(time_s * 1e6).astype(int),
            x_m=x_m,
            y_m=y_m,
            level=np.zeros(len(marks)),
            heading_rad=heading_rad,
        ),
    )
    walk = Walk(name="s", walker="t", phone="p", kind=WalkKind.SURVEY, observations=observations)
    provenance = Provenance(title="survey", source="test")
    return (Recording(venue=practice_venue(), walks=(walk,), provenance=provenance),)


# Beacon 0 alone is loud at (1.2, 0), beacon 1 alone at (6, 0), whichever way one looks.
TWO_PLACES = surveyed(
    *[(1.2, 0.0, way, (-50, -90)) for way in POINT], *[(6.0, 0.0, way, (-90, -50)) for way in POINT]
)


def follow(estimator, steps, readings, surveys=TWO_PLACES, start=START):
    fitted = estimator.fit(practice_venue(), surveys)
    tracker = fitted.start(start, Draws(seed=1, purpose="test").generator())
    return tracker.advance(Observations(steps=steps, readings=readings))


def test_the_kalman_filter_by_hand():
    readings = heard((0.1, 0, -50), (0.2, 1, -90))
    track = follow(MARK, walked((1, EAST), (2, EAST)), readings)
    assert track.time_us.tolist() == [100_000, 200_000, 1_000_000, 2_000_000]
    # P = 4 + 0.5, K = 4.5 / 8.5, z = (1.2, 0); then P = K R + 0.5.
    first = 0.6 + 4.5 / 8.5 * (1.2 - 0.6)
    variance = 4 * 4.5 / 8.5 + 0.5
    second = first + 0.6 + variance / (variance + 4) * (1.2 - first - 0.6)
    np.testing.assert_allclose(track.x_m, [0, 0, first, second], atol=1e-6)
    np.testing.assert_allclose(track.y_m, 0.0)
    expected = [4, 4, 4 * 4.5 / 8.5, 4 * variance / (variance + 4)]
    np.testing.assert_allclose(track.variance_x_m2, expected, atol=1e-6)
    np.testing.assert_allclose(track.variance_y_m2, expected, atol=1e-6)


def test_without_readings_steps_alone_move_it():
    track = follow(MARK, walked((1, EAST), (2, NORTH)), Readings.empty())
    np.testing.assert_allclose(track.x_m, [0.6, 0.6])
    np.testing.assert_allclose(track.y_m, [0.0, 0.6], atol=1e-6)
    np.testing.assert_allclose(track.variance_x_m2, [4.5, 5.0])


def test_after_a_long_silence_nothing_is_heard():
    readings = heard((0.1, 0, -50))
    track = follow(MARK, walked((3.2, EAST)), readings)
    assert track.x_m[-1] == pytest.approx(0.6)
    patient = replace(MARK, forget_s=10.0)
    assert follow(patient, walked((3.2, EAST)), readings).x_m[-1] > 0.8


def test_eq_1_the_mean_of_the_last_readings():
    # Beacon 0 at -50, then -90, -90: the mean of three, -77, is nearer to -90, that of ten readings
    # in which -50 comes four times, to -50.
    rows = [(0.1 * k, 0, -50) for k in range(4)] + [(0.4 + 0.1 * k, 0, -90) for k in range(3)]
    readings = heard(*rows, (0.9, 1, -70))
    near = follow(MARK, walked((1, EAST)), readings).x_m[-1]
    far = follow(replace(MARK, last=4), walked((1, EAST)), readings).x_m[-1]
    assert (near, far) == pytest.approx((0.6 + 4.5 / 8.5 * 0.6, 0.6 + 4.5 / 8.5 * 5.4), abs=1e-6)


def test_the_direction_of_the_step_chooses_the_database():
    # The vector of the digest's point looking north is the one of another point looking east.
    surveys = surveyed(
        *[(8.0, 4.0, way, vector) for way, vector in POINT.items()],
        (3.0, 4.0, EAST, POINT[NORTH]),
    )
    readings = heard(*[(0.1 * (n + 1), n, dbm) for n, dbm in enumerate(POINT[NORTH])])
    sure = replace(MARK, fix_variance_m2=1e-6)
    for way, x_m in ((NORTH, 8.0), (EAST, 3.0), (0.7, 3.0), (0.9, 8.0)):
        track = follow(sure, walked((1, way)), readings, surveys)
        assert track.x_m[-1] == pytest.approx(x_m, abs=1e-3)
    # One database holds both: the first of equals.
    alone = replace(sure, directions=0)
    surveys = surveyed(
        *[(8.0, 4.0, EAST, POINT[way]) for way in (EAST, SOUTH)], (3.0, 4.0, WEST, POINT[NORTH])
    )
    assert follow(alone, walked((1, EAST)), readings, surveys).x_m[-1] == pytest.approx(3, abs=1e-3)


def test_a_direction_nobody_looked_takes_all():
    surveys = surveyed((1.2, 0.0, NORTH, (-50, -90)), (6.0, 0.0, NORTH, (-90, -50)))
    readings = heard((0.1, 0, -50), (0.2, 1, -90))
    assert follow(MARK, walked((1, WEST)), readings, surveys).x_m[-1] == pytest.approx(
        -0.6 + 4.5 / 8.5 * 1.8, abs=1e-6
    )


def test_it_begins_at_the_fingerprint_of_what_is_heard():
    begins = replace(MARK, begin="fingerprint")
    readings = heard((0.1, 0, -50), (0.2, 1, -90), (0.5, 1, -50), (2.0, 1, -50))
    track = follow(begins, walked((1, EAST)), readings, start=None)
    # -50 and -70, mean of two, do not decide; it is at the first, and steps from there.
    assert track.x_m[:2].tolist() == [1.2, 1.2]
    assert track.variance_x_m2[:2].tolist() == [4.0, 4.0]
    # After the first step a reading alone moves nothing.
    assert track.x_m[-1] == track.x_m[-2]


def test_steps_before_anything_is_heard_give_no_estimate():
    begins = replace(MARK, begin="fingerprint")
    track = follow(begins, walked((1, EAST), (3, EAST)), heard((2, 1, -50)), start=None)
    assert track.time_us.tolist() == [2_000_000, 3_000_000]
    assert track.x_m[0] == 6.0


def test_length_of_a_step():
    wide = replace(MARK, step_m=0.9)
    assert follow(wide, walked((1, EAST)), Readings.empty()).x_m[0] == pytest.approx(0.9)


def test_eq_7_and_8_the_point_drawn_to_the_beacon():
    beacon = np.array([1.0, 1.0])
    np.testing.assert_allclose(drawn_to(np.array([5.0, 4.0]), beacon, 2.5), [3.0, 2.5])
    np.testing.assert_allclose(drawn_to(np.array([1.5, 1.0]), beacon, 2.5), [1.5, 1.0])
    np.testing.assert_allclose(drawn_to(beacon, beacon, 0.0), beacon)


def standing(estimator, rssi_dbm, until_s=8.0, start=None, begin_s=0.1):
    """Where somebody who stands at (14, 5.5), by belief, ends up; beacon 3 hangs at (14, 0.5)."""
    times_s = np.arange(begin_s, until_s, 0.5)
    readings = heard(*[(time_s, 3, rssi_dbm) for time_s in times_s])
    start = StartInfo(x_m=14.0, y_m=5.5) if start is None else start
    return follow(estimator, walked((0.05, SOUTH)), readings, start=start)


CORRECTED = replace(MARK, correction=True, exponent=2.0, start_m=0.0, fix_variance_m2=1e6)


def test_standing_for_six_seconds_corrects():
    # -61 - 20 log10(2) dBm is 2 m; one step south before.
    track = standing(CORRECTED, -67)
    range_m = 10 ** (6 / 20)
    late = track.time_us >= 6_050_000
    np.testing.assert_allclose(track.y_m[~late], 4.9, atol=1e-2)
    np.testing.assert_allclose(track.y_m[late], 0.5 + range_m, atol=1e-2)
    assert np.count_nonzero(late) == 4
    quick = standing(replace(CORRECTED, still_s=2.0), -67)
    assert quick.y_m[quick.time_us >= 2_050_000][0] == pytest.approx(0.5 + range_m, abs=1e-2)


def test_without_correction_or_far_away_or_inside_it_stays():
    assert standing(replace(CORRECTED, correction=False), -67).y_m[-1] == pytest.approx(
        4.9, abs=0.01
    )
    # -72 dBm are 3.5 m: too far for the RSSI to be believed, unless 4 m are near.
    assert standing(CORRECTED, -72).y_m[-1] == pytest.approx(4.9, abs=0.01)
    near = replace(CORRECTED, near_m=4.0)
    assert standing(near, -72).y_m[-1] == pytest.approx(0.5 + 10 ** (11 / 20), abs=0.01)
    inside = StartInfo(x_m=14.0, y_m=2.0)
    assert standing(CORRECTED, -67, start=inside).y_m[-1] == pytest.approx(1.4, abs=0.01)


def test_a_step_ends_the_stand():
    readings = heard(*[(0.5 * k, 3, -67) for k in range(24)])
    start = StartInfo(x_m=14.0, y_m=5.5)
    track = follow(CORRECTED, walked((4, SOUTH), (9.8, SOUTH)), readings, start=start)
    np.testing.assert_allclose(track.y_m[track.time_us < 4_000_000], 5.5, atol=1e-3)
    # 5.8 s of standing, and another step; two more seconds.
    np.testing.assert_allclose(track.y_m[-1], 5.5 - 1.2, atol=0.02)


def test_corrections_go_on_if_so_asked():
    # After 6 s the RSSI rises, and the mean of the last ten readings with it.
    start = StartInfo(x_m=14.0, y_m=5.5)
    rows = [(0.5 * k, 3, -67) for k in range(14)] + [(7 + 0.5 * k, 3, -61) for k in range(12)]
    once = follow(CORRECTED, walked(), heard(*rows), start=start)
    again = follow(replace(CORRECTED, every_reading=True), walked(), heard(*rows), start=start)
    assert once.y_m[-1] == pytest.approx(0.5 + 10 ** (6 / 20), abs=1e-3)
    assert again.y_m[-1] == pytest.approx(1.5, abs=1e-3)


def test_the_path_loss_of_the_survey_tells_ranges():
    recording = practice_recording()
    surveys = (replace(recording, walks=recording.walks[:1]),)
    survey = PdrFingerprint(**SETTINGS).fit(recording.venue, surveys).survey
    # Practice readings are -61 - 20 log10(d) with 4 dB noise, d in space.
    ranges = [survey.range_m(row, -61 - 20 * math.log10(4)) for row in range(8)]
    assert 2.5 < np.median(ranges) < 6.0
    known = PdrFingerprint(exponent=2.0, **SETTINGS).fit(recording.venue, surveys).survey
    assert known.range_m(0, -61 - 20 * math.log10(4)) == pytest.approx(4.0)


def test_the_survey_tells_how_wrong_fingerprints_are():
    # Without noise each second finds the fingerprint of the other: no error but the least.
    tried = replace(MARK, fix_variance_m2=None, compared="heard")
    assert tried.fit(practice_venue(), TWO_PLACES).survey.fix_variance_m2 == 0.06
    # When the quiet beacon alone is heard, another that is not heard at all, at -100 dBm, makes it
    # the other place, 4.8 m away: four of 16 vectors.
    tried = replace(tried, compared="all")
    found = tried.fit(practice_venue(), TWO_PLACES).survey.fix_variance_m2
    assert found == pytest.approx(4.8**2 * 4 / 16 / 2)
    recording = practice_recording()
    noisy = PdrFingerprint(**SETTINGS).fit(recording.venue, (recording,)).survey
    assert 0.5 < noisy.fix_variance_m2 < 20.0
    begins = replace(tried, begin="fingerprint")
    track = follow(begins, walked(), heard((0.1, 0, -50)), start=None)
    assert track.variance_x_m2[0] == pytest.approx(found)


def test_fingerprints_are_not_tried_on_their_own_seconds():
    # In every other second each place sounds like the other, 4.8 m away.
    here, there = (-50, -90), (-90, -50)
    survey = surveyed((1.2, 0.0, EAST, here, there), (6.0, 0.0, EAST, there, here))
    tried = replace(MARK, fix_variance_m2=None, compared="heard")
    found = tried.fit(practice_venue(), survey).survey.fix_variance_m2
    assert found == pytest.approx(4.8**2 / 2)


def test_a_walking_survey_is_gathered_on_the_grid():
    recording = practice_recording()
    surveys = (replace(recording, walks=recording.walks[:1]),)
    fine = PdrFingerprint(**SETTINGS).fit(recording.venue, surveys).survey
    coarse = PdrFingerprint(cell_m=3.0, **SETTINGS).fit(recording.venue, surveys).survey
    # 32 m of way in cells of 0.6 m, and of 3 m.
    assert len(fine.maps.whole.radio_map) > 3 * len(coarse.maps.whole.radio_map) > 20


def test_beacons_the_survey_did_not_hear_are_no_harm():
    # Beacon 7 is heard now, but in no fingerprint: as strange to all of them.
    readings = heard((0.1, 0, -50), (0.2, 1, -90), (0.3, 7, -60))
    track = follow(MARK, walked((1, EAST)), readings)
    assert track.x_m[-1] == pytest.approx(0.6 + 4.5 / 8.5 * 0.6, abs=1e-6)
    only = heard((0.3, 7, -60))
    assert len(follow(replace(MARK, compared="heard"), walked((1, EAST)), only)) == 2


def test_what_it_needs_and_says():
    assert PdrFingerprint().needs == {Need.SURVEY, Need.IMU}
    assert MARK.needs == {Need.SURVEY, Need.STEPS, Need.START}
    rng = Draws(seed=1, purpose="test").generator()
    with pytest.raises(UsageError, match="call fit"):
        MARK.start(START, rng)
    with pytest.raises(UsageError, match="where the walk begins"):
        MARK.fit(practice_venue(), TWO_PLACES).start(None, rng)
    with pytest.raises(DataError, match="survey"):
        MARK.fit(practice_venue(), ())
    untold = surveyed((1.2, 0.0, math.nan, (-50, -90)), (1.2, 0.0, math.nan, (-50, -90)))
    with pytest.raises(DataError, match="which way the tester looked"):
        MARK.fit(practice_venue(), untold)
    assert replace(MARK, directions=0).fit(practice_venue(), untold).survey is not None


@pytest.mark.parametrize(
    "wrong",
    [{"begin": "anywhere"}, {"k": 0}, {"last": 0}, {"upper_m_s2": 0.5}, {"fix_variance_m2": 0.0}],
)
def test_bad_settings_are_refused(wrong):
    with pytest.raises(UsageError, match=next(iter(wrong))):
        PdrFingerprint(**wrong)


@pytest.mark.parametrize(
    "estimator",
    [
        replace(MARK, correction=True, still_s=0.3, near_m=20.0, every_reading=True),
        PdrFingerprint(directions=0, k=3, compared="heard", still_s=0.3, near_m=20.0),
    ],
)
def test_other_settings_keep_the_contract(estimator):
    check_estimator(estimator)
