from dataclasses import astuple

import numpy as np
import pytest
from scipy.optimize import minimize

from blesim.errors import DataError, UsageError
from blesim.pdr.features import StepFeatures
from blesim.pdr.step_length import (
    FixedLength,
    FrequencyVariance,
    Kim,
    KnownWalk,
    PeriodPeak,
    Weinberg,
    fit_step_length,
)

MODELS = (FixedLength(), FrequencyVariance(), PeriodPeak(), Weinberg(), Kim())


def features(period=0.5, variance=4.0, peak=5.0, highest=9.0, lowest=-7.0, mean=8.0, steps=1):
    columns = [np.broadcast_to(np.float64(v), steps) for v in (period, variance, peak)]
    extremes = [np.broadcast_to(np.float64(v), steps) for v in (highest, lowest, mean)]
    return StepFeatures(
        period_s=columns[0],
        variance_m2_s4=columns[1],
        smoothed_peak_m_s2=columns[2],
        highest_m_s2=extremes[0],
        lowest_m_s2=extremes[1],
        mean_absolute_m_s2=extremes[2],
    )


def random_features(rng, steps):
    pace = rng.uniform(0.45, 0.75)
    effort = rng.uniform(2, 7)
    return features(
        period=rng.normal(pace, 0.03, steps),
        variance=effort**2 / 2 + rng.normal(0, 0.5, steps) ** 2,
        peak=effort + rng.normal(0, 0.3, steps),
        highest=effort + rng.normal(0, 0.3, steps),
        lowest=-effort + rng.normal(0, 0.3, steps),
        mean=effort * 2 / np.pi + rng.normal(0, 0.1, steps),
        steps=steps,
    )


@pytest.mark.parametrize(
    ("model", "length_m"),
    [
        (FixedLength(step_m=0.6), 0.6),
        # 0.1 + 0.2 * 2 Hz + 0.01 * 4 (Eq 6).
        (FrequencyVariance(base_m=0.1, per_hz_m=0.2, per_m2_s4_m=0.01), 0.54),
        # 0.7 - 0.8 * 0.5 s + 0.068 * 5 (Eq 7).
        (PeriodPeak(base_m=0.7, per_s_m=-0.8, per_m_s2_m=0.068), 0.64),
        # The fourth root of 9 + 7 is 2 (Eq 8).
        (Weinberg(), 0.85),
        # The cube root of 8 is 2.
        (Kim(k=0.3), 0.6),
    ],
)
def test_lengths_worked_by_hand(model, length_m):
    assert model.length_m(features())[0] == pytest.approx(length_m, rel=1e-12)


@pytest.mark.parametrize("model", MODELS, ids=lambda model: type(model).__name__)
@pytest.mark.parametrize(("rate_hz", "range_m_s2"), [(1.65, 4.7), (1.82, 12.8)])
def test_defaults_walk_like_recorded_phones(model, rate_hz, range_m_s2):
    # Of two sets of recordings, taken for sines; their steps were 0.55 to 0.75 m long.
    amplitude = range_m_s2 / 2
    felt = features(
        period=1 / rate_hz,
        variance=amplitude**2 / 2,
        peak=amplitude,
        highest=amplitude,
        lowest=-amplitude,
        mean=amplitude * 2 / np.pi,
    )
    assert 0.45 <= model.length_m(felt)[0] <= 0.85


def test_lengths_stay_within_what_a_recording_may_tell():
    model = PeriodPeak(base_m=0.0, per_s_m=1.0, per_m_s2_m=0.0)
    assert model.length_m(features(period=np.array([-1.0, 9.0]), steps=2)).tolist() == [0.0, 3.0]


@pytest.mark.parametrize("model", MODELS, ids=lambda model: type(model).__name__)
def test_the_fit_finds_the_coefficients_that_made_the_walks(model):
    rng = np.random.default_rng(3)
    true = type(model)(
        **dict(zip(model.__dataclass_fields__, np.array(model.coefficients) * 1.1, strict=True))
    )
    felt = [random_features(rng, steps) for steps in (60, 110, 65, 60, 125, 316, 270)]
    walks = [KnownWalk(features=f, distance_m=float(true.length_m(f).sum())) for f in felt]
    fitted = fit_step_length(model, walks)
    assert astuple(fitted) == pytest.approx(astuple(true), rel=1e-6)
    assert fitted is not model


def test_the_fit_of_noisy_walks_is_the_least_squares_of_the_distances():
    # Real distances of table 2; an independent minimiser must find no better coefficients.
    rng = np.random.default_rng(5)
    distances = (40.5, 71.4, 43.2, 39.5, 81.6, 211.68, 179.0)
    walks = [
        KnownWalk(features=random_features(rng, round(d / 0.62)), distance_m=d) for d in distances
    ]

    def misfit(coefficients):
        model = PeriodPeak(
            base_m=coefficients[0], per_s_m=coefficients[1], per_m_s2_m=coefficients[2]
        )
        return sum((model.length_m(w.features).sum() - w.distance_m) ** 2 for w in walks)

    fitted = fit_step_length(PeriodPeak(), walks)
    best = minimize(
        misfit,
        [0.6, 0.0, 0.0],
        method="Nelder-Mead",
        options={"xatol": 1e-9, "fatol": 1e-12, "maxiter": 5000},
    )
    assert misfit(fitted.coefficients) <= best.fun * (1 + 1e-9)
    assert fitted.coefficients == pytest.approx(best.x, rel=1e-4)


def test_weinberg_fit_worked_by_hand():
    # Sums of fourth roots 2 * 10 and 2 * 20; K = (20 * 9 + 40 * 17) / (20^2 + 40^2) = 0.43.
    walks = [
        KnownWalk(features=features(steps=10), distance_m=9.0),
        KnownWalk(features=features(steps=20), distance_m=17.0),
    ]
    assert fit_step_length(Weinberg(), walks).k == pytest.approx(0.43, rel=1e-12)


def test_what_the_walks_cannot_tell_is_refused_or_held_by_the_ridge():
    same_pace = [
        KnownWalk(features=features(steps=n), distance_m=0.7 * n) for n in (50, 60, 70, 80)
    ]
    with pytest.raises(DataError, match="several paces, or fit with a ridge"):
        fit_step_length(PeriodPeak(), same_pace)
    with pytest.raises(DataError, match=r"1 walks .* 3 coefficients of PeriodPeak"):
        fit_step_length(PeriodPeak(), same_pace[:1])
    held = fit_step_length(PeriodPeak(), same_pace, ridge=1e-6)
    assert held.length_m(features())[0] == pytest.approx(0.7, rel=1e-5)
    stiff = fit_step_length(PeriodPeak(), same_pace, ridge=1e12)
    assert stiff.coefficients == pytest.approx(PeriodPeak().coefficients, rel=1e-6)
    still = KnownWalk(features=features(highest=0.0, lowest=0.0), distance_m=1.0)
    with pytest.raises(DataError, match="Weinberg"):
        fit_step_length(Weinberg(), [still])


def test_faults_are_refused():
    with pytest.raises(DataError, match="no walk of known length"):
        fit_step_length(Weinberg(), [])
    with pytest.raises(DataError, match="0 m long"):
        KnownWalk(features=features(), distance_m=0.0)
    with pytest.raises(DataError, match="no step"):
        KnownWalk(features=features(steps=0), distance_m=1.0)
    with pytest.raises(UsageError, match="ridge -1"):
        fit_step_length(Weinberg(), [KnownWalk(features=features(), distance_m=1.0)], ridge=-1.0)
    with pytest.raises(UsageError, match="must be a number"):
        Weinberg(k=float("nan"))
