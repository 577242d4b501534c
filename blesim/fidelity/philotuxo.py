"""The hall of Danis et al. beside its twin: fixed points and moving tracks.

Set 1 of the fixed points is what the hall's parameters are fitted on (`fit_hall`), and the level of
each receiver; scored are set 2, measured four months later, and the tracks. Of each point the first
five minutes count, which is what there is of set 1.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from blesim.dataset.exchange.philotuxo import read_philotuxo
from blesim.fidelity.comparison import Comparison, refuse_silent
from blesim.fidelity.hall_statistics import (
    POINT_HEIGHT_M,
    TRACK_HEIGHT_M,
    Hall,
    hall_panels,
    hall_statistics,
)
from blesim.fidelity.scorecard import scorecard
from blesim.radio.air import Air
from blesim.radio.collisions import Collisions
from blesim.radio.environments import ENVIRONMENTS
from blesim.radio.phone import Phone, Receiver, Scanner
from blesim.radio.propagation import Propagation
from blesim.recording import Observations, Walk, WalkTruth
from blesim.units import MICROSECONDS_PER_SECOND

Numbers = NDArray[np.float64]
Walks = Sequence[tuple[Walk, WalkTruth]]

LONGEST_S = 300

# A host controller's default scan interval and window are 10 ms. Events 450 to 460 ms apart shift
# by 0 to 10 ms against a cycle of three such windows, and fall into the same window with 1/2 after
# one event and 1/6 after two: that is the correlation over time that links of set 1 have when they
# stand still. Most of the 9 to 13 % of events that set 1 misses are then lost at the ends of the
# windows; random loss and noise are what is left of losses and spread.
RECEIVER = Receiver(noise_db=0.3, random_loss=0.06, sensitivity_dbm=-95.0, edge_db=2.3)
_SCANNER = Scanner(interval_ms=10.0, window_ms=10.0)


def read_hall(path: Path, split: str) -> Hall:
    """The tracks, and the fixed points of one set, cut to five minutes.

    Parameters
    ----------
    path : Path
        Folder of the data set.
    split : str
        ``set 1`` or ``set 2``.

    Raises
    ------
    DataError
        If it cannot be read.
    """
    imported = read_philotuxo(path)
    pairs = [(walk, imported.truth.walks[walk.name]) for walk in imported.recording.walks]
    return Hall(
        venue=imported.recording.venue,
        points=[_cut(walk, truth) for walk, truth in pairs if walk.split == split],
        tracks=[(walk, truth) for walk, truth in pairs if not walk.split],
    )


def _cut(walk: Walk, truth: WalkTruth) -> tuple[Walk, WalkTruth]:
    last_us = LONGEST_S * MICROSECONDS_PER_SECOND
    trajectory, seen = truth.trajectory, walk.observations
    if trajectory.time_us[-1] <= last_us:
        return walk, truth
    ends_us = np.array([0, last_us])
    return (
        replace(walk, observations=Observations(readings=seen.between(0, last_us).readings)),
        replace(truth, trajectory=replace(trajectory, time_us=ends_us)),
    )


def hall_twin(
    real: Hall, measured_power_dbm: Sequence[float], radio: Propagation, seed: int
) -> Hall:
    """The same points and tracks, simulated.

    Parameters
    ----------
    real : Hall
        Whose geometry and durations are taken over.
    measured_power_dbm : sequence of float
        Level at one metre of each receiver. [dBm]
    radio : Propagation
        How signals travel.
    seed : int
        Of the simulation.
    """
    levels = zip(real.venue.beacons, measured_power_dbm, strict=True)
    beacons = tuple(
        beacon.model_copy(update={"measured_power_dbm": float(level)}) for beacon, level in levels
    )
    venue = real.venue.with_beacons(beacons)
    longest_us = max(int(truth.trajectory.time_us[-1]) for _, truth in [*real.points, *real.tracks])
    # In the hall one beacon sends and twelve receivers listen: nothing collides.
    alone = radio.model_copy(update={"collisions": Collisions(model="none")})
    air = Air.over(venue, alone, seed, longest_us + 1)
    point = Phone(scanner=_SCANNER, receiver=RECEIVER, height_m=POINT_HEIGHT_M, held=False)
    track = point.model_copy(update={"height_m": TRACK_HEIGHT_M})
    return Hall(
        venue=venue,
        points=[_heard(air, point, *pair) for pair in real.points],
        tracks=[_heard(air, track, *pair) for pair in real.tracks],
    )


def _heard(air: Air, phone: Phone, walk: Walk, truth: WalkTruth) -> tuple[Walk, WalkTruth]:
    heard = air.heard_by(phone, walk.name, truth.trajectory, keep_packets=False)
    return replace(walk, observations=Observations(readings=heard.readings)), truth


def compare_hall(path: Path, radio: Propagation | None, seed: int) -> Comparison:
    """The hall and its twin.

    Parameters
    ----------
    path : Path
        Folder of the data set.
    radio : Propagation or None
        How signals travel; the preset ``hall`` if None.
    seed : int
        Of the simulation.

    Raises
    ------
    DataError
        If the data set cannot be read.
    UsageError
        If the twin hears next to nothing.
    """
    real = read_hall(path, "set 2")
    radio = ENVIRONMENTS["hall"] if radio is None else radio
    power_dbm = receiver_power_dbm(read_hall(path, "set 1"), radio.path_loss_exponent)
    simulated = hall_twin(real, power_dbm, radio, seed)
    refuse_silent(
        *(sum(len(link.rssi_dbm) for link in hall.point_links()) for hall in (real, simulated))
    )
    return Comparison(
        title="philotuxo: hall, set 2 and tracks",
        scores=scorecard(hall_statistics(real), hall_statistics(simulated)),
        panels=hall_panels(real, simulated),
    )


def receiver_power_dbm(hall: Hall, exponent: float) -> list[float]:
    """Level at one metre of each receiver, with one exponent for all: mean over the points. [dBm].

    Parameters
    ----------
    hall : Hall
        Set 1.
    exponent : float
        [-]
    """
    links = hall.point_links()
    at_1_m = [link.level_dbm + 10.0 * exponent * np.log10(link.distance_m[0]) for link in links]
    return [
        float(
            np.mean(
                [level for link, level in zip(links, at_1_m, strict=True) if link.beacon == row]
            )
        )
        for row in range(len(hall.venue.beacons))
    ]
