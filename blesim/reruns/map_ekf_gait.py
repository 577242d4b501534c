"""Steps and their lengths: tables 1 and 2 of the paper on map-compensated headings."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from blesim.estimators.walked_steps import SensedSteps, StepReading
from blesim.pdr.multi_threshold import MultiThreshold, MultiThresholdDetector
from blesim.pdr.step_length import (
    FrequencyVariance,
    KnownWalk,
    PeriodPeak,
    StepLengthModel,
    Weinberg,
    fit_step_length,
)
from blesim.pdr.steps import step_signal_m_s2
from blesim.recording import Recording, Walk, WalkKind
from blesim.reruns import map_ekf_numbers as names
from blesim.reruns.base import Key, Numbers
from blesim.scenario.reading import ScenarioFile
from blesim.scenario.walk_plan import RouteStop, WalkPlan
from blesim.simulate import Simulation
from blesim.tables import Imu

# The paper's grid begins at 0 and has steps of 0.01 s; where it ends is not told.
THRESHOLDS_S = np.arange(61) / 100.0
_DEFAULT, _LEAST = 14, 1
# Paper: the pace of its walks, in the middle; trotting: a slow pace of the runners that
# `blesim.walkers.gait` cites.
_WALK_M_S, _RUN_M_S = 1.65, 2.6
# Steps, pace, and whether around a corner (paper, section 3.1).
_COUNTED = {
    "walk, straight": (56, _WALK_M_S, False),
    "walk, turning": (122, _WALK_M_S, True),
    "run, straight": (45, _RUN_M_S, False),
    "run, turning": (86, _RUN_M_S, True),
}
_BEFORE_CORNER_M = 26.0
# On the scenario's map: the west end of B, and the corner between Z and A.
_B_WEST_M, _AZ_M = (55.238, 32.0), (115.238, 2.0)
# Between two starts: longer than any of them.
_EVERY_S = 200
# Least squares: a ridge so small that it only decides what the seven walks leave open.
_RIDGE = 1e-9
_MODELS: Mapping[str, StepLengthModel] = {
    "Eq 6": FrequencyVariance(),
    "Eq 7": PeriodPeak(),
    "Eq 8": Weinberg(),
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CountedWalk:
    """A walk whose steps are counted with every threshold.

    Attributes
    ----------
    steps : int
        Really taken.
    counts : ndarray of int64, (thresholds,)
        Found with each of `THRESHOLDS_S`.
    imu : Imu
        In which they were found.
    """

    steps: int
    counts: NDArray[np.int64]
    imu: Imu


def counted_walks(file: ScenarioFile, seed: int) -> dict[str, CountedWalk]:
    """The walks of table 1 by their rows, simulated and counted."""
    plans = tuple(_counted_plans(file.scenario.walks[0]))
    recording, truth = Simulation.run(file.with_parameters(walks=plans), seed).recording()
    return {
        row: CountedWalk(
            steps=len(truth.walks[walk.name].steps),
            counts=step_counts(walk.observations.imu),
            imu=walk.observations.imu,
        )
        for row, walk in zip(_COUNTED, recording.walks, strict=True)
    }


def _counted_plans(like: WalkPlan) -> Iterator[WalkPlan]:
    for number, (row, (steps, speed_m_s, corner)) in enumerate(_COUNTED.items()):
        # Half a step more: the last foot is then set down before the end.
        way_m = (steps + 0.5) * float(like.gait.step_length_m(np.array(speed_m_s)))
        yield like.model_copy(
            update={
                "name": row,
                "speed_m_s": speed_m_s,
                "start_s": _EVERY_S * number,
                "route": tuple(_around_corner(way_m) if corner else _straight_on(way_m)),
            }
        )


def _straight_on(way_m: float) -> Iterator[RouteStop]:
    """From the west end of B to the east."""
    yield _stop(_B_WEST_M)
    yield _stop(_B_WEST_M, east_m=way_m)


def _around_corner(way_m: float) -> Iterator[RouteStop]:
    """Along Z, around the corner AZ and along A."""
    yield _stop(_AZ_M, north_m=_BEFORE_CORNER_M)
    yield _stop(_AZ_M)
    yield _stop(_AZ_M, east_m=_BEFORE_CORNER_M - way_m)


def _stop(place_m: tuple[float, float], *, east_m: float = 0.0, north_m: float = 0.0) -> RouteStop:
    return RouteStop(x_m=place_m[0] + east_m, y_m=place_m[1] + north_m)


def step_counts(imu: Imu) -> NDArray[np.int64]:
    """Steps found with each of `THRESHOLDS_S`, (thresholds,)."""
    signal = step_signal_m_s2(imu)
    counts = []
    for threshold_s in THRESHOLDS_S.tolist():
        detector = MultiThresholdDetector(MultiThreshold(interval_s=threshold_s))
        counts.append(len(detector.advance(imu.time_us, signal)) + len(detector.finish()))
    return np.array(counts)


@dataclass(frozen=True, slots=True, kw_only=True)
class BestRange:
    """Thresholds with the best count, and around them with a good one; rows of the thresholds.

    Attributes
    ----------
    first, last : int
        The longest run of thresholds whose count is nearest to the truth: exact, if any is.
    near_first, near_last : int
        The run around it whose counts are at most 5 % off, or no more than the best.
    """

    first: int
    last: int
    near_first: int
    near_last: int


def best_range(counts: NDArray[np.int64], steps: int) -> BestRange:
    """Where counts, (thresholds,), are the best; of runs of one length the first."""
    off = np.abs(counts - steps)
    runs = _runs(off == off.min())
    first, last = max(runs, key=lambda run: run[1] - run[0])
    near = _runs(off <= max(0.05 * steps, float(off.min())))
    near_first, near_last = next(run for run in near if run[0] <= first <= run[1])
    return BestRange(first=first, last=last, near_first=near_first, near_last=near_last)


def _runs(holds: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last row of each run of rows that hold."""
    edges = np.diff(np.concatenate([[0], holds.astype(np.int64), [0]]))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    return list(zip(begins.tolist(), ends.tolist(), strict=True))


def step_numbers(walks: Mapping[str, CountedWalk]) -> Iterator[tuple[Key, float]]:
    """Numbers of table 1."""
    for row, walk in walks.items():
        best = best_range(walk.counts, walk.steps)
        first_s, last_s, near_first_s, near_last_s = THRESHOLDS_S[
            [best.first, best.last, best.near_first, best.near_last]
        ].tolist()
        yield Key(names.STEPS, row, names.BEST_FROM), first_s
        yield Key(names.STEPS, row, names.BEST_TO), last_s
        yield Key(names.STEPS, row, names.BEST_WIDTH), last_s - first_s
        yield Key(names.STEPS, row, names.NEAR_FROM), near_first_s
        yield Key(names.STEPS, row, names.NEAR_TO), near_last_s
        wrong = abs(int(walk.counts[_DEFAULT]) - walk.steps) / walk.steps
        yield Key(names.STEPS, row, names.AT_DEFAULT), 100.0 * wrong
        yield Key(names.STEPS, row, names.AT_LEAST), float(walk.counts[_LEAST])


def known_walks(recording: Recording) -> list[KnownWalk]:
    """The walks of known length with the features of their steps, in order of the recording."""
    return [_known(walk) for walk in recording.walks if walk.kind == WalkKind.SURVEY]


def known_by_walkers(file: ScenarioFile, seed: int, *, same: bool) -> list[KnownWalk]:
    """The walks of known length, with strengths of gait that are those of people, not of walks.

    What is drawn for a walker hangs on the walk's name, so that the first walks of all people are
    simulated under the people's names, then the second ones, and so on. On each walk the steps of a
    person are then irregular in the same way.

    Parameters
    ----------
    file, seed : ScenarioFile, int
        What is simulated.
    same : bool
        Whether all people walk with the same strength; else those with the same gait do.
    """
    surveys = [plan for plan in file.scenario.walks if plan.kind == "survey"]
    people = ["all" if same else plan.gait.model_dump_json() for plan in surveys]
    earlier = [people[:row].count(person) for row, person in enumerate(people)]
    known: dict[int, KnownWalk] = {}
    for times in range(max(earlier) + 1):
        rows = [row for row, before in enumerate(earlier) if before == times]
        plans = tuple(
            surveys[row].model_copy(update={"name": f"person-{people.index(people[row])}"})
            for row in rows
        )
        recording, _ = Simulation.run(file.with_parameters(walks=plans), seed).recording()
        known |= zip(rows, known_walks(recording), strict=True)
    return [known[row] for row in range(len(surveys))]


def _known(walk: Walk) -> KnownWalk:
    marks = walk.observations.marks
    way_m = float(np.hypot(np.diff(marks.x_m), np.diff(marks.y_m)).sum())
    # Lengths ask for no heading: the compass alone, for the gyroscope would ask for the first.
    felt = SensedSteps(StepReading(compass_weight=1.0)).felt(walk.observations)
    return KnownWalk(features=felt.features, distance_m=way_m)


def length_numbers(walks: list[KnownWalk]) -> Iterator[tuple[Key, float]]:
    """Numbers of table 2: each model fitted to the walks that it is held against, as there."""
    real_m = np.array([walk.distance_m for walk in walks])
    for row, model in _MODELS.items():
        fitted = fit_step_length(model, walks, ridge=_RIDGE)
        found_m = np.array([float(fitted.length_m(walk.features).sum()) for walk in walks])
        for distance_m, length_m in zip(names.DISTANCES_M, found_m.tolist(), strict=True):
            yield Key(names.LENGTHS, row, names.length_column(distance_m)), length_m
        mean_m, most_m, variance_m2 = off_summary(found_m - real_m)
        yield Key(names.LENGTHS, row, names.OFF_MEAN), mean_m
        yield Key(names.LENGTHS, row, names.OFF_MOST), most_m
        yield Key(names.LENGTHS, row, names.OFF_VARIANCE), variance_m2


def off_summary(off_m: Numbers) -> tuple[float, float, float]:
    """Mean, greatest and sample variance of the absolute differences. [m], [m], [m2]."""
    size_m = np.abs(off_m)
    return float(size_m.mean()), float(size_m.max()), float(size_m.var(ddof=1))
