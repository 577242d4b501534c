import math

import numpy as np
import pytest

from blesim.errors import DataError
from blesim.pdr.dead_reckoning import DeadReckoning, StepErrors
from blesim.units import azimuth_to_heading

EXACT = StepErrors(length_share=0, heading_rad=0, scale=0, heading_bias_rad=0)


def covariance(reckoned):
    return np.array(
        [
            [reckoned.variance_x_m2[-1], reckoned.covariance_xy_m2[-1]],
            [reckoned.covariance_xy_m2[-1], reckoned.variance_y_m2[-1]],
        ]
    )


def test_equation_1_in_the_azimuth_of_the_paper():
    # Corridor azimuths 90, 180, 270 and 305 deg; X += SL sin alpha, Y += SL cos alpha.
    azimuth, length = np.radians([90, 180, 270, 305]), np.array([1.0, 2.0, 0.5, 0.7])
    walk = DeadReckoning(x_m=3.0, y_m=-1.0, errors=EXACT)
    reckoned = walk.advance(length, azimuth_to_heading(azimuth))
    np.testing.assert_allclose(reckoned.x_m, 3 + np.cumsum(length * np.sin(azimuth)), atol=1e-12)
    np.testing.assert_allclose(reckoned.y_m, -1 + np.cumsum(length * np.cos(azimuth)), atol=1e-12)
    assert not reckoned.variance_x_m2.any()


def test_variances_worked_by_hand():
    # Two steps of 2 m along x: independent 2 (0.1 * 2)^2 and 2 (0.2 * 2)^2, shared (0.05 * 4)^2
    # and (0.3 * 4)^2, start 0.5^2.
    errors = StepErrors(
        length_share=0.1, heading_rad=0.2, scale=0.05, heading_bias_rad=0.3, start_m=0.5
    )
    walk = DeadReckoning(x_m=0, y_m=0, errors=errors)
    reckoned = walk.advance(np.full(2, 2.0), np.zeros(2))
    assert reckoned.variance_x_m2[-1] == pytest.approx(0.08 + 0.04 + 0.25)
    assert reckoned.variance_y_m2[-1] == pytest.approx(0.32 + 1.44 + 0.25)
    assert reckoned.covariance_xy_m2[-1] == 0


def test_independent_errors_grow_with_the_root_of_the_way_and_shared_ones_with_the_way():
    def spread_m(steps, **given):
        errors = StepErrors(**{**EXACT.model_dump(), **given})
        reckoned = DeadReckoning(x_m=0, y_m=0, errors=errors).advance(
            np.full(steps, 0.7), np.full(steps, 0.4)
        )
        return math.sqrt(np.trace(covariance(reckoned)))

    assert spread_m(400, heading_rad=0.1) == pytest.approx(2 * spread_m(100, heading_rad=0.1))
    assert spread_m(400, heading_bias_rad=0.1) == pytest.approx(
        4 * spread_m(100, heading_bias_rad=0.1)
    )


@pytest.mark.parametrize(
    "given",
    [
        {"length_share": 0.08},
        {"heading_rad": 0.06},
        {"scale": 0.02},
        {"heading_bias_rad": 0.03},
        {"length_share": 0.08, "heading_rad": 0.06, "scale": 0.01, "heading_bias_rad": 0.01},
    ],
    ids=lambda given: ", ".join(given),
)
def test_the_covariance_is_that_of_many_walks(given):
    # 20 000 walks: a variance is known to 1 %, so 5 % is five standard errors; the neglected second
    # order is below 1 %.
    rng = np.random.default_rng(4)
    errors = StepErrors(**{**EXACT.model_dump(), **given})
    length, heading = np.full(40, 0.7), np.repeat([0.3, 1.1, 0.5, 0.9], 10)
    walks = 20_000
    lengths = length * (1 + errors.length_share * rng.normal(size=(walks, 40)))
    lengths *= 1 + errors.scale * rng.normal(size=(walks, 1))
    headings = heading + errors.heading_rad * rng.normal(size=(walks, 40))
    headings += errors.heading_bias_rad * rng.normal(size=(walks, 1))
    ends = [(lengths * np.cos(headings)).sum(axis=1), (lengths * np.sin(headings)).sum(axis=1)]
    told = covariance(DeadReckoning(x_m=0, y_m=0, errors=errors).advance(length, heading))
    size = np.sqrt(np.outer(np.diag(told), np.diag(told)))
    np.testing.assert_allclose(np.cov(ends) / size, told / size, rtol=0, atol=0.05)


def test_a_round_walk_forgets_a_shared_bias():
    # Back at the start, a turned or scaled map of the walk has its end there as well.
    errors = StepErrors(**{**EXACT.model_dump(), "scale": 0.1, "heading_bias_rad": 0.3})
    walk = DeadReckoning(x_m=5, y_m=5, errors=errors)
    reckoned = walk.advance(np.ones(4), np.radians([0.0, 90, 180, 270]))
    np.testing.assert_allclose(covariance(reckoned), 0, atol=1e-24)
    assert reckoned.variance_x_m2[1] > 0.05


def test_faults_are_refused():
    walk = DeadReckoning(x_m=0, y_m=0, errors=EXACT)
    with pytest.raises(DataError, match="2 lengths for 1 headings"):
        walk.advance(np.ones(2), np.ones(1))
    with pytest.raises(DataError, match="no heading"):
        walk.advance(np.ones(1), np.array([np.nan]))
    assert len(walk.advance(np.empty(0), np.empty(0))) == 0
