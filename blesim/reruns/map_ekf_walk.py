"""Headings and positions of the walk: tables 3 to 5 of the paper on map-compensated headings."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from blesim.errors import DataError
from blesim.estimators.base import StartInfo
from blesim.estimators.registry import make_estimator
from blesim.estimators.run import start_of
from blesim.recording import Recording, Truth, Walk
from blesim.reruns import map_ekf_numbers as names
from blesim.reruns.base import Key, Numbers
from blesim.reruns.followed import followed, learned
from blesim.rng import Draws
from blesim.scenario.reading import ScenarioFile
from blesim.scenario.venue_source import VenueSource
from blesim.simulate import Simulation
from blesim.tables import Track, Trajectory
from blesim.units import azimuth_to_heading, wrap_angle
from blesim.venue.sites.campus_corridor import ZONES
from blesim.venue.venue import Venue

_WALK = "b-to-c"
# Paper: the seven walks teach lengths of steps; nothing is learned of the compass beforehand.
_OHPDR, _AHPDR, _BEPDR, _EKFPDR = (
    f"{name}:offset_deg=0" for name in ("ohpdr", "ahpdr", "bepdr", "ekfpdr")
)
# Eq 17 to the letter, beside the error-state filter that the paper names: it runs away.
_KEPT = f"{_EKFPDR},errors=kept"
KEPT_ROW = "EKFPDR, errors kept as Eq 17 reads"
# Estimators by the number of beacons in use and the solution.
Tried = Mapping[int, Mapping[str, str]]
# Paper, section 5.
TRIED: Tried = {
    20: {"OHPDR": _OHPDR, "AHPDR": _AHPDR, "EKFPDR": _EKFPDR, KEPT_ROW: _KEPT},
    15: {"EKFPDR": _EKFPDR},
    10: {"EKFPDR": _EKFPDR},
    5: {"BEPDR": _BEPDR},
}
_LAYOUTS = {15: "campus-corridor-15", 10: "campus-corridor-10", 5: "campus-corridor-keys"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Solving:
    """How the walk is solved, and where its errors are looked at.

    Attributes
    ----------
    tried : mapping of int to mapping of str to str
        By the number of beacons, at least 20, estimators by solution.
    start_off_m : float
        How far off the walk is told to begin. [m]
    every_steps : int
        The error of the position is looked at after each so many steps. [-]
    trained_steps : int
        So many first straight steps of each corridor do not count in table 3. [-]
    """

    tried: Tried = field(default_factory=lambda: TRIED)
    start_off_m: float = names.START_OFF_M
    every_steps: int = 1
    trained_steps: int = 0


AS_PUBLISHED = Solving()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solved:
    """One solution on the walk, whose error is looked at k times after the start.

    Attributes
    ----------
    track : Track
        Estimated.
    error_m : ndarray of float64, (k + 1,)
        At the start and after true steps. [m]
    """

    track: Track
    error_m: Numbers


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solutions:
    """All solutions of one seed.

    Attributes
    ----------
    recording, truth : Recording, Truth
        With 20 beacons.
    walk : Walk
        The walk, whose first mark is as far off as the paper's positions begin.
    solved : mapping of (str, int) to Solved
        By solution and number of beacons.
    """

    recording: Recording
    truth: Truth
    walk: Walk
    solved: Mapping[tuple[str, int], Solved]

    @property
    def trajectory(self) -> Trajectory:
        """Where the walker really was."""
        return self.truth.walks[_WALK].trajectory

    @property
    def start(self) -> StartInfo:
        """Where the walk is told to begin."""
        return _start(self.walk)


def solutions(file: ScenarioFile, seed: int, solving: Solving = AS_PUBLISHED) -> Solutions:
    """The walk of one seed by all solutions.

    Raises
    ------
    DataError
        If an estimator fails.
    """
    recording, truth = Simulation.run(file, seed).recording()
    solved: dict[tuple[str, int], Solved] = {}
    for beacons in solving.tried:
        known = recording, truth
        if beacons in _LAYOUTS:
            source = VenueSource.model_validate({"layout": _LAYOUTS[beacons]})
            known = Simulation.run(file.with_parameters(venue=source), seed).recording()
        solved |= dict(_solved(*known, beacons, seed, solving))
    return Solutions(
        recording=recording,
        truth=truth,
        walk=misplaced(recording.by_name[_WALK], seed, solving.start_off_m),
        solved=solved,
    )


def _solved(
    recording: Recording, truth: Truth, beacons: int, seed: int, solving: Solving
) -> Iterator[tuple[tuple[str, int], Solved]]:
    walk = misplaced(recording.by_name[_WALK], seed, solving.start_off_m)
    true = truth.walks[_WALK]
    time_us = np.concatenate([true.trajectory.time_us[:1], true.steps.time_us])
    time_us = time_us[:: solving.every_steps]
    for row, text in solving.tried[beacons].items():
        label, estimator = make_estimator(text)
        track = followed(learned(estimator, recording, label), recording, walk, seed, label)
        error_m = errors_m(track, _start(walk), true.trajectory, time_us)
        yield (row, beacons), Solved(track=track, error_m=error_m)


def misplaced(walk: Walk, seed: int, far_m: float = names.START_OFF_M) -> Walk:
    """The walk whose first mark is off, any way: "the error accumulated from the initial 2 m".

    What comes after the first mark is not looked at.
    """
    marks = walk.observations.marks
    turn = Draws(seed=seed, purpose="start of the walk").uniforms(np.zeros(1, np.int64))[0, 0]
    off_m = far_m * np.array([np.cos(2 * np.pi * turn), np.sin(2 * np.pi * turn)])
    first = np.arange(len(marks)) == 0
    marks = replace(marks, x_m=marks.x_m + first * off_m[0], y_m=marks.y_m + first * off_m[1])
    return replace(walk, observations=replace(walk.observations, marks=marks))


def _start(walk: Walk) -> StartInfo:
    start = start_of(walk)
    if start is None:
        raise DataError(f"walk '{walk.name}' has no mark at its start; give it 'marks: stops'")
    return start


def errors_m(
    track: Track, start: StartInfo, trajectory: Trajectory, time_us: NDArray[np.int64]
) -> Numbers:
    """Error of the estimate in force at each moment, (n,), before the first that of the start. [m].

    Not after readings as `blesim.metrics` has it: with five beacons they come near these alone.
    """
    row = np.searchsorted(track.time_us, time_us, side="right")
    x_m = np.concatenate([[start.x_m], track.x_m])[row]
    y_m = np.concatenate([[start.y_m], track.y_m])[row]
    true = trajectory.at(time_us)
    return np.hypot(x_m - true.x_m, y_m - true.y_m)


def step_headings(track: Track, start: StartInfo) -> tuple[NDArray[np.int64], Numbers]:
    """Times and headings of the steps of dead reckoning: its moves, (m,) each. [us], [rad]."""
    along_m = np.diff(track.x_m, prepend=start.x_m)
    across_m = np.diff(track.y_m, prepend=start.y_m)
    moved = np.hypot(along_m, across_m) > 0
    return track.time_us[moved].astype(np.int64), np.arctan2(across_m, along_m)[moved]


def zone_azimuths_deg(time_us: NDArray[np.int64], trajectory: Trajectory, venue: Venue) -> Numbers:
    """Azimuth of the straight zone walked through at each moment, (n,), NaN in a turn. [degree]."""
    if venue.graph is None:
        raise DataError(f"venue '{venue.name}' has no aisle graph, so no zones")
    of_branch = {zone.name: zone.azimuth_deg for zone in ZONES}
    azimuths = np.array([of_branch.get(name, np.nan) for name in venue.graph.branches])
    return np.asarray(azimuths[venue.graph.branch[trajectory.at(time_us).edge]], np.float64)


def heading_errors_deg(
    found: Solutions, solution: str
) -> tuple[NDArray[np.int64], Numbers, Numbers]:
    """Times of the straight steps of dead reckoning, azimuth of the corridor, error of the step's.

    Three arrays (m,). [us], [degree], [degree]
    """
    time_us, heading_rad = step_headings(found.solved[solution, 20].track, found.start)
    azimuth_deg = zone_azimuths_deg(time_us, found.trajectory, found.truth.venue)
    straight = ~np.isnan(azimuth_deg)
    true_rad = azimuth_to_heading(np.radians(azimuth_deg[straight]))
    # Headings and azimuths turn opposite ways.
    off_deg = np.degrees(wrap_angle(true_rad - heading_rad[straight]))
    return time_us[straight], azimuth_deg[straight], off_deg


def heading_numbers(
    found: Solutions, solving: Solving = AS_PUBLISHED
) -> Iterator[tuple[Key, float]]:
    """Numbers of table 3, of the solutions that were tried."""
    for solution, mean, most in (
        ("OHPDR", names.RAW_MEAN, names.RAW_MOST),
        ("AHPDR", names.MENDED_MEAN, names.MENDED_MOST),
    ):
        if (solution, 20) not in found.solved:
            continue
        _, azimuth_deg, off_deg = heading_errors_deg(found, solution)
        for each_deg in names.AZIMUTHS_DEG:
            here_deg = np.abs(off_deg[azimuth_deg == each_deg])[solving.trained_steps :]
            row = names.azimuth_row(each_deg)
            yield Key(names.HEADINGS, row, mean), float(here_deg.mean())
            yield Key(names.HEADINGS, row, most), float(here_deg.max())


def position_numbers(found: Solutions) -> Iterator[tuple[Key, float]]:
    """Numbers of tables 4 and 5, of the solutions that were tried."""
    for (solution, beacons), solved in found.solved.items():
        if (solution, beacons) not in (("EKFPDR", 15), ("EKFPDR", 10)):
            yield from _summary(names.SOLUTIONS, solution, solved.error_m)
        if solution == "EKFPDR":
            yield from _summary(names.DENSITIES, names.beacons_row(beacons), solved.error_m)


def _summary(table: str, row: str, error_m: Numbers) -> Iterator[tuple[Key, float]]:
    yield Key(table, row, names.LEAST), float(error_m.min())
    yield Key(table, row, names.MEAN), float(error_m.mean())
    yield Key(table, row, names.MOST), float(error_m.max())
