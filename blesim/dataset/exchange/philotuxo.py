"""The hall of Danis et al.: one moving beacon, twelve fixed receivers, ground truth by camera.

Roles are reversed compared with a phone among beacons; path loss is reciprocal, so each fixed
receiver is taken as a beacon and the moving beacon as the phone. The data set is public (CC0):
github.com/philotuxo/Position-Annotated-BLE-RSSI-Dataset.
"""

import json
from pathlib import Path
from types import MappingProxyType
from uuid import NAMESPACE_URL, uuid5

import shapely
from pydantic import ValidationError

from blesim.dataset.exchange.imported import Imported
from blesim.dataset.exchange.philotuxo_surveys import read_surveys
from blesim.dataset.exchange.philotuxo_tracks import read_track
from blesim.errors import DataError
from blesim.recording import Provenance, Recording, Truth, Walk, WalkTruth
from blesim.venue.beacons import Beacon
from blesim.venue.floor_plan import FloorPlan, Level
from blesim.venue.venue import Venue

_HOME = "https://github.com/philotuxo/Position-Annotated-BLE-RSSI-Dataset"
_REFERENCES = (
    "Danis et al., Pervasive and Mobile Computing 81 (2022);"
    f" Danis et al., IEEE Access 9:37022 (2021); {_HOME}"
)
# Intercept of a log-distance fit to the static points: -61.5 dBm over set 1, -62.2 over set 2.
_MEASURED_POWER_DBM = -62.0
# Nobody says; 0 dBm is what such beacons come with.
_TX_POWER_DBM = 0.0
_INTERVAL_S = 0.45
_SETS = ("set_1", "set_2")


def read_philotuxo(path: Path) -> Imported:
    """Tracks as walks and static points as survey walks, with the truth of both.

    Parameters
    ----------
    path : Path
        Folder with ``cnf/`` and ``trk/*.mbd``; ``fingerprints_set_1.npz`` and ``_2`` if they
        are there.

    Returns
    -------
    Imported
        The channel is not told; readings above 0 dBm are glitches, dropped and counted.

    Raises
    ------
    DataError
        If the folder, its configuration or all tracks are missing, or an archive is damaged.
    """
    receivers = _receivers(path / "cnf" / "tetam.dev")
    venue = _hall(path / "cnf" / "tetam.par", receivers)
    row_of_mac = {mac: row for row, mac in enumerate(receivers)}
    found: list[tuple[Walk, WalkTruth]] = []
    glitches = unreadable = 0
    for file in _tracks(path):
        track = read_track(file, row_of_mac)
        found.append((track.walk, track.truth))
        glitches, unreadable = glitches + track.glitches, unreadable + track.unreadable
    for name in _SETS:
        file = path / f"fingerprints_{name}.npz"
        if file.exists():
            surveys = read_surveys(file, name.replace("_", " "), venue.beacon_row)
            found += surveys.walks
            glitches += surveys.glitches
    counts = {"readings above 0 dBm": glitches, "lines that cannot be read": unreadable}
    report = tuple(f"left out: {count} {what}" for what, count in counts.items() if count)
    return _imported(venue, found, report)


def _imported(
    venue: Venue, found: list[tuple[Walk, WalkTruth]], report: tuple[str, ...]
) -> Imported:
    provenance = Provenance(
        title="Hall with twelve fixed receivers and one moving beacon",
        source="philotuxo/Position-Annotated-BLE-RSSI-Dataset",
        license="CC0-1.0",
        references="; ".join([_REFERENCES, *report]),
    )
    walks = tuple(walk for walk, _ in found)
    truths = MappingProxyType({walk.name: truth for walk, truth in found})
    return Imported(
        recording=Recording(venue=venue, walks=walks, provenance=provenance),
        truth=Truth(venue=venue, walks=truths),
        report=report,
    )


def _tracks(path: Path) -> list[Path]:
    files = sorted((path / "trk").glob("*.mbd"))
    if not files:
        raise DataError(f"{path}: no trk/*.mbd in it; give the folder of the data set")
    return files


def _receivers(path: Path) -> dict[str, Beacon]:
    """Fixed receivers by MAC address, in the order of their aliases."""
    try:
        line = next(line for line in _text(path).splitlines() if line.startswith("Dongles:"))
        listed = json.loads(line.removeprefix("Dongles:"))
        found = [(mac, _beacon(alias, place)) for mac, (place, _, alias) in listed.items()]
    except (StopIteration, ValueError, TypeError, AttributeError, ValidationError) as fault:
        raise DataError(f"{path}: no list of receivers 'Dongles:' that can be read") from fault
    return dict(sorted(found, key=lambda item: item[1].id))


def _beacon(alias: str, place: list[float]) -> Beacon:
    """Receiver as a beacon; its identity is made up, but the same at every import."""
    x_m, y_m, z_m = place
    return Beacon(
        id=alias,
        uuid=uuid5(NAMESPACE_URL, _HOME),
        major=1,
        minor=int(alias.removeprefix("sensor")),
        x_m=x_m,
        y_m=y_m,
        z_m=z_m,
        tx_power_dbm=_TX_POWER_DBM,
        measured_power_dbm=_MEASURED_POWER_DBM,
        advertising_interval_s=_INTERVAL_S,
    )


def _hall(path: Path, receivers: dict[str, Beacon]) -> Venue:
    try:
        bounds = shapely.box(*json.loads(_text(path))["limits"])
    except (ValueError, TypeError, KeyError) as fault:
        raise DataError(f"{path}: no 'limits' of the hall that can be read") from fault
    return Venue(
        name="hall",
        floor_plan=FloorPlan(levels=(Level(level=0, bounds=bounds),)),
        beacons=tuple(receivers.values()),
    )


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except OSError as fault:
        raise DataError(f"{path}: cannot be read: {fault.strerror}") from fault
