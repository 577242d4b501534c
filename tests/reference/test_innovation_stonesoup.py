"""The normalised innovation squared against Stone Soup's squared Mahalanobis distance."""

import numpy as np
from stonesoup.measures import SquaredMahalanobis
from stonesoup.types.state import GaussianState, State

from blesim.filters.gating import squared_innovation


def test_the_squared_innovation_is_a_squared_mahalanobis_distance() -> None:
    rng = np.random.default_rng(4)
    for size in range(1, 7):
        root = rng.normal(0, 1, (size, size))
        covariance = root @ root.T + 0.1 * np.eye(size)
        innovation = rng.normal(0, 2, size)
        predicted = GaussianState(np.zeros((size, 1)), covariance)
        theirs = SquaredMahalanobis()(predicted, State(innovation[:, None]))
        ours = squared_innovation(innovation, covariance)
        np.testing.assert_allclose(ours, theirs, rtol=1e-9)
