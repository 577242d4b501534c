"""The library of Mendoza-Silva et al. beside its twin: bookcases, pillars and three phones.

Campaign 2 is what the parameters are fitted on (`fit_library`); scored is campaign 3, at other
points. Each fixed point has six scans of a second; the first of them starts the phone's scanner up
and hears nothing half of the time, so that it does not count.

Every point was visited twice, and at the second visit people looked the other way: nobody says so,
but what changes between the visits of a point follows the cosine of the direction to the beacon,
in campaign 2 along the map's y axis and in campaign 3 along its x axis. Those are the headings
given to both sides here.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from blesim.dataset.exchange.uji_library import read_uji_library
from blesim.fidelity.comparison import Comparison, refuse_silent
from blesim.fidelity.library_fit import LEVEL_DBM, LIBRARY
from blesim.fidelity.library_statistics import Library, library_panels, library_statistics
from blesim.fidelity.scorecard import scorecard
from blesim.radio.air import Air
from blesim.radio.environments import ENVIRONMENTS
from blesim.radio.phone import Phone
from blesim.radio.propagation import Propagation
from blesim.recording import Observations, Walk, WalkTruth
from blesim.tables import Marks
from blesim.units import MICROSECONDS_PER_SECOND, wrap_angle

Numbers = NDArray[np.float64]

FITTED, SCORED = "campaign 2", "campaign 3"
# Of the first visit to each point; see above.
_HEADINGS_RAD = MappingProxyType({FITTED: -np.pi / 2.0, SCORED: np.pi})


def read_library(path: Path, campaign: str) -> Library:
    """One campaign of the data set.

    Parameters
    ----------
    path : Path
        Folder of the data set.
    campaign : str
        ``campaign 2`` or ``campaign 3``.

    Raises
    ------
    DataError
        If it cannot be read.
    """
    imported = read_uji_library(path)
    walks = [walk for walk in imported.recording.walks if walk.split == campaign]
    truths = [imported.truth.walks[walk.name] for walk in walks]
    seen: set[tuple[str, float, float]] = set()
    turned = []
    for walk, truth in zip(walks, truths, strict=True):
        visit = walk.phone, float(truth.trajectory.x_m[0]), float(truth.trajectory.y_m[0])
        heading_rad = _HEADINGS_RAD[campaign] + (np.pi if visit in seen else 0.0)
        seen.add(visit)
        turned.append((walk, _looking(truth, float(wrap_angle(heading_rad)))))
    return Library(venue=imported.recording.venue, walks=turned)


def _looking(truth: WalkTruth, heading_rad: float) -> WalkTruth:
    both = np.full(len(truth.trajectory), heading_rad)
    return replace(truth, trajectory=replace(truth.trajectory, heading_rad=both))


def library_twin(
    real: Library, phones: Mapping[str, Phone], level_dbm: float, radio: Propagation, seed: int
) -> Library:
    """The same points and phones, simulated.

    Parameters
    ----------
    real : Library
        Whose geometry and numbers of scans are taken over.
    phones : mapping of str to Phone
        Profile of each phone.
    level_dbm : float
        At one metre, of all beacons. [dBm]
    radio : Propagation
        How signals travel.
    seed : int
        Of the simulation.
    """
    beacons = tuple(
        beacon.model_copy(update={"measured_power_dbm": level_dbm}) for beacon in real.venue.beacons
    )
    venue = real.venue.with_beacons(beacons)
    longest = max(len(walk.observations.marks) for walk, _ in real.walks)
    air = Air.over(venue, radio, seed, (longest + 1) * MICROSECONDS_PER_SECOND)
    return Library(
        venue=venue,
        walks=[_heard(air, phones[walk.phone], walk, truth) for walk, truth in real.walks],
    )


def _heard(air: Air, phone: Phone, walk: Walk, truth: WalkTruth) -> tuple[Walk, WalkTruth]:
    scans = len(walk.observations.marks)
    ends_us = np.arange(1, scans + 1) * MICROSECONDS_PER_SECOND
    marks = Marks(
        time_us=ends_us,
        x_m=walk.observations.marks.x_m,
        y_m=walk.observations.marks.y_m,
        level=walk.observations.marks.level,
    )
    trajectory = replace(truth.trajectory, time_us=np.array([0, ends_us[-1]]))
    readings = air.heard_by(phone, walk.name, trajectory, keep_packets=False).readings
    observations = Observations(readings=readings, marks=marks)
    return replace(walk, observations=observations), replace(truth, trajectory=trajectory)


def compare_library(path: Path, radio: Propagation | None, seed: int) -> Comparison:
    """Campaign 3 beside its twin.

    Parameters
    ----------
    path : Path
        Folder of the data set.
    radio : Propagation or None
        How signals travel; the preset ``library`` if None.
    seed : int
        Of the simulation.

    Raises
    ------
    DataError
        If the data set cannot be read.
    UsageError
        If the twin hears next to nothing.
    """
    real = read_library(path, SCORED)
    radio = ENVIRONMENTS["library"] if radio is None else radio
    simulated = library_twin(real, LIBRARY.profiles(), LEVEL_DBM, radio, seed)
    refuse_silent(
        *(
            sum(int(np.isfinite(point.rssi_dbm).sum()) for point in side.points())
            for side in (real, simulated)
        )
    )
    return Comparison(
        title="uji_library: campaign 3",
        scores=scorecard(library_statistics(real), library_statistics(simulated)),
        panels=library_panels(real, simulated),
    )
