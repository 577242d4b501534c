import numpy as np
import pytest
from scipy import stats

from blesim.errors import DataError
from blesim.filters.gating import (
    JointGate,
    SeparateGate,
    chi_square_limit,
    squared_innovation,
)

COVARIANCE = np.array([[4.0, 1.0], [1.0, 2.0]])


def test_the_squared_innovation_worked_by_hand() -> None:
    # The inverse of [[4, 1], [1, 2]] is [[2, -1], [-1, 4]] / 7: (2*1 - 2*1*2 + 4*4) / 7.
    assert squared_innovation(np.array([1.0, 2.0]), COVARIANCE) == pytest.approx(14 / 7)
    assert squared_innovation(np.empty(0), np.empty((0, 0))) == 0.0


def test_the_limits_are_those_of_the_tables() -> None:
    # Critical values of chi-squared as printed everywhere.
    assert chi_square_limit(0.95, 1) == pytest.approx(3.841, abs=5e-4)
    assert chi_square_limit(0.99, 2) == pytest.approx(9.210, abs=5e-4)
    assert chi_square_limit(0.99, 6) == pytest.approx(16.812, abs=5e-4)
    assert SeparateGate(confidence=0.95).deviations == pytest.approx(1.95996, abs=5e-6)


def test_true_innovations_pass_as_often_as_asked() -> None:
    # False-alarm rate 1e-6 for each of the two counts.
    rng = np.random.default_rng(6)
    drawn = rng.multivariate_normal(np.zeros(2), COVARIANCE, 5000)
    joint, separate = JointGate(confidence=0.9), SeparateGate(confidence=0.8)
    passed = sum(joint.passes(innovation, COVARIANCE) for innovation in drawn)
    assert stats.binomtest(passed, 5000, 0.9).pvalue > 1e-6
    first = sum(bool(separate.passes(innovation, COVARIANCE)[0]) for innovation in drawn)
    assert stats.binomtest(first, 5000, 0.8).pvalue > 1e-6


def test_one_outlier_fails_alone() -> None:
    innovation = np.array([0.5, 9.0, -1.9])
    variance = np.array([1.0, 4.0, 1.0])
    gate = SeparateGate(confidence=0.95)
    assert gate.passes(innovation, variance).tolist() == [True, False, True]
    assert gate.passes(innovation, np.diag(variance)).tolist() == [True, False, True]
    assert not JointGate(confidence=0.95).passes(innovation, np.diag(variance))


def test_a_measurement_that_is_not_there_does_not_pass() -> None:
    assert SeparateGate().passes(np.array([np.nan]), np.ones(1)).tolist() == [False]
    assert JointGate().passes(np.empty(0), np.empty((0, 0)))


def test_full_confidence_lets_everything_pass() -> None:
    innovation = np.array([1e6, -1e6])
    assert SeparateGate(confidence=1).passes(innovation, COVARIANCE).all()
    assert JointGate(confidence=1).passes(innovation, COVARIANCE)


def test_bad_input_is_refused() -> None:
    with pytest.raises(DataError, match="singular"):
        squared_innovation(np.ones(2), np.ones((2, 2)))
    with pytest.raises(ValueError, match="shapes"):
        squared_innovation(np.ones(3), COVARIANCE)
    with pytest.raises(ValueError, match="greater than 0"):
        JointGate(confidence=0)
