from dataclasses import FrozenInstanceError, dataclass, field

import numpy as np
import pytest

from blesim.columns import NO_EDGE
from blesim.errors import DataError
from blesim.estimators.base import fitted, make_track


@dataclass(frozen=True, slots=True, kw_only=True)
class Learner:
    window_s: float = 2.0
    learned: object = field(default=None, init=False)


def test_fitted_is_a_frozen_copy():
    learner = Learner(window_s=5.0)
    other = fitted(learner, learned=(1, 2))
    assert (other.window_s, other.learned) == (5.0, (1, 2))
    assert learner.learned is None
    with pytest.raises(FrozenInstanceError):
        other.learned = 3


@pytest.mark.parametrize("name", ["window_s", "unknown"])
def test_fitted_sets_only_what_is_learned(name):
    with pytest.raises(TypeError, match=name):
        fitted(Learner(), **{name: 1})


def test_a_single_value_stands_for_all_estimates():
    track = make_track(
        time_us=[1, 2], x_m=[3.0, 4.0], y_m=5.0, variance_x_m2=1.0, variance_y_m2=2.0
    )
    assert track.y_m.tolist() == [5.0, 5.0]
    assert track.edge.tolist() == [NO_EDGE, NO_EDGE]
    assert np.all(np.isnan(track.offset_m))
    assert track.covariance_xy_m2.tolist() == [0.0, 0.0]


def test_a_track_may_hold_a_single_estimate_or_none():
    one = make_track(time_us=7, x_m=1.0, y_m=2.0, variance_x_m2=1.0, variance_y_m2=1.0)
    assert one.time_us.tolist() == [7]
    assert len(make_track(time_us=[], x_m=[], y_m=[], variance_x_m2=1.0, variance_y_m2=1.0)) == 0


def test_columns_of_different_length_are_refused():
    with pytest.raises(DataError, match="different length"):
        make_track(time_us=[1, 2], x_m=[1.0], y_m=0.0, variance_x_m2=1.0, variance_y_m2=1.0)
