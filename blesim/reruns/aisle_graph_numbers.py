"""What the aisle-graph paper [1]_ printed: its numbers, and which should be less than which.

References
----------
.. [1] The aisle-graph particle filter in a wholesale store, 2016;
   digest "aisle-graph-particle-filter".
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import TypeVar

from blesim.reruns.base import Expected, Key, Published

R = TypeVar("R")

NEAREST, PAIR, FILTER = METHODS = ("nearest beacon", "beacon pair", "particle filter")
AVERAGED = "nearest beacon, averaged"
RUNS = ("run-1", "run-2", "run-3")
PARTICLES = (250, 500, 1000)
# Columns of tables 2 and 3.
COLUMNS = ("run 1", "run 2", "run 3", "total")
TOTAL = COLUMNS[-1]
BANDS_M = ((2, 3), (4, 5), (8, 9))
SAME, OTHER = "same aisle", "other aisles"

# Means, then standard deviations, each of runs 1 to 3 and in total. [m]
_TABLE_2 = {
    NEAREST: ((2.15, 2.01, 1.82, 2.01), (1.49, 1.47, 1.35, 1.44)),
    PAIR: ((1.53, 1.78, 2.03, 1.76), (1.45, 1.62, 1.72, 1.59)),
    FILTER: ((1.04, 1.07, 1.44, 1.16), (0.97, 1.24, 1.31, 1.18)),
}
_TABLE_3 = {
    250: ((1.09, 1.11, 1.90, 1.33), (1.03, 1.26, 1.68, 1.32)),
    500: _TABLE_2[FILTER],
    1000: ((1.05, 1.02, 1.43, 1.15), (0.98, 1.17, 1.36, 1.17)),
}
# What the search on run 1 chose: table 1, and table 3 for other numbers of particles.
_CHOSEN: Mapping[str, Mapping[str, float]] = {
    NEAREST: {"window_s": 3.0},
    AVERAGED: {"window_s": 3.0, "rate": 0.25},
    PAIR: {"window_s": 3.0, "rate": 0.75, "output_rate": 0.5},
    "250 particles": {
        "spread_same_db": 4.0,
        "spread_other_db": 6.0,
        "velocity_spread_m_s": 3.0,
        "velocity_limit_m_s": 6.0,
    },
    "500 particles": {
        "spread_same_db": 4.0,
        "spread_other_db": 6.0,
        "velocity_spread_m_s": 2.5,
        "velocity_limit_m_s": 4.0,
    },
    "1000 particles": {
        "spread_same_db": 4.0,
        "spread_other_db": 5.0,
        "velocity_spread_m_s": 2.5,
        "velocity_limit_m_s": 4.0,
    },
}
_SYMBOLS = {
    "window_s": "window [s]",
    "rate": "alpha [-]",
    "output_rate": "alpha_p [-]",
    "spread_same_db": "sigma same [dB]",
    "spread_other_db": "sigma other [dB]",
    "velocity_spread_m_s": "V_d [m/s]",
    "velocity_limit_m_s": "V_max [m/s]",
}


def error_key(method: str, column: str, figure: str = "mean") -> Key:
    """Key of a position error of a method: table 2."""
    return Key("table 2", method, f"{column}, {figure} [m]")


def particles_key(particles: int, column: str, figure: str = "mean") -> Key:
    """Key of a position error of the particle filter: table 3."""
    return Key("table 3", particles_row(particles), f"{column}, {figure} [m]")


def particles_row(particles: int) -> str:
    """Row of a number of particles."""
    return f"{particles} particles"


def searched_key(row: str) -> Key:
    """Key of the least error that the search found on run 1: table 1."""
    return Key("table 1", row, "run 1, mean [m]")


def chosen_key(row: str, parameter: str) -> Key:
    """Key of a parameter that the search on run 1 chose: tables 1 and 3."""
    return Key("chosen on run 1", row, _SYMBOLS[parameter])


def welch_key(other: str, column: str) -> Key:
    """Key of Welch's test of the particle filter against another method."""
    return Key("Welch's t test, readings", f"{FILTER} below {other}", column)


def clustered_key(other: str, column: str) -> Key:
    """Key of the paired test over runs of the particle filter against another method."""
    return Key("paired t test, runs", f"{FILTER} below {other}", column)


def exponent_key(where: str) -> Key:
    """Key of a path loss exponent: figures 5 and 7."""
    return Key("figures 5 and 7", where, "exponent [-]")


def bump_key(column: str) -> Key:
    """Key of where the curve of the other aisles lies highest above Eq 1: figure 5."""
    return Key("figure 5", f"bump, {OTHER}", column)


def band_key(band_m: tuple[int, int], column: str) -> Key:
    """Key of the RSSI within a metre of range in the same aisle: figure 6."""
    return Key("figure 6", f"{band_m[0]} to {band_m[1]} m", column)


def parameters_of(row: str) -> Sequence[str]:
    """Names of the parameters that were chosen on run 1."""
    return tuple(_CHOSEN[row])


def _printed_chosen() -> Iterator[Published]:
    # Choices out of a grid that surrounds the printed ones: a ratio says more about the grid.
    for row, parameters in _CHOSEN.items():
        for name, value in parameters.items():
            yield Published(key=chosen_key(row, name), value=value, compared=False)


def _printed_errors() -> Iterator[Published]:
    for method, (means, spreads) in _TABLE_2.items():
        for column, mean, spread in zip(COLUMNS, means, spreads, strict=True):
            yield Published(key=error_key(method, column), value=mean)
            yield Published(key=error_key(method, column, "std"), value=spread)
    for count, (means, spreads) in _TABLE_3.items():
        for column, mean, spread in zip(COLUMNS, means, spreads, strict=True):
            # Those of 500 particles are compared in table 2.
            again = count == 500
            key, spread_key = (particles_key(count, column, each) for each in ("mean", "std"))
            yield Published(key=key, value=mean, compared=not again)
            yield Published(key=spread_key, value=spread, compared=not again)


PUBLISHED: Sequence[Published] = (
    # The scenario's path loss was set by these two.
    Published(key=exponent_key(SAME), value=1.0, compared=False),
    Published(key=exponent_key(OTHER), value=1.3, compared=False),
    # The contents of one store's shelves: where another's curve has its bump is chance.
    Published(key=bump_key("range [m]"), value=8.0, compared=False),
    *_printed_chosen(),
    Published(key=searched_key(AVERAGED), value=2.20),
    *_printed_errors(),
    Published(key=welch_key(PAIR, "t [-]"), value=-18.3),
    Published(key=welch_key(PAIR, "difference [m]"), value=0.5982),
    Published(key=welch_key(PAIR, "half of the 99 % interval [m]"), value=0.086),
    Published(key=welch_key(NEAREST, "difference [m]"), value=0.8403),
    Published(key=welch_key(NEAREST, "half of the 99 % interval [m]"), value=0.08),
)


def _orderings() -> Iterator[Expected]:
    yield Expected(
        better=error_key(NEAREST, "run 1"),
        worse=searched_key(AVERAGED),
        condition="run 1, each at its best",
    )
    for place, column in enumerate(COLUMNS):
        for better, worse in _by_mean(_TABLE_2, place):
            yield Expected(
                better=error_key(better, column),
                worse=error_key(worse, column),
                condition=column,
                strong=column == TOTAL,
            )
        for less, more in _by_mean(_TABLE_3, place):
            yield Expected(
                better=particles_key(less, column),
                worse=particles_key(more, column),
                condition=f"{column}, each at its best",
            )


def _by_mean(
    table: Mapping[R, tuple[tuple[float, ...], tuple[float, ...]]], place: int
) -> Iterator[tuple[R, R]]:
    """Every pair of rows of a table, the one with the lesser mean in a column first."""
    yield from combinations(sorted(table, key=lambda row: table[row][0][place]), 2)


# Every pair of methods, and of numbers of particles, by their mean errors.
EXPECTED: Sequence[Expected] = tuple(_orderings())
