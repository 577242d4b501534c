"""The quick form: three seeds of every paper show the strong orderings, or cannot tell.

The seeds are fixed; what twenty show is in ``reruns.json`` and, where it differs from the papers,
explained in ``blesim/docs/reruns``.
"""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import pytest

from blesim.reruns.registry import PAPERS, experiment_of
from blesim.reruns.statistics import orderings_of, stacked

SEEDS = (1, 2, 3)
# Strong as published, and not shown here: over ten seeds the difference is +0.54 m (p = 0.06), the
# other way. The page of the paper says why.
UNDECIDED = {"channel-ekf": {("sparse, proposed", "sparse, FP + EKF", "sparse, both trajectories")}}


def numbers_of(task):
    paper, seed = task
    return dict(experiment_of(paper).trial(seed).numbers)


@pytest.fixture(scope="module")
def trials():
    tasks = [(paper, seed) for paper in PAPERS for seed in SEEDS]
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        found = dict(zip(tasks, pool.map(numbers_of, tasks), strict=True))
    return {paper: stacked([found[paper, seed] for seed in SEEDS]) for paper in PAPERS}


@pytest.mark.parametrize("paper", PAPERS)
def test_the_strong_orderings_hold(trials, paper):
    strong = [each for each in orderings_of(experiment_of(paper), trials[paper]) if each.strong]
    assert strong
    for each in strong:
        undecided = (each.better.row, each.worse.row, each.condition) in UNDECIDED.get(paper, ())
        assert each.held or (undecided and each.low < 0 < each.high), each
