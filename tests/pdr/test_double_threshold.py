import numpy as np
import pytest
from pydantic import ValidationError

from blesim.pdr.double_threshold import DoubleThreshold, DoubleThresholdDetector

TENTH_US = 100_000


def steps_in(signal, **settings):
    detector = DoubleThresholdDetector(
        DoubleThreshold(**{"lower_m_s2": 1.0, "upper_m_s2": 5.0, "interval_s": 0.0} | settings)
    )
    found = detector.advance(np.arange(len(signal)) * TENTH_US, np.array(signal, float))
    assert len(detector.finish()) == 0
    return [
        (int(t) // TENTH_US, float(p), float(v))
        for t, p, v in zip(found.time_us, found.peak_m_s2, found.valley_m_s2, strict=True)
    ]


def test_a_step_is_a_rise_above_the_lower_that_stays_below_the_upper_threshold():
    assert steps_in([0, 2, 3, 2, 0, -1, 4, 0]) == [(2, 3, 0), (6, 4, -1)]
    assert steps_in([0, 0.9, 0]) == []
    assert steps_in([0, 2, 6, 2, 0]) == []


def test_the_thresholds_themselves_belong_to_the_band():
    assert steps_in([0, 1, 0]) == [(1, 1, 0)]
    assert steps_in([0, 5, 0]) == [(1, 5, 0)]


def test_a_rise_that_has_not_fallen_back_is_no_step():
    assert steps_in([0, 2, 3]) == []


def test_a_ripple_within_the_interval_is_no_step():
    ripple = [0, 2, 0.9, 2, 0, 0, 2, 0]
    assert [time for time, _, _ in steps_in(ripple)] == [1, 3, 6]
    assert [time for time, _, _ in steps_in(ripple, interval_s=0.3)] == [1, 6]
    # From peak to peak, and the interval itself is enough.
    assert [time for time, _, _ in steps_in(ripple, interval_s=0.2)] == [1, 3, 6]


def test_thresholds_out_of_order_are_refused():
    with pytest.raises(ValidationError, match="below lower"):
        DoubleThreshold(lower_m_s2=3.0, upper_m_s2=2.0)
