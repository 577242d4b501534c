"""What the proximity paper [1]_ printed: its numbers, and which should be less than which.

References
----------
.. [1] Particle filter on beacon proximity and a floor map; digest "proximity-particle-filter".
"""

from collections.abc import Iterator
from itertools import product
from statistics import fmean

from blesim.reruns.base import Expected, Key, Published

A, B = "A: trilateration, map", "B: trilateration"
C, OURS = "C: proximity", "ours: proximity, map"
ALGORITHMS = (A, B, C, OURS)
TRIALS = (1, 2, 3, 4, 5)
POINTS = (1, 2)
MEAN, LEAST, MOST = "mean [m]", "min [m]", "max [m]"
# Eq 9, its footnote: printed, chosen, and too large.
PENALTIES = (-0.5, -5.0, -10.0)
CHOSEN_PENALTY = -5.0
# Figure 4: from 0 to 2.4 m in steps of a cell.
CELL_M = 0.3
RINGS_M = tuple(round(CELL_M * number, 1) for number in range(9))

# Table I: point 1 and point 2 of each trial. [m]
_ERRORS_M = {
    A: ((4.397, 6.094), (3.845, 5.430), (1.951, 5.960), (5.467, 4.355), (4.047, 5.656)),
    B: ((4.573, 3.029), (3.528, 5.361), (5.059, 5.585), (6.952, 2.965), (5.730, 6.427)),
    C: ((3.300, 3.605), (1.643, 1.326), (2.188, 0.085), (4.058, 3.762), (3.845, 3.297)),
    OURS: ((0.427, 0.806), (1.377, 0.940), (1.307, 0.974), (0.667, 1.000), (1.840, 0.650)),
}
_AVERAGES_M = {A: 4.72, B: 4.921, C: 2.711, OURS: 0.999}
_LESS_PERCENT = {A: 78.0, B: 79.0, C: 63.0}


def error_key(algorithm: str, trial: int, point: int) -> Key:
    """Key of one error of table I."""
    return Key("table I", algorithm, f"trial {trial}, point {point} [m]")


def summary_key(algorithm: str, column: str) -> Key:
    """Key of the mean, the least or the largest error of an algorithm."""
    return Key("table I", algorithm, column)


def point_key(algorithm: str, point: int) -> Key:
    """Key of the mean error at a point over the trials, which the paper does not add up."""
    return Key("table I, columns", algorithm, f"point {point}, {MEAN}")


def less_key(algorithm: str) -> Key:
    """Key of how much less the mean error of the proposed algorithm is."""
    return Key("section IV-C", f"ours below {algorithm}", "mean error [%]")


def penalty_key(penalty: float) -> Key:
    """Key of the mean error of the proposed algorithm with another penalty."""
    return Key("equation 9", f"ours, penalty {penalty:g}", MEAN)


def share_key(ring_m: float) -> Key:
    """Key of the share of cells that measure Near, at a distance."""
    return Key("figure 4", f"d = {ring_m:.1f} m", "share Near [-]")


INTERCEPT = Key("figure 4", "line (Eq 5)", "P(0) [-]")
SLOPE = Key("figure 4", "line (Eq 5)", "slope [1/m]")
CELLS = Key("figure 3", "d = 2.4 m", "cells [-]")
IMMEDIATE = Key("figure 3", "all cells", "share Immediate [-]")


def published() -> tuple[Published, ...]:
    """Every number of the paper that is rerun."""
    return (*_of_cells(), *_of_table())


def _of_cells() -> Iterator[Published]:
    # A count of cells by geometry alone.
    yield Published(key=CELLS, value=56.0, compared=False)
    # There is no ratio to nothing.
    yield Published(key=IMMEDIATE, value=0.0, compared=False)
    yield Published(key=share_key(2.4), value=0.339)
    yield Published(key=INTERCEPT, value=1.1077)
    yield Published(key=SLOPE, value=-0.3053)


def _of_table() -> Iterator[Published]:
    for algorithm, trials in _ERRORS_M.items():
        every_m = [error_m for trial in trials for error_m in trial]
        yield Published(key=summary_key(algorithm, MEAN), value=_AVERAGES_M[algorithm])
        yield Published(key=summary_key(algorithm, LEAST), value=min(every_m))
        yield Published(key=summary_key(algorithm, MOST), value=max(every_m))
        for row, point in enumerate(POINTS):
            at_point_m = fmean(trial[row] for trial in trials)
            yield Published(key=point_key(algorithm, point), value=round(at_point_m, 4))
        # One walk of five that differ in nothing: its ratio to a mean over seeds says nothing.
        for trial, (row, point) in product(TRIALS, enumerate(POINTS)):
            key = error_key(algorithm, trial, point)
            yield Published(key=key, value=trials[trial - 1][row], compared=False)
    for algorithm, percent in _LESS_PERCENT.items():
        yield Published(key=less_key(algorithm), value=percent)


def expected() -> tuple[Expected, ...]:
    """Every ordering of the paper; of the least errors, which it prints, it says nothing."""
    return (*_of_means(), *_of_points(), *_of_largest(), *_of_penalties())


# "Outperforms the others in all the cases" (section IV-C), and what table I says of the others.
_STATED = ((OURS, C), (C, A), (C, B), (OURS, A), (OURS, B))


def _of_means() -> Iterator[Expected]:
    for better, worse in (*_STATED, (A, B)):
        yield Expected(
            better=summary_key(better, MEAN),
            worse=summary_key(worse, MEAN),
            condition="five trials, both points",
            strong=(better, worse) != (A, B),
        )


def _of_points() -> Iterator[Expected]:
    for point, (better, worse) in product(POINTS, _STATED):
        yield Expected(
            better=point_key(better, point),
            worse=point_key(worse, point),
            condition=f"five trials, point {point}",
        )


def _of_largest() -> Iterator[Expected]:
    for better, worse in (*_STATED, (A, B)):
        yield Expected(
            better=summary_key(better, MOST),
            worse=summary_key(worse, MOST),
            condition="largest of five trials, both points",
        )


def _of_penalties() -> Iterator[Expected]:
    # Told in words alone: -1 or more is too small, -10 or less too large.
    for penalty in PENALTIES:
        if penalty != CHOSEN_PENALTY:
            yield Expected(
                better=penalty_key(CHOSEN_PENALTY),
                worse=penalty_key(penalty),
                condition="five trials, both points; published in words",
            )
