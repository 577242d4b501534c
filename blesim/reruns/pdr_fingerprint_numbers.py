"""What the paper on dead reckoning and four-direction fingerprints prints, and what it claims."""

from itertools import product

from blesim.reruns.base import Expected, Key, Published

PATHS = ("simple", "complex")
WITHOUT, WITH = "without correction", "with correction"
MODES = (WITHOUT, WITH)
MAX, MEAN, VARIANCE, MSE = "max [m]", "mean [m]", "variance [m2]", "MSE [m2]"
STATISTICS = (MAX, MEAN, VARIANCE, MSE)
DIRECTIONS = ("0 degrees", "90 degrees", "180 degrees", "270 degrees")
BEACONS = ("beacon 1 [dBm]", "beacon 2 [dBm]", "beacon 3 [dBm]", "beacon 4 [dBm]")

_TABLE_3 = {
    ("simple", WITHOUT): (5.49, 1.99, 2.02, 5.99),
    ("simple", WITH): (2.49, 0.63, 0.26, 0.66),
    ("complex", WITHOUT): (5.03, 2.25, 1.32, 6.41),
    ("complex", WITH): (3.05, 0.90, 0.47, 1.28),
}
# Section 3.3.1: RSSI of the four beacons at the point (8, 9), looking each way.
POINT_DBM = (
    (-66.0, -85.0, -76.0, -79.0),
    (-79.0, -84.0, -76.0, -81.0),
    (-72.0, -85.0, -79.0, -77.0),
    (-71.0, -79.0, -74.0, -69.0),
)


def error_key(path: str, mode: str, statistic: str) -> Key:
    """A number of table 3."""
    return Key("table 3", f"{path}, {mode}", statistic)


def stand_key(path: str, mode: str, statistic: str) -> Key:
    """The same at the ends of the stands alone, which the paper does not give."""
    return Key("at the ends of stands", f"{path}, {mode}", statistic)


def signal_key(direction: str, beacon: str) -> Key:
    """A number of the sample vectors."""
    return Key("section 3.3.1, point (8, 9)", direction, beacon)


# By how much the RSSI of one and the same beacon differs between directions: the most of the four.
TURNED = Key("section 3.3.1, point (8, 9)", "between directions", "most of a beacon [dB]")

PUBLISHED = (
    *(
        Published(key=error_key(path, mode, statistic), value=value)
        for (path, mode), row in _TABLE_3.items()
        for statistic, value in zip(STATISTICS, row, strict=True)
    ),
    # A ratio of levels in dBm says nothing; and which beacon is which, and where the point lies
    # among them, is not told.
    *(
        Published(key=signal_key(direction, beacon), value=value, compared=False)
        for direction, row in zip(DIRECTIONS, POINT_DBM, strict=True)
        for beacon, value in zip(BEACONS, row, strict=True)
    ),
    # Of beacon 1, -66 dBm at 0 degrees and -79 dBm at 90 degrees.
    Published(key=TURNED, value=13.0),
)

# The paper claims that the correction makes every figure less, and that both paths are alike.
EXPECTED = tuple(
    Expected(
        better=error_key(path, WITH, statistic),
        worse=error_key(path, WITHOUT, statistic),
        condition=f"{path} path",
        strong=statistic == MEAN,
    )
    for path, statistic in product(PATHS, STATISTICS)
)
