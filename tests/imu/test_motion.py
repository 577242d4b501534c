import numpy as np
import pytest

from blesim.imu.motion import BODY, WINDOW_S, body_at, stretches

SQUARE = [(0, 0), (8, 0), (8, 6), (0, 6), (0, 0)]


def bodies(trajectory, time_s):
    rows, out = stretches(trajectory), np.empty((len(time_s), BODY))
    early = late = 0
    for index, time in enumerate(time_s):
        early, late = body_at(time, rows, early, late, out[index])
    return out


@pytest.fixture(scope="module")
def square(route):
    trajectory = route(SQUARE, speed_m_s=1.25)
    step_s = 0.002
    time_s = np.arange(0.0, trajectory.time_us[-1] * 1e-6, step_s)
    return trajectory, step_s, bodies(trajectory, time_s)


def test_angular_rate_adds_up_to_the_turns(square):
    _, step_s, body = square
    # Three left turns; the sum of a thousandth-second grid is good to a thousandth.
    assert body[:, 1].sum() * step_s == pytest.approx(1.5 * np.pi, abs=2e-3)
    assert body[-1, 0] - body[0, 0] == pytest.approx(1.5 * np.pi, abs=1e-6)


def test_acceleration_adds_up_to_the_changes_of_velocity(square):
    trajectory, step_s, body = square
    velocity = np.cumsum(body[:, 2:4], axis=0) * step_s
    middle = int((trajectory.time_us[2] - 2e6) * 1e-6 / step_s)
    assert velocity[middle] == pytest.approx([1.25, 0.0], abs=0.01)
    assert velocity[-1] == pytest.approx([0.0, 0.0], abs=0.01)


def test_speed_adds_up_to_the_way(square):
    _, step_s, body = square
    assert body[:, 4].sum() * step_s == pytest.approx(28.0, abs=0.01)


def test_heading_is_that_of_the_walk_away_from_turns(route):
    trajectory = route(SQUARE)
    times_us = np.array([2.0, 8.0, 16.0, 21.0]) * 1e6
    far = [t for t in times_us if np.abs(trajectory.time_us - t).min() > WINDOW_S * 1e6]
    assert len(far) >= 3
    body = bodies(trajectory, np.array(far) * 1e-6)
    wanted = trajectory.at(np.array(far).astype(int)).heading_rad
    assert np.cos(body[:, 0] - wanted) == pytest.approx(1.0, abs=1e-12)


def test_a_body_brakes_as_its_walk_does(route):
    plain = route([(0, 0), (5, 0)], speed_m_s=1.0, rest_s=0)
    braking = type(plain)(
        **{
            column.field: getattr(plain, column.field)
            for column in plain.STREAM.columns
            if column.field not in ("speed_m_s", "acceleration_m_s2", "time_us")
        },
        time_us=np.array([0, 10_000_000, 10_000_000]),
        speed_m_s=np.array([1.0, 0.0, 0.0]),
        acceleration_m_s2=np.array([-0.1, 0.0, 0.0]),
    )
    body = bodies(braking, np.array([2.0, 5.0, 8.0]))
    assert body[:, 2] == pytest.approx([-0.1] * 3)
    assert body[:, 4] == pytest.approx([0.8, 0.5, 0.2])
