"""Pictures of the aisle-graph experiment: figures 5 to 7, errors, tracks over the floor plan."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from blesim.estimators.base import Estimator
from blesim.recording import Recording, Truth
from blesim.reruns.aisle_graph_numbers import (
    BANDS_M,
    COLUMNS,
    METHODS,
    OTHER,
    PARTICLES,
    RUNS,
    SAME,
    TOTAL,
    error_key,
    particles_key,
)
from blesim.reruns.aisle_graph_search import tracked
from blesim.reruns.aisle_graph_signals import (
    AisleSignals,
    aisle_signals,
    expected_dbm,
    mean_curve,
)
from blesim.reruns.base import Curve, Key, Numbers, Picture

# Those of the paper's text: its own, and the least and the greatest measured in an office.
_EXPONENTS = (1.0, 1.35, 1.98)
# A run has some twenty readings in such a metre: too few for bars of 1 dB.
_BAR_DB = 3.0
_RANGE, _RSSI = "range [m]", "RSSI [dBm]"
# The run after the one that parameters were searched on.
_SHOWN = 1


def seed_pictures(
    recording: Recording,
    truth: Truth,
    chosen: Mapping[str, Estimator],
    errors: Mapping[str, Sequence[Numbers]],
    seed: int,
) -> Iterator[Picture]:
    """Pictures of one seed; estimators and errors by method."""
    same, other = aisle_signals(recording, RUNS[0])
    yield _figure_5(same, other)
    yield _figure_6(same)
    yield _figure_7(same)
    yield _distributions(errors)
    yield _error_in_time(recording, errors)
    for method, estimator in chosen.items():
        yield _map(recording, truth, method, estimator, seed)


def _figure_5(same: AisleSignals, other: AisleSignals) -> Picture:
    curves = ((SAME, same), (OTHER, other))
    return Picture(
        name="figure-5",
        title="Figure 5: mean RSSI in 1 m bins, run 1",
        x_label=_RANGE,
        y_label=_RSSI,
        kind="line",
        curves=tuple(_curve(label, *mean_curve(signals)) for label, signals in curves),
    )


def _figure_6(same: AisleSignals) -> Picture:
    levels = [same.within(band_m) for band_m in BANDS_M]
    low_dbm, high_dbm = min(map(np.min, levels)), max(map(np.max, levels))
    edges_dbm = np.arange(low_dbm - 0.5, high_dbm + _BAR_DB, _BAR_DB)
    middle_dbm = (edges_dbm[:-1] + edges_dbm[1:]) / 2.0
    return Picture(
        name="figure-6",
        title="Figure 6: RSSI within a metre of range, same aisle, run 1",
        x_label=_RSSI,
        y_label="share of readings [-]",
        kind="bars",
        curves=tuple(
            _curve(f"{near} to {far} m", middle_dbm, np.histogram(level, edges_dbm)[0] / len(level))
            for (near, far), level in zip(BANDS_M, levels, strict=True)
        ),
    )


def _figure_7(same: AisleSignals) -> Picture:
    distance_m, mean_dbm = mean_curve(same)
    # More points than a line has markers for.
    smooth_m = np.linspace(distance_m[0], distance_m[-1], 60)
    modelled = [
        _curve(f"Eq 1, n = {exponent:g}", smooth_m, expected_dbm(smooth_m, exponent))
        for exponent in _EXPONENTS
    ]
    return Picture(
        name="figure-7",
        title="Figure 7: mean RSSI in the same aisle, run 1, and path loss curves",
        x_label=_RANGE,
        y_label=_RSSI,
        kind="line",
        curves=(_curve(SAME, distance_m, mean_dbm), *modelled),
    )


def _distributions(errors: Mapping[str, Sequence[Numbers]]) -> Picture:
    """Distribution of the errors after every reading, all runs."""
    pooled = {method: np.sort(np.concatenate(runs)) for method, runs in errors.items()}
    return Picture(
        name="errors",
        title="Errors after every reading, runs 1 to 3",
        x_label="error [m]",
        y_label="share of readings [-]",
        kind="step",
        curves=tuple(
            _curve(method, error_m, np.arange(1, len(error_m) + 1) / len(error_m))
            for method, error_m in pooled.items()
        ),
    )


def _error_in_time(recording: Recording, errors: Mapping[str, Sequence[Numbers]]) -> Picture:
    readings = recording.by_name[RUNS[_SHOWN]].observations.readings
    time_s = (readings.time_us - readings.time_us[0]) * 1e-6
    return Picture(
        name="error-in-time",
        title="Error along run 2",
        x_label="time [s]",
        y_label="error [m]",
        kind="line",
        curves=tuple(_curve(method, time_s, runs[_SHOWN]) for method, runs in errors.items()),
    )


def _map(
    recording: Recording, truth: Truth, method: str, estimator: Estimator, seed: int
) -> Picture:
    """Estimates of run 2 over the floor plan."""
    run = RUNS[_SHOWN]
    walked = truth.walks[run].trajectory
    track = tracked(estimator, recording, recording.by_name[run], seed)
    return Picture(
        name=f"track-{method.replace(' ', '-')}",
        title=f"Run 2, {method}",
        x_label="x [m]",
        y_label="y [m]",
        kind="map",
        curves=(_curve("true", walked.x_m, walked.y_m), _curve(method, track.x_m, track.y_m)),
        venue=recording.venue,
    )


def overview_pictures(
    numbers: Mapping[Key, Numbers], printed: Mapping[Key, float]
) -> Sequence[Picture]:
    """Means over all seeds beside the published numbers."""
    runs = [
        (method, np.arange(1.0, 4.0), [error_key(method, column) for column in COLUMNS[:-1]])
        for method in METHODS
    ]
    counts = [("total", np.array(PARTICLES, float), [particles_key(n, TOTAL) for n in PARTICLES])]
    return (
        Picture(
            name="methods",
            title="Table 2: mean error of each run",
            x_label="run",
            y_label="mean error [m]",
            kind="line",
            curves=tuple(_beside(runs, numbers, printed)),
            x_names=("1", "2", "3"),
        ),
        Picture(
            name="particles",
            title="Table 3: mean error by the number of particles, all runs",
            x_label="particles [-]",
            y_label="mean error [m]",
            kind="line",
            curves=tuple(_beside(counts, numbers, printed)),
        ),
    )


def _beside(
    lines: Sequence[tuple[str, Numbers, Sequence[Key]]],
    numbers: Mapping[Key, Numbers],
    printed: Mapping[Key, float],
) -> Iterator[Curve]:
    for label, x, keys in lines:
        yield _curve(f"{label}, simulated", x, np.array([numbers[key].mean() for key in keys]))
        published = np.array([printed[key] for key in keys])
        yield Curve(label=f"{label}, published", x=x, y=published, published=True)


def _curve(label: str, x: ArrayLike, y: ArrayLike) -> Curve:
    return Curve(label=label, x=np.asarray(x, np.float64), y=np.asarray(y, np.float64))
