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

import numpy as np

from blesim.reruns.base import Expected, Key, Numbers, Picture, Published, Trial
from blesim.reruns.map_ekf_gait import (
    CountedWalk,
    counted_walks,
    known_walks,
    length_numbers,
    step_numbers,
)
from blesim.reruns.map_ekf_numbers import EXPECTED, PUBLISHED
from blesim.reruns.map_ekf_pictures import overview_pictures, trial_pictures
from blesim.reruns.map_ekf_walk import Solutions, heading_numbers, position_numbers, solutions
from blesim.reruns.sites import scenario_of
from blesim.reruns.statistics import stacked
from blesim.rng import SEED_LIMIT, Draws

_SCENARIO = "campus-corridor"
_WALKS = 10


class MapEkf:
    """The experiment; see `blesim.reruns.base.Experiment`."""

    paper = "map-ekf"
    title = "Dead reckoning with map-compensated headings, alone and fused with beacons"
    published: Sequence[Published] = PUBLISHED
    expected: Sequence[Expected] = EXPECTED

    def trial(self, seed: int, *, pictures: bool = False) -> Trial:
        """Numbers of tables 1 to 5 for one seed."""
        file, (first, *others) = scenario_of(_SCENARIO), seeds_of(seed)
        counted, found = counted_walks(file, first), solutions(file, first)
        drawn = tuple(trial_pictures(counted, found)) if pictures else ()
        told = [_numbers(counted, found)]
        told += [_numbers(counted_walks(file, each), solutions(file, each)) for each in others]
        means = {key: float(values.mean()) for key, values in stacked(told).items()}
        return Trial(numbers=means, pictures=drawn)

    def overview(self, numbers: Mapping[Key, Numbers]) -> Sequence[Picture]:
        """Tables 2 to 5 over all seeds, beside what was published."""
        return tuple(overview_pictures(numbers))


def seeds_of(seed: int) -> list[int]:
    """Seeds of the walks that make up one trial."""
    draws = Draws(seed=seed, purpose="walks of a trial").generator()
    return [int(each) for each in draws.integers(SEED_LIMIT, size=_WALKS, dtype=np.uint64)]


def _numbers(counted: Mapping[str, CountedWalk], found: Solutions) -> dict[Key, float]:
    return {
        **dict(step_numbers(counted)),
        **dict(length_numbers(known_walks(found.recording))),
        **dict(heading_numbers(found)),
        **dict(position_numbers(found)),
    }


EXPERIMENT = MapEkf()
