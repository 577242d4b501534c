"""The phases of a scripted leg: speeding up, holding the pace, braking."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from blesim.units import MICROSECONDS_PER_SECOND, to_us
from blesim.walkers.motion import stretch_walked


@dataclass(frozen=True, slots=True, kw_only=True)
class Phase:
    """Part of a leg with one acceleration: how it begins, and how long it lasts."""

    way_m: float
    speed_m_s: float
    acceleration_m_s2: float
    duration_us: int


def steady(length_m: float, speed_m_s: float) -> list[Phase]:
    """The one phase of a leg at a steady pace, whose speed fits its whole microseconds."""
    duration_us = max(1, to_us(length_m / speed_m_s))
    exact_m_s = length_m / duration_us * MICROSECONDS_PER_SECOND
    return [Phase(way_m=0.0, speed_m_s=exact_m_s, acceleration_m_s2=0.0, duration_us=duration_us)]


def phases(
    start_m_s: float, pace_m_s: float, limit_m_s: float, length_m: float, rate_m_s2: float
) -> tuple[list[Phase], float]:
    """Phases of a leg with acceleration, and the speed at its end; see `stretch_walked`."""
    duration_s, held_m_s, end_m_s = stretch_walked(
        start_m_s, pace_m_s, limit_m_s, length_m, rate_m_s2
    )
    speeding_s = abs(held_m_s - start_m_s) / rate_m_s2
    braking_s = abs(held_m_s - end_m_s) / rate_m_s2
    sped_m = 0.5 * (start_m_s + held_m_s) * speeding_s
    brakes_m = length_m - 0.5 * (held_m_s + end_m_s) * braking_s
    times_us = [to_us(s) for s in (0.0, speeding_s, duration_s - braking_s, duration_s)]
    motions = (
        (0.0, start_m_s, float(np.sign(held_m_s - start_m_s)) * rate_m_s2),
        (sped_m, held_m_s, 0.0),
        (brakes_m, held_m_s, float(np.sign(end_m_s - held_m_s)) * rate_m_s2),
    )
    found = [
        Phase(way_m=way_m, speed_m_s=speed, acceleration_m_s2=rate, duration_us=until - since)
        for (way_m, speed, rate), (since, until) in zip(motions, pairwise(times_us), strict=True)
        if until > since
    ]
    return found, end_m_s


def passed_us(parts: Sequence[Phase], way_m: float, steady_us: float) -> int:
    """When a way into the leg has been walked, since its start. [us]."""
    if len(parts) == 1 and parts[0].acceleration_m_s2 == 0.0:
        return round(steady_us)
    row = max(r for r, part in enumerate(parts) if r == 0 or part.way_m <= way_m)
    part, before_us = parts[row], sum(each.duration_us for each in parts[:row])
    left_m, speed, rate = way_m - part.way_m, part.speed_m_s, part.acceleration_m_s2
    # The root that stays right when the rate is zero: t = 2 s / (v + sqrt(v^2 + 2 a s)).
    root = np.sqrt(max(speed * speed + 2.0 * rate * left_m, 0.0))
    within_us = to_us(2.0 * left_m / max(speed + float(root), 1e-9))
    return before_us + min(within_us, part.duration_us)
