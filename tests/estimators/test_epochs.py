"""Epochs: when a state is updated and told, with a system behind that is easy to follow."""

import numpy as np
import pytest

from blesim.errors import UsageError
from blesim.estimators.constant_velocity import Belief, at_rest
from blesim.estimators.epochs import EpochSettings, EpochTracker
from blesim.recording import Observations
from blesim.tables import Readings


class Loudest:
    """Place x = smoothed RSSI of the loudest beacon, velocity 1 m/s along x, told as it is."""

    def __init__(self):
        self.seen = []

    def found(self, signal_dbm):
        self.seen.append(("found", signal_dbm.tolist()))
        if np.all(np.isnan(signal_dbm)):
            return None
        rest = at_rest(np.array([np.nanmax(signal_dbm), 0.0]), np.eye(2), 2.0, 0)
        mean = rest.mean + np.array([0.0, 0.0, 1.0, 0.0])
        return Belief(mean=mean, covariance=rest.covariance, level=0)

    def updated(self, last, predicted, signal_dbm):  # noqa: ARG002 (the protocol names it)
        self.seen.append(("updated", signal_dbm.tolist()))
        return predicted


def readings_of(*rows):
    time_us, beacon, rssi_dbm = np.array(rows, np.int64).reshape(-1, 3).T
    return Readings(time_us=time_us, beacon=beacon, rssi_dbm=rssi_dbm, channel=np.zeros(len(rows)))


def follow(*rows, known=(True, True), **settings):
    measured = Loudest()
    tracker = EpochTracker(EpochSettings(**settings), np.array(known), measured)
    return tracker.advance(Observations(readings=readings_of(*rows))), measured, tracker


SECOND = 1_000_000


def test_an_epoch_ends_with_the_first_reading_of_a_later_one():
    rows = [(SECOND, 0, -60), (1_999_999, 1, -70), (2 * SECOND, 0, -90), (2_500_000, 1, -90)]
    track, measured, _ = follow(*rows)
    assert track.time_us.tolist() == [2 * SECOND]
    assert measured.seen == [("found", [-60.0, -70.0])]


def test_the_state_is_told_as_moved_on_to_the_reading():
    # Found at the end of the epoch, 2 s, at x = -60 with 1 m/s; told at 2.5 s.
    track, _, _ = follow((SECOND, 0, -60), (2_500_000, 0, -60))
    assert track.x_m.tolist() == [-59.5]
    # 1 + 0.5^2 times the variance 4 of the velocity.
    assert track.variance_x_m2.tolist() == [2.0]


def test_every_reading_is_told_if_asked():
    rows = [(0, 0, -60), (SECOND, 0, -60), (1_200_000, 0, -60), (2_100_000, 0, -60)]
    assert follow(*rows)[0].time_us.tolist() == [SECOND, 2_100_000]
    track, _, _ = follow(*rows, every_reading=True)
    assert track.time_us.tolist() == [SECOND, 1_200_000, 2_100_000]
    np.testing.assert_allclose(track.x_m, [-60.0, -59.8, -58.9])


def test_epochs_without_readings_are_passed_over():
    track, measured, tracker = follow((0, 0, -60), (3_500_000, 0, -60), (4 * SECOND, 0, -60))
    assert [kind for kind, _ in measured.seen] == ["found", "updated"]
    assert track.time_us.tolist() == [3_500_000, 4 * SECOND]
    # Found at 1 s, moved on to 4 s.
    assert tracker.belief.mean[0] == -57.0


def test_a_long_silence_gives_up_the_state():
    rows = [(0, 0, -60), (SECOND, 0, -60), (7 * SECOND, 0, -50), (8 * SECOND, 0, -50)]
    track, measured, _ = follow(*rows, silence_s=6.0)
    assert track.time_us.tolist() == [SECOND, 8 * SECOND]
    assert [kind for kind, _ in measured.seen] == ["found", "found"]
    track, measured, _ = follow(*rows, silence_s=6.001)
    assert [kind for kind, _ in measured.seen] == ["found", "updated", "updated"]


def test_the_window_forgets_beacons():
    rows = [(0, 0, -60), (SECOND, 1, -70), (2 * SECOND, 1, -70)]
    assert str(follow(*rows)[1].seen[-1][1]) == "[-60.0, -70.0]"
    assert str(follow(*rows, window_s=1.5)[1].seen[-1][1]) == "[nan, -70.0]"


def test_smoothing_is_a_setting():
    rows = [(0, 0, -60), (1, 0, -70), (2, 0, -50), (SECOND, 0, -50)]
    seen = {
        kind: follow(*rows, smoothing=kind, last=2, rate=0.5)[1].seen[0][1][0]
        for kind in ("moving", "exponential", "averaged", "highest")
    }
    # (-70 - 50) / 2; -60, -65, -57.5 twice over; the highest.
    assert seen == {"moving": -60.0, "exponential": -57.5, "averaged": -57.5, "highest": -50.0}


def test_readings_of_unknown_beacons_are_skipped():
    rows = [(0, 0, -60), (100, 1, -20), (200, 7, -20), (SECOND, 1, -20), (2 * SECOND, 0, -60)]
    track, measured, _ = follow(*rows, known=(True, False))
    assert track.time_us.tolist() == [2 * SECOND]
    assert measured.seen[0][1][0] == -60.0
    assert np.isnan(measured.seen[0][1][1])


def test_no_readings_give_no_track():
    track, measured, tracker = follow()
    assert len(track) == 0
    assert measured.seen == []
    assert tracker.belief is None


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("epoch_s", 0.0),
        ("silence_s", -1.0),
        ("velocity_change_m_s", 0.0),
        ("start_speed_m_s", 1e9),
        ("last", 0),
        ("rate", 0.0),
        ("window_s", 0.0),
    ],
)
def test_bad_settings_are_refused(name, value):
    with pytest.raises(UsageError, match=name):
        EpochSettings(**{name: value})
    with pytest.raises(UsageError, match="kind"):
        EpochSettings(smoothing="none")
