"""What the paper on map-compensated headings prints: tables 1 to 5, and which number is less."""

from collections.abc import Iterator, Sequence
from itertools import combinations

from blesim.reruns.base import Expected, Key, Published

STEPS, LENGTHS, HEADINGS = "table 1", "table 2", "table 3"
SOLUTIONS, DENSITIES = "table 4", "table 5"

# Table 1: thresholds in seconds with an exact count, and around them with one within 5 %.
_RANGES_S = {
    "walk, straight": (0.13, 0.36, 0.04, 0.36),
    "walk, turning": (0.11, 0.28, 0.03, 0.28),
    "run, straight": (0.14, 0.15, 0.03, 0.24),
    "run, turning": (0.14, 0.14, 0.13, 0.15),
}
GAITS = tuple(_RANGES_S)
BEST_FROM, BEST_TO, BEST_WIDTH = "exact from [s]", "exact to [s]", "exact, width [s]"
NEAR_FROM, NEAR_TO = "within 5 % from [s]", "within 5 % to [s]"
AT_DEFAULT, AT_LEAST = "wrong count at 0.14 s [%]", "counted at 0.01 s [-]"

# Table 2: lengths of the seven walks by each model, in m, and what the text makes of them.
DISTANCES_M = (40.5, 71.4, 43.2, 39.5, 81.6, 211.68, 179.0)
_LENGTHS_M = {
    "Eq 6": (38.608, 73.766, 43.348, 40.421, 81.526, 213.771, 182.391),
    "Eq 7": (41.411, 71.372, 44.799, 38.894, 82.381, 209.381, 178.707),
    "Eq 8": (38.427, 73.065, 46.227, 39.895, 81.520, 215.612, 175.950),
}
MODELS = tuple(_LENGTHS_M)
OFF_MEAN, OFF_MOST, OFF_VARIANCE = "mean off [m]", "most off [m]", "variance of off [m2]"
_OFF = {
    "Eq 6": (1.555, 3.391, 1.50),
    "Eq 7": (0.931, 2.299, 0.61),
    "Eq 8": (2.032, 3.932, 2.04),
}

# Table 3: mean and largest error of the azimuth in degrees, raw and compensated.
_AZIMUTHS = {
    90: (17.92, 28.63, 6.20, 15.81),
    180: (5.84, 12.09, 1.62, 4.06),
    270: (16.17, 22.72, 2.28, 17.52),
    305: (10.99, 20.54, 5.06, 18.18),
}
AZIMUTHS_DEG = tuple(_AZIMUTHS)
RAW_MEAN, RAW_MOST = "raw, mean [deg]", "raw, most [deg]"
MENDED_MEAN, MENDED_MOST = "compensated, mean [deg]", "compensated, most [deg]"

# Tables 4 and 5: least, mean and largest error in m.
LEAST, MEAN, MOST = "least [m]", "mean [m]", "most [m]"
_SOLUTIONS_M = {
    "OHPDR": (2.00, 22.67, 44.85),
    "AHPDR": (2.00, 5.42, 6.79),
    "BEPDR": (0.34, 4.12, 12.21),
    "EKFPDR": (0.25, 2.26, 5.09),
}
_DENSITIES_M = {10: (0.41, 3.97, 5.95), 15: (0.36, 3.15, 5.42), 20: (0.25, 2.26, 5.09)}
BEACONS = tuple(_DENSITIES_M)
# How far off the positions begin: "the error accumulated from the initial 2 m".
START_OFF_M = 2.0


def beacons_row(beacons: int) -> str:
    """Row of table 5."""
    return f"{beacons} beacons"


def azimuth_row(azimuth_deg: float) -> str:
    """Row of table 3."""
    return f"{azimuth_deg:g} deg"


def length_column(distance_m: float) -> str:
    """Column of table 2 for a walk of known length."""
    return f"length of {distance_m:g} m [m]"


def _row(
    table: str,
    row: str,
    columns: Sequence[str],
    values: Sequence[float],
    *,
    compared: bool = True,
) -> Iterator[Published]:
    for column, value in zip(columns, values, strict=True):
        yield Published(key=Key(table, row, column), value=value, compared=compared)


def _published() -> Iterator[Published]:
    for row, (begin, end, near_begin, near_end) in _RANGES_S.items():
        ends = (BEST_FROM, BEST_TO, NEAR_FROM, NEAR_TO)
        yield from _row(STEPS, row, ends, (begin, end, near_begin, near_end))
        # The width says what the ends have said; nothing is a multiple of 0.
        widths = (BEST_WIDTH, AT_DEFAULT, AT_LEAST)
        width_s = round(end - begin, 2)
        yield from _row(STEPS, row, widths, (width_s, 0.0, 0.0), compared=False)
    for row, off in _OFF.items():
        yield from _row(LENGTHS, row, (OFF_MEAN, OFF_MOST, OFF_VARIANCE), off)
        # The walks are as long as the paper's, so that all models come near these.
        lengths = tuple(map(length_column, DISTANCES_M))
        yield from _row(LENGTHS, row, lengths, _LENGTHS_M[row], compared=False)
    for azimuth_deg, errors_deg in _AZIMUTHS.items():
        columns = (RAW_MEAN, RAW_MOST, MENDED_MEAN, MENDED_MOST)
        yield from _row(HEADINGS, azimuth_row(azimuth_deg), columns, errors_deg)
    for row, values in _SOLUTIONS_M.items():
        # Solutions I and II have their least error at the start, which the scenario is given.
        given = values[0] == START_OFF_M
        yield from _row(SOLUTIONS, row, (LEAST,), values[:1], compared=not given)
        yield from _row(SOLUTIONS, row, (MEAN, MOST), values[1:])
    for beacons, values in _DENSITIES_M.items():
        yield from _row(DENSITIES, beacons_row(beacons), (LEAST, MEAN, MOST), values)


PUBLISHED = tuple(_published())


def _expected() -> Iterator[Expected]:
    printed = {each.key: each.value for each in PUBLISHED}

    def ordered(a: Key, b: Key, condition: str, *, strong: bool = False) -> Iterator[Expected]:
        if printed[a] != printed[b]:
            better, worse = (a, b) if printed[a] < printed[b] else (b, a)
            yield Expected(better=better, worse=worse, condition=condition, strong=strong)

    straight, turning, runs, runs_round = (Key(STEPS, row, BEST_WIDTH) for row in GAITS)
    yield from ordered(runs, straight, "straight on")
    yield from ordered(runs_round, turning, "around a corner")
    yield from ordered(turning, straight, "walking")
    yield from ordered(runs_round, runs, "running")
    for column in (OFF_MEAN, OFF_MOST, OFF_VARIANCE):
        for a, b in combinations(MODELS, 2):
            yield from ordered(Key(LENGTHS, a, column), Key(LENGTHS, b, column), "seven walks")
    for row in map(azimuth_row, AZIMUTHS_DEG):
        for mended, raw in ((MENDED_MEAN, RAW_MEAN), (MENDED_MOST, RAW_MOST)):
            yield from ordered(Key(HEADINGS, row, mended), Key(HEADINGS, row, raw), "same steps")
    for column in (LEAST, MEAN, MOST):
        for a, b in combinations(_SOLUTIONS_M, 2):
            strong = column == MEAN and {a, b} in _STRONG
            one, other = Key(SOLUTIONS, a, column), Key(SOLUTIONS, b, column)
            yield from ordered(one, other, "same walk", strong=strong)
    for column in (LEAST, MEAN, MOST):
        for few, many in combinations(BEACONS, 2):
            strong = column == MEAN and (few, many) == (10, 20)
            one, other = (Key(DENSITIES, beacons_row(count), column) for count in (few, many))
            yield from ordered(one, other, "EKFPDR, same walk", strong=strong)


_STRONG = ({"EKFPDR", "BEPDR"}, {"BEPDR", "OHPDR"}, {"EKFPDR", "OHPDR"}, {"AHPDR", "OHPDR"})
EXPECTED = tuple(_expected())
