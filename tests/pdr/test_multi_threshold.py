"""Hand-worked sequences, a sample every 0.1 s, for each clause of Eq 2 to 5."""

import numpy as np
import pytest

from blesim.pdr.multi_threshold import MultiThreshold, MultiThresholdDetector

TENTH_US = 100_000


def steps_in(signal, interval_s=0.2, amplitude_m_s2=1.0):
    """(time of the peak in tenths of a second, peak, valley) of each step."""
    settings = MultiThreshold(amplitude_m_s2=amplitude_m_s2, interval_s=interval_s)
    detector = MultiThresholdDetector(settings)
    time_us = np.arange(len(signal)) * TENTH_US
    parts = (detector.advance(time_us, np.array(signal, float)), detector.finish())
    return [
        (int(t) // TENTH_US, float(p), float(v))
        for part in parts
        for t, p, v in zip(part.time_us, part.peak_m_s2, part.valley_m_s2, strict=True)
    ]


def test_a_step_is_a_peak_and_its_valley():
    assert steps_in([0, 2, 0, -2, 0, 3, 0, -4, 0]) == [(1, 2, -2), (5, 3, -4)]


def test_peaks_come_first():
    assert steps_in([0, -2, 0, 2, 0, -3, 0]) == [(3, 2, -3)]


def test_of_peaks_without_a_valley_between_the_highest_counts():
    assert steps_in([0, 2, 1, 3, 0, -2, 0]) == [(3, 3, -2)]
    assert steps_in([0, 3, 1, 2, 0, -2, 0]) == [(1, 3, -2)]


def test_of_valleys_the_lowest_counts():
    assert steps_in([0, 2, 0, -2, -1, -3, 0]) == [(1, 2, -3)]
    assert steps_in([0, 2, 0, -3, -1, -2, 0]) == [(1, 2, -3)]


def test_the_amplitude_itself_is_enough_and_less_is_not():
    assert steps_in([0, 1, 0, -1, 0]) == [(1, 1, -1)]
    assert steps_in([0, 0.99, 0, -2, 0]) == []
    assert steps_in([0, 2, 0, -0.99, 0]) == []


def test_steps_closer_than_the_interval_are_refused():
    quick = [0, 2, -2, 2, -2, 2, -2, 0]
    assert [time for time, _, _ in steps_in(quick, interval_s=0.2)] == [1, 3, 5]
    # No valley half an interval after its peak, so that one step takes what is left.
    assert steps_in(quick, interval_s=0.201) == [(1, 2, -2)]


def test_a_peak_comes_half_an_interval_after_the_valley():
    late_valley = [0, 2, 0, 0.5, 0, -2, 3, 0, -2, 0]
    assert [time for time, _, _ in steps_in(late_valley, interval_s=0.2)] == [1, 6]
    assert [time for time, _, _ in steps_in(late_valley, interval_s=0.22)] == [1]


@pytest.mark.parametrize(
    ("samples_after", "found"), [(1, False), (2, True), (3, True), (12, True), (13, False)]
)
def test_a_valley_comes_between_half_an_interval_and_three_after_the_peak(samples_after, found):
    signal = np.zeros(20)
    signal[2], signal[2 + samples_after] = 2, -2
    assert len(steps_in(signal, interval_s=0.4)) == found


def test_a_peak_that_waits_in_vain_does_not_stop_the_next():
    assert steps_in([0, 9] + [0] * 8 + [2, 0, -2, 0], interval_s=0.2) == [(10, 2, -2)]


def test_equal_samples_are_one_extremum_at_the_first_of_them():
    assert steps_in([0, 2, 2, 0, -2, -2, 0]) == [(1, 2, -2)]
    # A landing on the way up is none.
    assert steps_in([0, 2, 2, 3, 0, -2, 0]) == [(3, 3, -2)]


@pytest.mark.parametrize("interval_s", [0.0, 0.01])
def test_no_steps_where_no_valley_fits(interval_s):
    # Table 1 of the digest "map-heading-ekf": none found at 0 or 0.01 s.
    time_s = np.arange(0, 20, 0.02)
    detector = MultiThresholdDetector(MultiThreshold(interval_s=interval_s))
    found = detector.advance((time_s * 1e6).astype(int), 4 * np.sin(2 * np.pi * 1.8 * time_s))
    assert len(found) == 0
    assert len(detector.finish()) == 0


def test_a_step_is_told_when_the_next_peak_comes_or_none_can_come():
    detector = MultiThresholdDetector(MultiThreshold(interval_s=0.2))
    time_us = np.arange(30) * TENTH_US
    signal = np.zeros(30)
    signal[[1, 5, 20]], signal[[3, 7]] = 2, -2
    found = detector.advance(time_us, signal)
    # A maximum is known a sample later. Level since 0.8 s, the signal may bring a valley of the
    # second peak until it leaves that level.
    assert (found.time_us // TENTH_US).tolist() == [1, 5]
    assert (found.told_us // TENTH_US).tolist() == [6, 20]
