"""People walking with counted steps and a phone in the hand, in a pocket or in a bag.

The carrying modes are fitted on the walks whose names end in 1 and 3; scored are those that end in
2 and 4. A walk's duration, its step rate and where the phone was are given to the twin; nobody
measured how fast people walked, so that the twin's speed is that at which its gait has the rate.
"""

import csv
import gzip
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np

from blesim.columns import CARRYINGS
from blesim.errors import DataError
from blesim.fidelity.comparison import Comparison
from blesim.fidelity.felt import FeltWalk, Piece, carried, felt_of, piece_of, pieces, step_rate_hz
from blesim.fidelity.gait_statistics import attitude_statistics, gait_panels, gait_statistics
from blesim.fidelity.scorecard import Statistic, scorecard
from blesim.fidelity.twin_ways import speed_at_m_s, straight_on
from blesim.imu.feel import feel
from blesim.imu.magnetics import Magnetics
from blesim.imu.sensors import ImuSettings
from blesim.walkers.gait import Gait, steps_of

# Where the phone was, and the way of carrying that stands for it. Armband and neck pouch have none.
CARRIED: Mapping[str, str] = MappingProxyType(
    {
        "inhand": "hand",
        "swingingarm": "swinging",
        "frontpocket": "pocket",
        "backpocket": "pocket",
        "purse": "bag",
    }
)
FITTED_ENDS = ("1", "3")
SCORED_ENDS = ("2", "4")
PIECE_S = 30.0
# One twin of a walk is one person; a way of carrying is judged by what several do.
TWINS = 5
# What lies between people cannot be told from one walk.
_FEWEST_WALKS = 2


def read_walks(path: Path, ends: Sequence[str]) -> list[FeltWalk]:
    """The walks whose names end so and whose way of carrying is known, as far as they are there.

    Parameters
    ----------
    path : Path
        Folder of the data set.
    ends : sequence of str
        Last characters of the names.

    Raises
    ------
    DataError
        If a file is damaged, or the index or every walk is missing.
    """
    index = path / "index.csv"
    try:
        with open(index, encoding="utf-8", newline="") as lines:
            rows = [(row["recording"], row["position"]) for row in csv.DictReader(lines)]
    except FileNotFoundError as fault:
        raise DataError(f"{index}: not there; give the folder of the data set") from fault
    except (OSError, KeyError, UnicodeDecodeError, csv.Error) as fault:
        raise DataError(f"{index}: damaged, or not of the data set ({fault})") from fault
    wanted = [
        (path / f"{name}_50hz.csv.gz", name, CARRIED[position.lower()])
        for name, position in rows
        if name.endswith(tuple(ends)) and position.lower() in CARRIED
    ]
    walks = [_walk(file, name, carrying) for file, name, carrying in wanted if file.is_file()]
    if not walks:
        raise DataError(f"{path}: none of the {len(wanted)} walks of the index is there")
    return walks


def _walk(file: Path, name: str, carrying: str) -> FeltWalk:
    try:
        with gzip.open(file, "rt", encoding="utf-8") as lines:
            table = np.loadtxt(lines, delimiter=",", skiprows=1, ndmin=2)
        time_s, axes = table[:, 0], table[:, 1:4]
        if len(table) < 2 or axes.shape[1] != 3 or not np.isfinite(table).all():
            raise ValueError("it needs rows of t_s,ax,ay,az")
    except (OSError, EOFError, zlib.error, ValueError, IndexError) as fault:
        raise DataError(f"{file}: damaged, or not of the data set ({fault})") from fault
    return FeltWalk(
        name=name,
        carrying=carrying,
        time_s=time_s,
        acceleration_m_s2=axes,
        angular_rate_rad_s=np.empty((0, 3)),
        magnetic_field_ut=np.empty((0, 3)),
    )


def twin_of(walk: FeltWalk, number: int, seed: int) -> FeltWalk:
    """The same phone carried the same way at the same step rate, simulated.

    Parameters
    ----------
    walk : FeltWalk
        Whose duration, step rate and way of carrying are taken over.
    number : int
        Which of its twins; each is another person.
    seed : int
        Of the simulation.
    """
    walker = f"{walk.name} {number}"
    gait = Gait()
    rates_hz = [step_rate_hz(piece) for piece in pieces(walk, PIECE_S)]
    trajectory = straight_on(speed_at_m_s(float(np.mean(rates_hz)), gait), float(walk.time_s[-1]))
    imu = feel(
        ImuSettings(),
        Magnetics(),
        trajectory,
        steps_of(trajectory, gait, seed, walker),
        carried(walk.carrying),
        seed,
        walker,
    ).imu
    return felt_of(walk.name, walk.carrying, imu)


def compare_walks(path: Path, seed: int) -> Comparison:
    """Walks beside their twins, by way of carrying.

    Parameters
    ----------
    path : Path
        Folder of the data set.
    seed : int
        Of the simulation.

    Raises
    ------
    DataError
        If the data set cannot be read.
    """
    walks = read_walks(path, SCORED_ENDS)
    ways = [way for way, _ in CARRYINGS if len(_carried(walks, way)) >= _FEWEST_WALKS]
    real = [walk for walk in walks if walk.carrying in ways]
    sides = real, [twin_of(walk, number, seed) for walk in real for number in range(TWINS)]
    cut = [{way: _pieces_of(_carried(side, way)) for way in ways} for side in sides]
    cards = [
        scorecard(*(statistics_of(way, _carried(side, way)) for side in sides)) for way in ways
    ]
    return Comparison(
        title=f"oxford_steps: {len(real)} walks, {', '.join(ways)}",
        scores=tuple(score for card in cards for score in card),
        panels=tuple(p for way in ways for p in gait_panels(way, *(side[way] for side in cut))),
    )


def statistics_of(carrying: str, walks: Sequence[FeltWalk]) -> list[Statistic]:
    """All statistics of walks on which the phone was carried in one way."""
    return [
        *gait_statistics(carrying, _pieces_of(walks)),
        *attitude_statistics(carrying, [piece_of(walk) for walk in walks]),
    ]


def _carried(walks: Sequence[FeltWalk], carrying: str) -> list[FeltWalk]:
    return [walk for walk in walks if walk.carrying == carrying]


def _pieces_of(walks: Sequence[FeltWalk]) -> list[Piece]:
    return [piece for walk in walks for piece in pieces(walk, PIECE_S)]
