import math

import numpy as np
import pytest

from blesim.errors import DataError
from blesim.pdr.features import StepFeatureReader, StepFelt


def test_features_worked_by_hand():
    # Steps told at 0.4 and 0.8 s: samples 1, -3, 5, 1 and 2, 2, -2, 2 lie before them.
    time_us = np.arange(9) * 100_000
    signal = np.array([1, -3, 5, 1, 2, 2, -2, 2, 9], float)
    reader = StepFeatureReader(StepFelt(smoothing_s=0.1 / math.log(2)))
    step_us = np.array([200_000, 700_000])
    felt = reader.advance(time_us, signal, step_us, np.array([400_000, 800_000]))
    assert felt.period_s.tolist() == pytest.approx([0.57, 0.5])
    assert felt.frequency_hz[1] == pytest.approx(2.0)
    # Means 1 and 1: (0 + 16 + 16 + 0) / 4 and (1 + 1 + 9 + 1) / 4.
    assert felt.variance_m2_s4.tolist() == [8.0, 3.0]
    assert felt.highest_m_s2.tolist() == [5.0, 2.0]
    assert felt.lowest_m_s2.tolist() == [-3.0, -2.0]
    assert felt.mean_absolute_m_s2.tolist() == [2.5, 2.0]
    # Half of each new sample: 1, -1, 2, 1.5 | 1.75, 1.875, -0.0625, 0.96875.
    assert felt.smoothed_peak_m_s2.tolist() == pytest.approx([2.0, 1.875])


def test_a_pause_has_the_usual_period_and_a_stumble_the_shortest():
    reader = StepFeatureReader(StepFelt(longest_s=1.5, shortest_s=0.2, usual_s=0.6))
    steps = np.array([1.0, 1.5, 3.0, 4.6, 4.7]) * 1e6
    felt = reader.advance(np.array([0]), np.zeros(1), steps.astype(int), steps.astype(int))
    assert felt.period_s.tolist() == pytest.approx([0.6, 0.5, 1.5, 0.6, 0.2])


def test_a_step_before_the_first_sample_felt_nothing():
    felt = StepFeatureReader(StepFelt()).advance(
        np.array([10]), np.array([3.0]), np.array([5]), np.array([10])
    )
    assert felt.highest_m_s2[0] == felt.variance_m2_s4[0] == felt.mean_absolute_m_s2[0] == 0
    assert len(felt) == 1


def test_faults_are_refused():
    reader = StepFeatureReader(StepFelt())
    none = np.empty(0, np.int64)
    with pytest.raises(DataError, match="not a number"):
        reader.advance(np.array([0]), np.array([np.nan]), none, none)
    with pytest.raises(ValueError, match="usual_s"):
        StepFelt(usual_s=2.0)
