import numpy as np
import pytest

from blesim.errors import DataError
from blesim.pdr.windows import StepWindows


def rows(windows):
    return [
        windows.values[first:end, 0].tolist()
        for first, end in zip(windows.first, windows.end, strict=True)
    ]


def test_windows_begin_with_the_moment_of_the_step_before():
    windows = StepWindows(columns=1, longest_s=10.0)
    time_us = np.arange(8) * 100
    told = windows.advance(time_us, time_us[:, None] * 1.0, np.array([300, 500]))
    assert rows(told) == [[0, 100, 200], [300, 400]]
    told = windows.advance(np.array([800]), np.array([[800.0]]), np.array([800]))
    assert rows(told) == [[500, 600, 700]]


def test_a_pause_is_cut_to_the_longest_window():
    windows = StepWindows(columns=1, longest_s=250e-6)
    for t in range(0, 2000, 100):
        windows.advance(np.array([t]), np.array([[float(t)]]), np.empty(0, np.int64))
    none = np.empty(0, np.int64)
    assert rows(windows.advance(none, np.empty((0, 1)), np.array([2000]))) == [[1800, 1900]]


def test_a_step_without_samples_of_its_own_has_the_latest():
    windows = StepWindows(columns=1, longest_s=1.0)
    told = windows.advance(np.array([0, 100]), np.array([[1.0], [2.0]]), np.array([100, 100, 150]))
    assert rows(told) == [[1], [1], [2]]
    assert rows(
        StepWindows(columns=1, longest_s=1.0).advance(
            np.array([5]), np.array([[1.0]]), np.array([5])
        )
    ) == [[]]


def test_disorder_is_refused():
    windows = StepWindows(columns=1, longest_s=1.0)
    none = np.empty(0, np.int64)
    windows.advance(np.array([100]), np.ones((1, 1)), np.array([100]))
    with pytest.raises(DataError, match="samples go back"):
        windows.advance(np.array([99]), np.ones((1, 1)), none)
    with pytest.raises(DataError, match="steps go back"):
        windows.advance(none, np.empty((0, 1)), np.array([99]))


def test_the_latest_sample_before_a_moment_outlasts_a_gap():
    # The moment of telling falls between two samples of the same time, long after the others.
    time_us, told_us = np.array([0, 9_000_000, 9_000_000]), np.array([9_000_000])
    none, values = np.empty(0, np.int64), np.array([[1.0], [2.0], [3.0]])
    whole = StepWindows(columns=1, longest_s=0.5).advance(time_us, values, told_us)
    live = StepWindows(columns=1, longest_s=0.5)
    live.advance(time_us[:2], values[:2], none)
    assert rows(live.advance(time_us[2:], values[2:], told_us)) == rows(whole) == [[1.0]]
