import numpy as np

from blesim.radio.waves import add_waves, cosine


def test_cosine_is_within_its_stated_error():
    turns = np.concatenate([np.linspace(-2, 2, 4001), [1e6 + 0.3, -1e6 - 0.3]])
    error = [cosine(t) - np.cos(2 * np.pi * t) for t in turns]
    assert np.abs(error).max() < 4e-9


def test_sum_of_waves_is_the_sum_of_cosines():
    generator = np.random.default_rng(5)
    x_m, y_m = generator.uniform(0, 30, (2, 500))
    waves = generator.normal(size=(7, 3))
    out = np.full(500, 2.0)
    add_waves(x_m, y_m, waves, 1.5, out)
    turns = np.outer(waves[:, 0], x_m) + np.outer(waves[:, 1], y_m) + waves[:, 2:]
    assert np.allclose(out, 2.0 + 1.5 * np.cos(2 * np.pi * turns).sum(axis=0), atol=1e-6)
