"""The aisle-graph experiment: nearest beacon, beacon pair and particle filter in a wholesale store.

Parameters are searched on run 1, then all three runs are followed with them; the random numbers of
the search are those of the result, as the paper's tables 1 and 2 agree on run 1.

References
----------
.. [1] The aisle-graph particle filter in a wholesale store, 2016;
   digest "aisle-graph-particle-filter".
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np

from blesim.estimators.base import Estimator
from blesim.recording import Recording
from blesim.reruns.aisle_graph_numbers import (
    AVERAGED,
    BANDS_M,
    COLUMNS,
    EXPECTED,
    FILTER,
    NEAREST,
    OTHER,
    PAIR,
    PARTICLES,
    PUBLISHED,
    RUNS,
    SAME,
    band_key,
    bump_key,
    chosen_key,
    clustered_key,
    error_key,
    exponent_key,
    parameters_of,
    particles_key,
    particles_row,
    searched_key,
    welch_key,
)
from blesim.reruns.aisle_graph_pictures import overview_pictures, seed_pictures
from blesim.reruns.aisle_graph_search import (
    BASELINE_PARTICLES,
    LABEL,
    Grids,
    best_of,
    errors_m,
    searched,
)
from blesim.reruns.aisle_graph_signals import aisle_signals, bump, fitted_exponent
from blesim.reruns.aisle_graph_significance import Difference, clustered, welch
from blesim.reruns.base import Expected, Key, Numbers, Picture, Published, Trial
from blesim.reruns.sites import scenario_of
from blesim.simulate import Simulation
from blesim.venue.venue import Venue

T = TypeVar("T")

_TUNING_RUN = RUNS[0]


@dataclass(frozen=True, slots=True, kw_only=True)
class AisleGraph:
    """Experiment of the aisle-graph paper.

    Attributes
    ----------
    paper, title : str
    published : sequence of Published
    expected : sequence of Expected
    values : mapping of str to object
        What stands in place of the scenario's own, by path; see `blesim.scenario.other_values`.
    shelves : str or None
        What all shelves are loaded with, a name of `MATERIALS`; where not given, what the map says.
    grids : callable
        What the search on run 1 chooses from; rows that it leaves out have no numbers.
    redrawn : bool
        Whether the chosen filters are followed with other random numbers than those of the search.
    """

    paper: str = "aisle-graph"
    title: str = "graph particle filter in a wholesale store (IPIN 2016)"
    published: Sequence[Published] = PUBLISHED
    expected: Sequence[Expected] = EXPECTED
    values: Mapping[str, Any] = field(default_factory=dict)
    shelves: str | None = None
    grids: Callable[[], Grids] = searched
    redrawn: bool = False

    def trial(self, seed: int, *, pictures: bool = False) -> Trial:
        """Numbers of one seed: tables 1 to 3, the tests, and figures 5 to 7."""
        recording, truth = self._simulation(seed).recording()
        chosen = {
            row: best_of(grid, recording, truth, _TUNING_RUN, seed)
            for row, grid in self.grids().items()
        }
        label = f"{LABEL} again" if self.redrawn else LABEL
        errors = {
            row: [errors_m(each, recording, truth, run, seed, label) for run in RUNS]
            for row, each in chosen.items()
        }
        numbers = {
            **dict(_signal_numbers(recording)),
            **dict(_chosen_numbers(chosen)),
            searched_key(AVERAGED): float(errors[AVERAGED][0].mean()),
            **dict(_error_numbers(errors)),
            **dict(_test_numbers(_of_methods(errors))),
        }
        drawn = (
            seed_pictures(recording, truth, _of_methods(chosen), _of_methods(errors), seed)
            if pictures
            else ()
        )
        return Trial(numbers=numbers, pictures=tuple(drawn))

    def _simulation(self, seed: int) -> Simulation:
        simulation = Simulation.run(scenario_of("wholesale-section", self.values), seed)
        if self.shelves is None:
            return simulation
        built = reshelved(simulation.stage.built, self.shelves)
        return replace(simulation, stage=replace(simulation.stage, built=built))

    def overview(self, numbers: Mapping[Key, Numbers]) -> Sequence[Picture]:
        """Errors of the methods by run, and of the filter by the number of particles."""
        return overview_pictures(numbers, {each.key: each.value for each in self.published})


def reshelved(venue: Venue, material: str) -> Venue:
    """The venue with all its obstacles of one material, a name of `MATERIALS`."""
    plan = venue.floor_plan
    obstacles = tuple(replace(obstacle, material=material) for obstacle in plan.obstacles)
    return replace(venue, floor_plan=replace(plan, obstacles=obstacles))


def _of_methods(by_row: Mapping[str, T]) -> dict[str, T]:
    """What belongs to the three methods of table 2."""
    rows = (NEAREST, PAIR, particles_row(BASELINE_PARTICLES))
    return dict(zip((NEAREST, PAIR, FILTER), (by_row[row] for row in rows), strict=True))


def _chosen_numbers(chosen: Mapping[str, Estimator]) -> Iterator[tuple[Key, float]]:
    for row, estimator in chosen.items():
        for name in parameters_of(row):
            yield chosen_key(row, name), float(getattr(estimator, name))


def _error_numbers(errors: Mapping[str, Sequence[Numbers]]) -> Iterator[tuple[Key, float]]:
    """Tables 2 and 3; each reading counts once in a total."""
    for method, runs in _of_methods(errors).items():
        for column, error_m in zip(COLUMNS, (*runs, np.concatenate(runs)), strict=True):
            yield error_key(method, column), float(error_m.mean())
            yield error_key(method, column, "std"), float(error_m.std())
    for count in (each for each in PARTICLES if particles_row(each) in errors):
        runs = errors[particles_row(count)]
        for column, error_m in zip(COLUMNS, (*runs, np.concatenate(runs)), strict=True):
            yield particles_key(count, column), float(error_m.mean())
            yield particles_key(count, column, "std"), float(error_m.std())


def _test_numbers(errors: Mapping[str, Sequence[Numbers]]) -> Iterator[tuple[Key, float]]:
    ours = errors[FILTER]
    for other in (PAIR, NEAREST):
        theirs = errors[other]
        pooled = welch(np.concatenate(ours), np.concatenate(theirs))
        for key_of, found in ((welch_key, pooled), (clustered_key, clustered(ours, theirs))):
            for column, value in _columns(found):
                yield key_of(other, column), value


def _columns(found: Difference) -> Iterator[tuple[str, float]]:
    """Columns of a test; the difference is told as how much lower the filter's error is."""
    yield "t [-]", found.t
    yield "difference [m]", -found.difference_m
    yield "half of the 99 % interval [m]", found.half_m


def _signal_numbers(recording: Recording) -> Iterator[tuple[Key, float]]:
    """Figures 5 to 7, of run 1 as in the paper."""
    same, other = aisle_signals(recording, _TUNING_RUN)
    yield exponent_key(SAME), fitted_exponent(same)
    yield exponent_key(OTHER), fitted_exponent(other)
    range_m, height_db = bump(other)
    yield bump_key("range [m]"), range_m
    yield bump_key("height [dB]"), height_db
    for band_m in BANDS_M:
        rssi_dbm = same.within(band_m)
        yield band_key(band_m, "mean [dBm]"), float(rssi_dbm.mean())
        yield band_key(band_m, "spread [dB]"), float(rssi_dbm.std())


EXPERIMENT = AisleGraph()
