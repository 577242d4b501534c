"""What the channel-separate paper [1]_ printed: its numbers, and which should be less than which.

Table 3 prints the proposed rows of tables 1 and 2 once more: it is here as orderings alone.

References
----------
.. [1] Channel-separate regression, fingerprints and EKF, 2016; digest "channel-separate-ekf".
"""

from itertools import product

from blesim.reruns.base import Expected, Key, Published

DEPLOYMENTS = ("dense", "sparse")
TRAJECTORIES = {"trajectory-1": "I", "trajectory-2": "II"}
PM, FP, PROPOSED = METHODS = ("PM + EKF", "FP + EKF", "proposed")
COLUMNS = ("50 % [m]", "90 % [m]", "mean [m]", "RMS [m]")
CHANNEL_NAMES = ("channel 37", "channel 38", "channel 39")
AGGREGATE = "aggregate"
DEGREES = (1, 2, 3, 4, 5)

_FAR = "90 % error [m]"
_TABLE = {"dense": "table 1", "sparse": "table 2"}
_HEADLINE, _BOTH, _LESS = "headline", "90 % of both [m]", "below, of both [%]"

# Rows of the printed tables: deployment, trajectory, method, then the columns.
_PRINTED = (
    ("dense", "I", PM, 2.44, 4.06, 2.57, 2.81),
    ("dense", "I", FP, 1.48, 3.00, 1.67, 1.91),
    ("dense", "I", PROPOSED, 1.46, 2.57, 1.59, 1.74),
    ("dense", "II", PM, 2.49, 3.92, 2.59, 2.76),
    ("dense", "II", FP, 1.89, 3.08, 1.96, 2.12),
    ("dense", "II", PROPOSED, 1.72, 2.55, 1.72, 1.84),
    ("sparse", "I", PM, 3.72, 6.68, 3.93, 4.46),
    ("sparse", "I", FP, 2.47, 5.35, 2.83, 3.40),
    ("sparse", "I", PROPOSED, 1.70, 4.16, 2.07, 2.44),
    ("sparse", "II", PM, 4.60, 9.31, 5.59, 6.20),
    ("sparse", "II", FP, 1.80, 4.52, 2.27, 2.75),
    ("sparse", "II", PROPOSED, 1.63, 3.59, 1.89, 2.27),
)


def error_key(deployment: str, trajectory: str, method: str, column: str) -> Key:
    """Key of a position error: tables 1 and 2."""
    return Key(_TABLE[deployment], f"{trajectory}, {method}", column)


def both_key(deployment: str, method: str) -> Key:
    """Key of the 90 % error, mean of both trajectories."""
    return Key(_HEADLINE, f"{deployment}, {method}", _BOTH)


def reduction_key(deployment: str, method: str) -> Key:
    """Key of how much less the proposed 90 % error is, mean of the reductions of both."""
    return Key(_HEADLINE, f"{deployment}, proposed below {method}", _LESS)


def still_key(channel: str, column: str) -> Key:
    """Key of the RSSI of a phone that lies still: figure 1."""
    return Key("figure 1", channel, column)


def spread_key(model: str) -> Key:
    """Key of the distance error that 90 % of the channels stay below: figure 5."""
    return Key("figure 5", model, _FAR)


def example_key(model: str) -> Key:
    """Key of the distance error on a channel: figure 7."""
    return Key("figure 7", model, _FAR)


def beacon_key(mode: str) -> Key:
    """Key of the distance error on a beacon, its channels apart or not: figure 8."""
    return Key("figure 8", mode, _FAR)


def place_key(mode: str) -> Key:
    """Key of the error of fingerprints alone: figure 9."""
    return Key("figure 9", mode, _FAR)


def heard_key(deployment: str, column: str) -> Key:
    """Key of the number of channels observed at a time: figure 11."""
    return Key("figure 11", deployment, column)


LEVEL, EXPONENT = Key("Eq 32", "PM", "RSSI at 1 m [dBm]"), Key("Eq 32", "PM", "exponent [-]")
MEAN_RSSI, RSSI_SPREAD = "mean [dBm]", "standard deviation [dB]"
FEWEST, MOST = "fewest [-]", "most [-]"


def poly(degree: int) -> str:
    """Name of a polynomial in the paper; that of degree 2 is its PRM."""
    return f"POLY{degree}"


def _ranging() -> list[Published]:
    still = zip(CHANNEL_NAMES, (-71.9, -68.1, -78.8), (2.4, 0.8, 2.7), strict=True)
    found = []
    for channel, mean_dbm, spread_db in still:
        # A ratio of levels in dBm says nothing.
        mean = Published(key=still_key(channel, MEAN_RSSI), value=mean_dbm, compared=False)
        found += [mean, Published(key=still_key(channel, RSSI_SPREAD), value=spread_db)]
    found += [
        Published(key=LEVEL, value=-79.5891, compared=False),
        Published(key=EXPONENT, value=1.2954),
    ]
    printed = {
        spread_key("PM"): 3.8,
        spread_key(poly(2)): 3.1,
        example_key("PM"): 5.5,
        example_key(poly(2)): 2.6,
    }
    modes = (*CHANNEL_NAMES, AGGREGATE)
    printed |= zip(map(beacon_key, modes), (5.1, 5.2, 5.0, 6.3), strict=True)
    printed |= zip(map(place_key, modes), (6.9, 7.0, 7.0, 7.2), strict=True)
    # How strong the scenario's beacons are was set by these.
    heard = {heard_key("dense", FEWEST): 5.0, heard_key("dense", MOST): 19.0}
    heard |= {heard_key("sparse", FEWEST): 0.0, heard_key("sparse", MOST): 9.0}
    found += [Published(key=key, value=value, compared=False) for key, value in heard.items()]
    return found + [Published(key=key, value=value) for key, value in printed.items()]


def _positions() -> list[Published]:
    printed = {
        error_key(*row[:3], column): value
        for row in _PRINTED
        for column, value in zip(COLUMNS, row[3:], strict=True)
    }
    for deployment, values in (("dense", (3.99, 3.04, 2.56)), ("sparse", (8.00, 4.94, 3.88))):
        printed |= zip((both_key(deployment, each) for each in METHODS), values, strict=True)
    printed |= {
        reduction_key("dense", PM): 35.82,
        reduction_key("dense", FP): 15.77,
        reduction_key("sparse", PM): 49.58,
        reduction_key("sparse", FP): 21.41,
    }
    return [Published(key=key, value=value) for key, value in printed.items()]


def _of_ranging() -> list[Expected]:
    models = "all channels, dense"
    found = [
        Expected(better=key(poly(2)), worse=key("PM"), condition=models)
        for key in (spread_key, example_key)
    ]
    found += [
        Expected(better=key(channel), worse=key(AGGREGATE), condition="dense")
        for key, channel in product((beacon_key, place_key), CHANNEL_NAMES)
    ]
    return found + [
        Expected(better=heard_key("sparse", each), worse=heard_key("dense", each), condition="both")
        for each in (FEWEST, MOST)
    ]


def _of_methods() -> list[Expected]:
    pairs = ((PROPOSED, FP), (FP, PM), (PROPOSED, PM))
    found = [
        Expected(
            better=error_key(deployment, trajectory, better, column),
            worse=error_key(deployment, trajectory, worse, column),
            condition=f"{deployment}, trajectory {trajectory}",
        )
        for deployment, trajectory in product(DEPLOYMENTS, TRAJECTORIES.values())
        for (better, worse), column in product(pairs, COLUMNS)
    ]
    return found + [
        Expected(
            better=both_key(deployment, better),
            worse=both_key(deployment, worse),
            condition=f"{deployment}, both trajectories",
            # Of issue 6: proposed < FP + EKF < PM + EKF with sparse beacons.
            strong=deployment == "sparse" and (better, worse) != (PROPOSED, PM),
        )
        for deployment, (better, worse) in product(DEPLOYMENTS, pairs)
    ]


def _of_deployments() -> list[Expected]:
    printed = {each.key: each.value for each in PUBLISHED}
    found = []
    for trajectory, column in product(TRAJECTORIES.values(), COLUMNS):
        # The median of trajectory II is the one that was less with sparse beacons.
        keys = [error_key(each, trajectory, PROPOSED, column) for each in DEPLOYMENTS]
        better, worse = sorted(keys, key=printed.__getitem__)
        condition = f"proposed, trajectory {trajectory}"
        found.append(Expected(better=better, worse=worse, condition=condition))
    return found + [
        Expected(
            better=reduction_key("dense", method),
            worse=reduction_key("sparse", method),
            condition="the proposed gains more with sparse beacons",
        )
        for method in (PM, FP)
    ]


PUBLISHED = (*_ranging(), *_positions())
EXPECTED = (*_of_ranging(), *_of_methods(), *_of_deployments())
