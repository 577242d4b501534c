"""The experiment of the proximity paper [1]_, rerun on the H-shaped floor.

Five walks of one course in a row, positioned by four algorithms whose error is read out at two
points; the proposed one with three penalties; and where a beacon is Near, in cells of 30 cm.

References
----------
.. [1] Particle filter on beacon proximity and a floor map; digest "proximity-particle-filter".
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blesim.errors import DataError
from blesim.estimators.base import Estimator
from blesim.estimators.proximity_particle_filter import ProximityParticleFilter
from blesim.estimators.run import surveys_of
from blesim.estimators.trilateration_particle_filter import TrilaterationParticleFilter
from blesim.recording import Recording, Truth, Walk, WalkTruth
from blesim.reruns.base import Expected, Key, Numbers, Picture, Published, Trial
from blesim.reruns.followed import followed, learned
from blesim.reruns.proximity_pf_cells import cells_of, numbers_of_cells
from blesim.reruns.proximity_pf_given import (
    with_near_by_chance,
    with_true_headings,
    without_survey,
)
from blesim.reruns.proximity_pf_numbers import (
    ALGORITHMS,
    CHOSEN_PENALTY,
    LEAST,
    MEAN,
    MOST,
    OURS,
    PENALTIES,
    POINTS,
    TRIALS,
    A,
    B,
    C,
    error_key,
    expected,
    less_key,
    penalty_key,
    point_key,
    published,
    summary_key,
)
from blesim.reruns.proximity_pf_pictures import Walked, overview_pictures, trial_pictures
from blesim.reruns.sites import scenario_of
from blesim.scenario.reading import ScenarioFile
from blesim.simulate import Simulation
from blesim.tables import Track
from blesim.units import to_us

# Steps from the peaks and valleys of the acceleration, headings from the compass, as in the paper.
PROXIMITY = ProximityParticleFilter(source="imu", penalty=CHOSEN_PENALTY)
TRILATERATION = TrilaterationParticleFilter(source="imu", penalty=CHOSEN_PENALTY)
# Between the starts of two walks, each of which takes 74 s.
_APART_S = 100.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ProximityExperiment:
    """The proximity paper.

    Attributes
    ----------
    paper, title : str
        What it is called.
    values : mapping of str to object
        What stands in place of the scenario's own, by path.
    proximity : ProximityParticleFilter
        The proposed algorithm; without the map it is C.
    trilateration : TrilaterationParticleFilter
        A; without the map it is B.
    surveyed : bool
        Whether the algorithms learn from the survey.
    true_headings : bool
        Whether the phone's step events have the true headings, for algorithms with these events as
        their source.
    near_by_chance : bool
        Whether each reading tells Near with the probability of Eq 5, and not as the phone did.
    """

    paper: str = "proximity-pf"
    title: str = "Particle filter on beacon proximity and a floor map"
    values: Mapping[str, Any] = field(default_factory=dict)
    proximity: ProximityParticleFilter = PROXIMITY
    trilateration: TrilaterationParticleFilter = TRILATERATION
    surveyed: bool = True
    true_headings: bool = False
    near_by_chance: bool = False

    @property
    def published(self) -> Sequence[Published]:
        """Figures 3 and 4, table I."""
        return published()

    @property
    def expected(self) -> Sequence[Expected]:
        """Table I, and the footnote on the penalty."""
        return expected()

    @property
    def algorithms(self) -> Mapping[str, Estimator]:
        """Those of table I by their names."""
        return {
            A: self.trilateration,
            B: replace(self.trilateration, use_map=False),
            C: replace(self.proximity, use_map=False),
            OURS: self.proximity,
        }

    def trial(self, seed: int, *, pictures: bool = False) -> Trial:
        """Numbers of one seed, pictures if asked for.

        Raises
        ------
        DataError
            If an estimator fails.
        """
        file = five_trials(scenario_of("h-floor", self.values))
        recording, truth = Simulation.run(file, seed).recording()
        given = self._given(recording, truth, seed)
        walked = {name: _walked(given, each, seed) for name, each in self.algorithms.items()}
        errors_m = {
            name: read_out_errors_m(file, recording, truth, tracks)
            for name, tracks in walked.items()
        }
        cells = cells_of(surveys_of(recording), recording.venue)
        numbers = numbers_of_cells(cells) | numbers_of_table(errors_m)
        for penalty in PENALTIES:
            with_it_m = errors_m[OURS]
            if penalty != self.proximity.penalty:
                tracks = _walked(given, replace(self.proximity, penalty=penalty), seed)
                with_it_m = read_out_errors_m(file, recording, truth, tracks)
            numbers[penalty_key(penalty)] = float(np.mean(with_it_m))
        if not pictures:
            return Trial(numbers=numbers)
        first = Walked(
            venue=recording.venue,
            truth=truth.walks[_name(1)].trajectory,
            tracks={name: tracks[0] for name, tracks in walked.items()},
            read_out_us=read_out_us(file, recording, recording.by_name[_name(1)]),
        )
        return Trial(numbers=numbers, pictures=trial_pictures(numbers, cells, first))

    def _given(self, recording: Recording, truth: Truth, seed: int) -> Recording:
        """What the algorithms are given."""
        if self.true_headings:
            recording = with_true_headings(recording, truth)
        if self.near_by_chance:
            recording = with_near_by_chance(recording, truth, seed)
        return recording if self.surveyed else without_survey(recording)

    def overview(self, numbers: Mapping[Key, Numbers]) -> Sequence[Picture]:
        """P(d), errors and penalties over all seeds."""
        return overview_pictures(numbers)


def five_trials(file: ScenarioFile) -> ScenarioFile:
    """The scenario with its course walked five times in a row, and the survey after them."""
    (course,) = file.scenario.walks
    walks = tuple(
        course.model_copy(update={"name": _name(trial), "start_s": _APART_S * (trial - 1)})
        for trial in TRIALS
    )
    after_s = _APART_S * len(TRIALS)
    surveys = tuple(
        each.model_copy(update={"start_s": each.start_s + after_s})
        for each in file.scenario.surveys
    )
    return file.with_parameters(walks=walks, surveys=surveys)


def _name(trial: int) -> str:
    return f"trial-{trial}"


def _walked(recording: Recording, estimator: Estimator, seed: int) -> list[Track]:
    """Track of each trial."""
    # The same label for all, so that map and penalty are compared on the same draws.
    label = "proximity-pf"
    ready = learned(estimator, recording, label)
    walks = [recording.by_name[_name(trial)] for trial in TRIALS]
    return [followed(ready, recording, walk, seed, label) for walk in walks]


def read_out_us(file: ScenarioFile, recording: Recording, walk: Walk) -> NDArray[np.int64]:
    """Moment of each point at which the error of a walk is read out, (2,): amid the stand there.

    [us]
    """
    graph = recording.venue.graph
    marks = walk.observations.marks
    if graph is None:
        raise DataError("the venue of proximity-pf has no aisle graph")
    moments_us = []
    for stop in file.scenario.walks[0].route:
        if stop.node is None or not stop.pause_s:
            continue
        x_m, y_m = graph.node_xy_m[graph.node_row[stop.node]]
        # Pressed on arrival; the walk may have passed by before.
        pressed = np.flatnonzero(np.hypot(marks.x_m - x_m, marks.y_m - y_m) < 0.01)
        moments_us.append(int(marks.time_us[pressed[-1]]) + to_us(stop.pause_s / 2))
    return np.array(moments_us, np.int64)


def read_out_errors_m(
    file: ScenarioFile, recording: Recording, truth: Truth, tracks: Sequence[Track]
) -> NDArray[np.float64]:
    """Error of the estimate in force at each read-out, (trials, points). [m]."""
    walks = [recording.by_name[_name(trial)] for trial in TRIALS]
    return np.stack(
        [
            errors_at_m(track, truth.walks[walk.name], read_out_us(file, recording, walk))
            for walk, track in zip(walks, tracks, strict=True)
        ]
    )


def errors_at_m(track: Track, truth: WalkTruth, time_us: NDArray[np.int64]) -> NDArray[np.float64]:
    """Horizontal error of the estimates in force at moments, (n,). [m].

    Raises
    ------
    DataError
        If there is none yet.
    """
    in_force = np.searchsorted(track.time_us, time_us, side="right") - 1
    if np.any(in_force < 0):
        raise DataError("proximity-pf: no estimate at a read-out point")
    true = truth.trajectory.at(time_us)
    off_m: NDArray[np.float64] = np.hypot(
        track.x_m[in_force] - true.x_m, track.y_m[in_force] - true.y_m
    )
    return off_m


def numbers_of_table(errors_m: Mapping[str, NDArray[np.float64]]) -> dict[Key, float]:
    """Table I and section IV-C from the errors of each algorithm, (trials, points) [m]."""
    numbers: dict[Key, float] = {}
    for algorithm in ALGORITHMS:
        table_m = errors_m[algorithm]
        numbers |= {
            summary_key(algorithm, MEAN): float(np.mean(table_m)),
            summary_key(algorithm, LEAST): float(np.min(table_m)),
            summary_key(algorithm, MOST): float(np.max(table_m)),
        }
        for (trial, point), error_m in np.ndenumerate(table_m):
            numbers[error_key(algorithm, TRIALS[trial], POINTS[point])] = float(error_m)
        for point, mean_m in zip(POINTS, np.mean(table_m, axis=0).tolist(), strict=True):
            numbers[point_key(algorithm, point)] = mean_m
    ours_m = numbers[summary_key(OURS, MEAN)]
    for algorithm in (A, B, C):
        share = ours_m / numbers[summary_key(algorithm, MEAN)]
        numbers[less_key(algorithm)] = 100.0 * (1.0 - share)
    return numbers


EXPERIMENT = ProximityExperiment()
