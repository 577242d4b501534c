"""The parameter search of the aisle-graph paper: whatever has the least mean error on run 1.

The paper prints what its search chose, not what it chose from. The grids here are made of its text
and of its choices:

- windows of 1 to 3 s (section VII A), by seconds;
- alpha and alpha_p: 0.25, 0.5 and 0.75 were chosen (table 1), so by quarters, and 1, no smoothing;
- sigma of the same aisle: 4 dB was chosen, of the others 5 and 6 dB (tables 1 and 3), so by 1 dB;
  V_d: 2.5 and 3.0 m/s were chosen, so by 0.5 m/s; each with one step more on either side;
- V_max: 4 and 6 m/s, those chosen.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from itertools import product
from typing import TypeVar

from blesim.estimators.base import Estimator
from blesim.estimators.beacon_pair import BeaconPair
from blesim.estimators.graph_particle_filter import GraphParticleFilter
from blesim.estimators.graph_tunings import PRESETS
from blesim.estimators.nearest_beacon import NearestBeacon
from blesim.metrics.position_error import position_errors
from blesim.ranging.smoothing import SignalKind
from blesim.recording import Recording, Truth, Walk
from blesim.reruns.aisle_graph_numbers import AVERAGED, NEAREST, PAIR, PARTICLES, particles_row
from blesim.reruns.base import Numbers
from blesim.reruns.followed import followed, learned
from blesim.tables import Track

E = TypeVar("E", bound=Estimator)
# What a search chooses from, by row of the paper's tables.
Grids = Mapping[str, Sequence[Estimator]]

WINDOWS_S = (1.0, 2.0, 3.0)
RATES = (0.25, 0.5, 0.75, 1.0)
SPREADS_SAME_DB = (3.0, 4.0, 5.0)
SPREADS_OTHER_DB = (4.0, 5.0, 6.0, 7.0)
VELOCITY_SPREADS_M_S = (2.0, 2.5, 3.0, 3.5)
VELOCITY_LIMITS_M_S = (4.0, 6.0)
# All settings draw the same random numbers, so that they are compared by what they are.
LABEL = "aisle-graph"
BASELINE_PARTICLES = 500


def searched() -> Grids:
    """What every row of the tables was chosen from."""
    filters = {particles_row(count): particle_filters(count) for count in PARTICLES}
    return _without_particles() | filters


def methods_searched() -> Grids:
    """The three methods of table 2 alone: other numbers of particles take most of the time."""
    return _without_particles() | {
        particles_row(BASELINE_PARTICLES): particle_filters(BASELINE_PARTICLES)
    }


def methods_searched_wider() -> Grids:
    """The three methods, the particle filter with smaller sigma and V_d than the paper chose."""
    settings = product((1.0, 2.0, 3.0, 4.0), (2.0, 4.0, 6.0), (0.5, 1.0, 2.0, 3.0), (2.0, 4.0))
    return _without_particles() | {
        particles_row(BASELINE_PARTICLES): _filters(BASELINE_PARTICLES, settings)
    }


def printed() -> Grids:
    """What the paper chose, with nothing else to choose from."""
    presets = (PRESETS["table-3-250"], PRESETS["table-1-500"], PRESETS["table-3-1000"])
    return {
        NEAREST: (NearestBeacon(signal="highest", window_s=3.0),),
        AVERAGED: (NearestBeacon(signal="averaged", window_s=3.0, rate=0.25),),
        PAIR: (BeaconPair(signal="averaged", window_s=3.0, rate=0.75, output_rate=0.5),),
        **{
            particles_row(tuning.particles): (GraphParticleFilter(**asdict(tuning)),)
            for tuning in presets
        },
    }


def _without_particles() -> dict[str, Sequence[Estimator]]:
    return {NEAREST: nearest_highest(), AVERAGED: nearest_averaged(), PAIR: beacon_pairs()}


def nearest_highest() -> Sequence[NearestBeacon]:
    """Grid of the nearest beacon by Eq 4."""
    return [NearestBeacon(signal="highest", window_s=window_s) for window_s in WINDOWS_S]


def nearest_averaged() -> Sequence[NearestBeacon]:
    """Grid of the nearest beacon by Eq 3."""
    return [
        NearestBeacon(signal="averaged", window_s=window_s, rate=rate)
        for window_s, rate in product(WINDOWS_S, RATES)
    ]


def beacon_pairs() -> Sequence[BeaconPair]:
    """Grid of the beacon pair, by Eq 3 and by Eq 4, which has no rate."""
    signals: list[tuple[SignalKind, float]] = [("averaged", rate) for rate in RATES]
    return [
        BeaconPair(signal=signal, window_s=window_s, rate=rate, output_rate=output_rate)
        for (signal, rate), window_s, output_rate in product(
            [*signals, ("highest", 1.0)], WINDOWS_S, RATES
        )
    ]


def particle_filters(particles: int) -> Sequence[GraphParticleFilter]:
    """Grid of the particle filter."""
    settings = product(SPREADS_SAME_DB, SPREADS_OTHER_DB, VELOCITY_SPREADS_M_S, VELOCITY_LIMITS_M_S)
    return _filters(particles, settings)


def _filters(
    particles: int, settings: Iterable[tuple[float, float, float, float]]
) -> Sequence[GraphParticleFilter]:
    return [
        GraphParticleFilter(
            particles=particles,
            spread_same_db=same_db,
            spread_other_db=other_db,
            velocity_spread_m_s=spread_m_s,
            velocity_limit_m_s=limit_m_s,
        )
        for same_db, other_db, spread_m_s, limit_m_s in settings
    ]


def best_of(grid: Iterable[E], recording: Recording, truth: Truth, run: str, seed: int) -> E:
    """The settings with the least mean error on a run; of equals the first."""
    return min(grid, key=lambda each: errors_m(each, recording, truth, run, seed).mean())


def errors_m(
    estimator: Estimator,
    recording: Recording,
    truth: Truth,
    run: str,
    seed: int,
    label: str = LABEL,
) -> Numbers:
    """Errors after every reading of a run, (n,); another label is other random numbers. [m]."""
    walk = recording.by_name[run]
    track = tracked(estimator, recording, walk, seed, label)
    trajectory = truth.walks[run].trajectory
    return position_errors(walk.observations.readings, trajectory, track).error_m


def tracked(
    estimator: Estimator, recording: Recording, walk: Walk, seed: int, label: str = LABEL
) -> Track:
    """Track of one run.

    Raises
    ------
    DataError
        If the estimator fails.
    """
    return followed(learned(estimator, recording, label), recording, walk, seed, label)
