import numpy as np

from blesim.imu.trigonometry import sine_cosine


def test_agrees_with_the_library_over_many_turns():
    angles = np.linspace(-60.0, 60.0, 40_001)
    pairs = np.array([sine_cosine(angle) for angle in angles])
    assert np.abs(pairs[:, 0] - np.sin(angles)).max() < 1e-13
    assert np.abs(pairs[:, 1] - np.cos(angles)).max() < 1e-13
