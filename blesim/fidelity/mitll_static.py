"""People standing with a phone in front of a sniffer, in an anechoic chamber and in a room.

Every recording, a cell, is one placement of a phone on the body at one of eight angles. The
parameters are fitted on two placements, ear and back pocket (`fit_rooms`); scored are the other
two, front pocket and purse. The roles are the other way round than in `radio`: here the phone
sends; path loss is reciprocal.
"""

import csv
import gzip
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from uuid import NAMESPACE_URL, uuid5

import numpy as np
import shapely
from numpy.typing import NDArray

from blesim.errors import DataError
from blesim.fidelity.comparison import Comparison, refuse_silent
from blesim.fidelity.links import standing_at
from blesim.fidelity.room_statistics import Cell, room_panels, room_statistics
from blesim.fidelity.scorecard import scorecard
from blesim.radio.air import Air
from blesim.radio.collisions import Collisions
from blesim.radio.environments import ENVIRONMENTS
from blesim.radio.phone import Phone, Receiver, Scanner
from blesim.radio.propagation import Propagation
from blesim.units import to_s
from blesim.venue.beacons import CHANNELS, INTERVAL_STEP_S, Beacon
from blesim.venue.floor_plan import FloorPlan, Level
from blesim.venue.venue import Venue

Numbers = NDArray[np.float64]

# Where each is recorded, and the preset that stands for it.
ROOMS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "chamber": ("nrf52_1-May_Anechoic_Chamber.csv.gz", "chamber"),
        "room": ("nrf52_5-May_Conference_Room.csv.gz", "office"),
    }
)
_HOME = "https://github.com/mitll/BLE-RSSI-Various-Static-Configurations"
DISTANCE_M = 1.83
FITTED_PLACEMENTS = ("ear_left", "back_pocket")
SCORED_PLACEMENTS = ("front_pocket_left", "purse_right")
_HEIGHT_M = 1.2
# A recording of two or three seconds says nothing about seconds.
_SHORTEST_S = 10.0


def read_room(path: Path, room: str, placements: Sequence[str]) -> list[Cell]:
    """The cells of a room with some placements, short ones left out.

    Parameters
    ----------
    path : Path
        Folder of the data set.
    room : str
        ``chamber`` or ``room``.
    placements : sequence of str
        Which of them.

    Raises
    ------
    DataError
        If the file is missing or damaged.
    """
    file = path / ROOMS[room][0]
    try:
        with gzip.open(file, "rt", encoding="utf-8", newline="") as lines:
            cells = _cells(list(csv.DictReader(lines)))
    except FileNotFoundError as fault:
        raise DataError(f"{file}: not there; give the folder of the data set") from fault
    except (OSError, EOFError, zlib.error, KeyError, TypeError, ValueError) as fault:
        raise DataError(f"{file}: damaged, or not of the data set ({fault})") from fault
    kept = [c for c in cells if c.placement in placements and c.duration_s >= _SHORTEST_S]
    if not kept:
        raise DataError(f"{file}: no recording of {' or '.join(placements)} in it")
    return kept


def _cells(rows: Sequence[Mapping[str, str]]) -> list[Cell]:
    found: dict[tuple[str, int, int], list[tuple[float, float, int]]] = {}
    for row in rows:
        key = row["placement"], int(row["angle"]), int(row["rep"])
        reading = float(row["t_s"]), float(row["rssi"]), int(row["ch"])
        found.setdefault(key, []).append(reading)
    return [_cell(*key, sorted(readings)) for key, readings in sorted(found.items())]


def _cell(
    placement: str, angle_deg: int, rep: int, readings: Sequence[tuple[float, float, int]]
) -> Cell:
    time_s, rssi_dbm, channel = zip(*readings, strict=True)
    return Cell(
        placement=placement,
        angle_deg=angle_deg,
        rep=rep,
        time_s=np.array(time_s),
        rssi_dbm=np.array(rssi_dbm),
        channel=np.array(channel),
    )


def room_twin(real: Sequence[Cell], radio: Propagation, seed: int) -> list[Cell]:
    """The same people standing at the same angles, simulated.

    Each placement is a walker of its own in a spot of its own, and the level at one metre is that
    of the mean over all angles of the placement: transmit power and antenna are the phone's.

    Parameters
    ----------
    real : sequence of Cell
        Whose angles, durations and packet rates are taken over.
    radio : Propagation
        How signals travel.
    seed : int
        Of the simulation.
    """
    alone = radio.model_copy(update={"collisions": Collisions(model="none")})
    powers_dbm = placement_power_dbm(real, radio)
    return [
        _twin_of(cell, powers_dbm[cell.placement], alone, seed, number)
        for number, cell in enumerate(real)
    ]


def placement_power_dbm(cells: Sequence[Cell], radio: Propagation) -> dict[str, float]:
    """Level at one metre of each placement, facing the sniffer. [dBm]."""
    loss_db = 10.0 * radio.path_loss_exponent * np.log10(DISTANCE_M) + radio.people.body_loss_db / 2
    names = sorted({cell.placement for cell in cells})
    return {
        name: float(loss_db + np.nanmean([c.levels_dbm() for c in cells if c.placement == name]))
        for name in names
    }


def _twin_of(cell: Cell, power_dbm: float, radio: Propagation, seed: int, number: int) -> Cell:
    # A spot of its own for every cell: nobody turns within a millimetre of the same place.
    x_m = 2.0 + 3.0 * number
    venue = _spot(cell, x_m, power_dbm, number)
    trajectory = standing_at(x_m, 2.0, cell.heading_rad, cell.duration_s)
    phone = Phone(
        scanner=Scanner(all_channels=True),
        receiver=Receiver(random_loss=0.09),
        height_m=_HEIGHT_M,
        tells_channel=True,
    )
    air = Air.over(venue, radio, seed, int(trajectory.time_us[-1]) + 1)
    walker = f"{cell.placement} {cell.angle_deg} {cell.rep}"
    readings = air.heard_by(phone, walker, trajectory, keep_packets=False).readings
    return Cell(
        placement=cell.placement,
        angle_deg=cell.angle_deg,
        rep=cell.rep,
        time_s=to_s(readings.time_us),
        rssi_dbm=readings.rssi_dbm.astype(np.float64),
        channel=readings.channel.astype(np.int64),
    )


def _spot(cell: Cell, x_m: float, power_dbm: float, number: int) -> Venue:
    """A floor with the sniffer in direction 0 of the person."""
    beacon = Beacon(
        id=f"sniffer {number}",
        uuid=uuid5(
            NAMESPACE_URL, "https://github.com/mitll/BLE-RSSI-Various-Static-Configurations"
        ),
        major=1,
        minor=number,
        x_m=x_m + DISTANCE_M,
        y_m=2.0,
        z_m=_HEIGHT_M,
        tx_power_dbm=0.0,
        measured_power_dbm=power_dbm,
        advertising_interval_s=_interval_s(cell),
    )
    bounds = shapely.box(x_m - 2.0, 0.0, x_m + 4.0, 4.0)
    return Venue(
        name="spot",
        floor_plan=FloorPlan(levels=(Level(level=0, bounds=bounds),)),
        beacons=(beacon,),
    )


def _interval_s(cell: Cell) -> float:
    """Advertising interval that gives the same number of packets with 9 % lost."""
    events = np.median([len(cell.on(channel)[0]) for channel in CHANNELS]) / 0.91
    between_s = cell.duration_s / float(events) - 0.005
    return max(0.02, round(between_s / INTERVAL_STEP_S) * INTERVAL_STEP_S)


def compare_rooms(path: Path, radio: Propagation | None, seed: int) -> Comparison:
    """Chamber and room beside their twins.

    Parameters
    ----------
    path : Path
        Folder of the data set.
    radio : Propagation or None
        How signals travel in both; the presets ``chamber`` and ``office`` if None.
    seed : int
        Of the simulation.

    Raises
    ------
    DataError
        If the data set cannot be read.
    UsageError
        If the twin hears next to nothing.
    """
    real = {room: read_room(path, room, SCORED_PLACEMENTS) for room in ROOMS}
    simulated = {
        room: room_twin(cells, radio or ENVIRONMENTS[ROOMS[room][1]], seed)
        for room, cells in real.items()
    }
    for room in ROOMS:
        refuse_silent(*(sum(len(c.rssi_dbm) for c in side[room]) for side in (real, simulated)))
    scores = [
        scorecard(room_statistics(room, real[room]), room_statistics(room, simulated[room]))
        for room in ROOMS
    ]
    return Comparison(
        title="mitll_static: chamber and conference room, front pocket and purse",
        scores=tuple(score for card in scores for score in card),
        panels=tuple(p for room in ROOMS for p in room_panels(room, real[room], simulated[room])),
    )
