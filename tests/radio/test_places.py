import numpy as np
import pytest

from blesim.radio.places import fill_steps, places
from blesim.tables import Trajectory


def walk_of(generator, *, speeding):
    count = 40
    accelerations = generator.uniform(-0.1, 1, count) * (generator.random(count) < 0.6)
    return Trajectory(
        time_us=np.cumsum(generator.integers(1, 10**6, count)),
        x_m=generator.uniform(0, 30, count),
        y_m=generator.uniform(0, 30, count),
        level=np.zeros(count, int),
        heading_rad=generator.uniform(-3.1, 3.1, count),
        speed_m_s=generator.uniform(0, 2, count),
        acceleration_m_s2=accelerations if speeding else np.zeros(count),
        edge=np.full(count, -1),
        offset_m=np.full(count, np.nan),
        edge_speed_m_s=np.full(count, np.nan),
        state=np.ones(count, int),
    )


@pytest.mark.parametrize("speeding", [False, True])
def test_places_are_those_of_the_trajectory(speeding):
    generator = np.random.default_rng(4)
    trajectory = walk_of(generator, speeding=speeding)
    one = np.sort(generator.integers(trajectory.time_us[0], trajectory.time_us[-1] + 1, 500))
    # Three stretches, each ascending, as the packets of three channels are.
    time_us = np.concatenate([one, one + 0, one[100:]])
    found = places(trajectory, time_us, np.empty((0, 2)), 100_000)
    poses = trajectory.at(time_us)
    assert np.allclose(found.x_m, poses.x_m, atol=1e-9)
    assert np.allclose(found.y_m, poses.y_m, atol=1e-9)
    assert np.allclose(found.cos_heading, np.cos(poses.heading_rad), atol=1e-7)
    assert np.allclose(found.sin_heading, np.sin(poses.heading_rad), atol=1e-7)


@pytest.mark.parametrize("speeding", [False, True])
def test_steps_are_those_of_the_trajectory_while_it_lasts(speeding):
    trajectory = walk_of(np.random.default_rng(4), speeding=speeding)
    step_us = 500_000
    first, last = trajectory.time_us[[0, -1]] // step_us
    x_m, y_m = np.full((2, last + 5), np.nan)
    fill_steps(trajectory, 0, step_us, x_m, y_m)
    there = np.flatnonzero(~np.isnan(x_m))
    assert there.tolist() == list(range(first, last + 1))
    middles_us = np.clip(there * step_us + step_us // 2, *trajectory.time_us[[0, -1]])
    poses = trajectory.at(middles_us)
    assert np.array_equal(x_m[there], poses.x_m)
    assert np.array_equal(y_m[there], poses.y_m)
    parts = np.full((2, 7), np.nan)
    fill_steps(trajectory, first + 3, step_us, *parts)
    assert np.array_equal(parts[0], x_m[first + 3 : first + 10])
