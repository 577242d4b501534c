"""Rerun of the paper on map-compensated headings [1]_: steps, lengths, headings, four solutions.

Simulated are four walks of counted steps, seven of known length, and the walk through the corridors
with 20, 15, 10 and 5 beacons; what the phone feels is the same with all of them. The paper walked
once; one walk says little, so that a seed is ten of each, every one in a building with a magnetic
field and shadows of its own, and its numbers are their means.

References
----------
.. [1] PDR with map-compensated heading, and two fusions with beacons, 2015; digest
   "map-heading-ekf".
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

import numpy as np

from blesim.reruns.base import Expected, Key, Numbers, Picture, Published, Trial
from blesim.reruns.map_ekf_gait import (
    CountedWalk,
    counted_walks,
    known_by_walkers,
    known_walks,
    length_numbers,
    step_numbers,
)
from blesim.reruns.map_ekf_numbers import EXPECTED, PUBLISHED
from blesim.reruns.map_ekf_pictures import overview_pictures, trial_pictures
from blesim.reruns.map_ekf_walk import (
    AS_PUBLISHED,
    Solutions,
    Solving,
    heading_numbers,
    position_numbers,
    solutions,
)
from blesim.reruns.sites import scenario_of
from blesim.reruns.statistics import stacked
from blesim.rng import SEED_LIMIT, Draws
from blesim.scenario.reading import ScenarioFile

_SCENARIO = "campus-corridor"
_WALKS = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class MapEkf:
    """The experiment; see `blesim.reruns.base.Experiment`.

    Attributes
    ----------
    values : mapping of str to object
        Laid into the scenario, by path; see `blesim.scenario.other_values`.
    solving : Solving
        Estimators, and where errors are looked at; pictures need those that were published.
    strength : {"walk", "person", "all"}
        What has a strength of gait of its own: each walk of known length; each person, walks with
        the same gait being one person's; or nothing, all being the same.
    walks : int
        How many walks make up a trial. [-]
    """

    paper: ClassVar[str] = "map-ekf"
    title: ClassVar[str] = (
        "Dead reckoning with map-compensated headings, alone and fused with beacons"
    )
    published: ClassVar[Sequence[Published]] = PUBLISHED
    expected: ClassVar[Sequence[Expected]] = EXPECTED
    values: Mapping[str, Any] = field(default_factory=dict)
    solving: Solving = AS_PUBLISHED
    strength: Literal["walk", "person", "all"] = "walk"
    walks: int = _WALKS

    def trial(self, seed: int, *, pictures: bool = False) -> Trial:
        """Numbers of tables 1 to 5 for one seed."""
        file, (first, *others) = scenario_of(_SCENARIO, self.values), seeds_of(seed, self.walks)
        counted, found = counted_walks(file, first), solutions(file, first, self.solving)
        drawn = tuple(trial_pictures(counted, found)) if pictures else ()
        told = [self._numbers(file, first, counted, found)]
        told += [
            self._numbers(
                file, each, counted_walks(file, each), solutions(file, each, self.solving)
            )
            for each in others
        ]
        means = {key: float(values.mean()) for key, values in stacked(told).items()}
        return Trial(numbers=means, pictures=drawn)

    def _numbers(
        self,
        file: ScenarioFile,
        seed: int,
        counted: Mapping[str, CountedWalk],
        found: Solutions,
    ) -> dict[Key, float]:
        known = (
            known_walks(found.recording)
            if self.strength == "walk"
            else known_by_walkers(file, seed, same=self.strength == "all")
        )
        return {
            **dict(step_numbers(counted)),
            **dict(length_numbers(known)),
            **dict(heading_numbers(found, self.solving)),
            **dict(position_numbers(found)),
        }

    def overview(self, numbers: Mapping[Key, Numbers]) -> Sequence[Picture]:
        """Tables 2 to 5 over all seeds, beside what was published."""
        return tuple(overview_pictures(numbers))


def seeds_of(seed: int, walks: int = _WALKS) -> list[int]:
    """Seeds of the walks that make up one trial."""
    draws = Draws(seed=seed, purpose="walks of a trial").generator()
    return [int(each) for each in draws.integers(SEED_LIMIT, size=walks, dtype=np.uint64)]


EXPERIMENT = MapEkf()
