"""Table 1 of the digest "map-heading-ekf": the time thresholds at which the step count is exact.

Simulated walks and runs take the place of the recorded ones: the phone held flat, 50 Hz. Run this
file to write the table of the docs anew.
"""

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import blesim
from blesim.columns import CARRYINGS, NO_EDGE, STATES
from blesim.imu.feel import feel
from blesim.imu.magnetics import Magnetics
from blesim.imu.sensors import ImuSettings
from blesim.pdr.multi_threshold import MultiThreshold, MultiThresholdDetector
from blesim.pdr.steps import step_signal_m_s2
from blesim.tables import Carrying, Trajectory
from blesim.walkers.gait import Gait, steps_of

PAGE = Path(blesim.__file__).parent / "docs" / "fidelity.md"
SEED = 1
SEEDS = (1, 2, 3, 4, 5)
INTERVALS_S = tuple(round(0.01 * i, 2) for i in range(41))
# Assumed: people walk and run at their pace after a second, and stop within one.
STANDING_S, RAMP_S, TURNING_S = 2.0, 1.0, 0.5


@dataclass(frozen=True, kw_only=True)
class Pattern:
    """A row of the table: what was done, how many steps, which thresholds counted them exactly."""

    name: str
    steps: int
    speed_m_s: float
    turns: bool
    published: str


# Walked at 1.5 to 1.8 m/s; how fast was run is not told.
PATTERNS = (
    Pattern(name="walk straight", steps=56, speed_m_s=1.6, turns=False, published="0.13 to 0.36"),
    Pattern(name="walk with turn", steps=122, speed_m_s=1.6, turns=True, published="0.11 to 0.28"),
    Pattern(name="run straight", steps=45, speed_m_s=3.0, turns=False, published="0.14 to 0.15"),
    Pattern(name="run with turn", steps=86, speed_m_s=3.0, turns=True, published="0.14"),
)
WALKS, RUNS = PATTERNS[:2], PATTERNS[2:]


def course(pattern, steady_s):
    """Stand, set off, keep the speed, turn half-way, stop, stand."""
    speed, rate = pattern.speed_m_s, pattern.speed_m_s / RAMP_S
    half_s = (steady_s - TURNING_S) / 2
    spans_s = np.array([STANDING_S, RAMP_S, half_s, TURNING_S, half_s, RAMP_S, STANDING_S])
    speeds = np.array([0.0, 0.0, speed, speed, speed, speed, 0.0, 0.0])
    rates = np.array([0.0, rate, 0, 0, 0, -rate, 0, 0])
    turned = np.pi / 2 if pattern.turns else 0.0
    headings = np.array([0.0, 0, 0, 0, turned, turned, turned, turned])
    way = (speeds[:-1] + rates[:-1] * spans_s / 2) * spans_s
    # On a turn the way leads along the mean of the two headings.
    along = (headings[:-1] + headings[1:]) / 2
    standing, walking = dict(STATES)["standing"], dict(STATES)["walking"]
    return Trajectory(
        time_us=np.round(np.append(0.0, np.cumsum(spans_s)) * 1e6).astype(int),
        x_m=np.append(0.0, np.cumsum(way * np.cos(along))),
        y_m=np.append(0.0, np.cumsum(way * np.sin(along))),
        level=np.zeros(8, int),
        heading_rad=headings,
        speed_m_s=speeds,
        acceleration_m_s2=rates,
        edge=np.full(8, NO_EDGE),
        offset_m=np.full(8, np.nan),
        edge_speed_m_s=np.full(8, np.nan),
        state=np.array([standing, *[walking] * 5, standing, standing]),
    )


@cache
def felt(pattern, seed):
    """Times and signal of the shortest course with as many steps as the pattern has."""
    steady_s = 0.3 * pattern.steps
    steps = ()
    while len(steps) < pattern.steps:
        steady_s += 0.05
        trajectory = course(pattern, steady_s)
        steps = steps_of(trajectory, Gait(), seed, pattern.name)
    assert len(steps) == pattern.steps
    carrying = Carrying(time_us=np.zeros(1, int), carrying=np.array([dict(CARRYINGS)["flat"]]))
    imu = feel(ImuSettings(), Magnetics(), trajectory, steps, carrying, seed, pattern.name).imu
    return imu.time_us, step_signal_m_s2(imu)


@cache
def counts(pattern, seed):
    """Number of steps found with each of `INTERVALS_S`."""
    found = []
    for interval_s in INTERVALS_S:
        detector = MultiThresholdDetector(MultiThreshold(interval_s=interval_s))
        found.append(len(detector.advance(*felt(pattern, seed))) + len(detector.finish()))
    return np.array(found)


def band(pattern, seed, within=0.0):
    """First and last threshold around 0.14 s with a count within a share of the exact one."""
    good = np.abs(counts(pattern, seed) - pattern.steps) <= within * pattern.steps
    here = INTERVALS_S.index(0.14)
    if not good[here]:
        return None
    first = here - np.argmin(np.append(good[here::-1], False)) + 1
    last = here + np.argmin(np.append(good[here:], False)) - 1
    return INTERVALS_S[first], INTERVALS_S[last]


def told(bounds):
    return "none" if bounds is None else f"{bounds[0]:.2f} to {bounds[1]:.2f}"


def table():
    rows = [
        ("pattern", "steps", "published, exact [s]", "simulated, exact [s]", "within 5 % [s]"),
        ("---",) * 5,
        *(
            (
                pattern.name,
                str(pattern.steps),
                pattern.published,
                told(band(pattern, SEED)),
                told(band(pattern, SEED, within=0.05)),
            )
            for pattern in PATTERNS
        ),
    ]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def place():
    return re.compile(r"(?<=<!-- table 1 -->\n\n).*?(?=\n\n<!-- end -->)", re.DOTALL)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("pattern", PATTERNS, ids=lambda pattern: pattern.name)
def test_the_published_threshold_counts_exactly(pattern, seed):
    bounds = band(pattern, seed)
    assert bounds is not None
    assert bounds[0] < bounds[1]


def test_the_band_is_narrower_for_running():
    # Its upper end is the shortest interval of a walk, so that one walk may have a narrow band.
    def mean_width(patterns):
        bounds = [band(pattern, seed) for pattern in patterns for seed in SEEDS]
        return np.mean([last - first for first, last in bounds])

    assert mean_width(RUNS) < mean_width(WALKS) - 0.01


@pytest.mark.parametrize("pattern", PATTERNS, ids=lambda pattern: pattern.name)
def test_outside_the_band_steps_are_lost(pattern):
    found = counts(pattern, SEED)
    assert found[0] == found[1] == 0
    assert found[-1] < pattern.steps


def test_the_page_holds_the_table():
    found = place().search(PAGE.read_text(encoding="utf-8"))
    assert found is not None
    assert found[0] == table()


if __name__ == "__main__":
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(place().sub(table(), text), encoding="utf-8")
