"""Recordings written and read, against h5py alone with the same columns, chunks and filters.

Both sides make a temporary file, write every column, bring the file to the disk and rename it;
both read every column whole, from the operating system's cache.
"""

import os
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import h5py
import numpy as np
from measure import Row, speed_ratio

from blesim import columns
from blesim.dataset.reader import read_recording
from blesim.dataset.writer import write_recording
from blesim.recording import Observations, Provenance, Recording, Walk
from blesim.tables import Readings
from blesim.venue.layouts import wholesale_section

_READINGS = 4_000_000
_ROUNDS = 9
_LIBRARY = ("v110", "v110")


def _recording() -> Recording:
    venue = wholesale_section()
    rng = np.random.default_rng(1)
    readings = Readings(
        time_us=np.cumsum(rng.integers(0, 20_000, _READINGS)),
        beacon=rng.integers(0, len(venue.beacons), _READINGS),
        rssi_dbm=np.clip(np.rint(rng.normal(-80, 8, _READINGS)), -100, -40),
        channel=rng.integers(37, 40, _READINGS),
    )
    walk = Walk(name="w", walker="p", phone="x", observations=Observations(readings=readings))
    provenance = Provenance(title="benchmark", source="blesim")
    return Recording(venue=venue, walks=(walk,), provenance=provenance)


class _Files:
    """One recording, written and read in both ways."""

    def __init__(self) -> None:
        self.folder = TemporaryDirectory()
        self.ours = Path(self.folder.name) / "ours.h5"
        self.bare = Path(self.folder.name) / "bare.h5"
        self.recording = _recording()
        self.readings = self.recording.walks[0].observations.readings
        self.write_ours()
        self.storage = self._storage()
        self.write_bare()

    def _storage(self) -> dict[str, dict[str, object]]:
        """How blesim stores each column, to store it in the same way."""
        kept = ("dtype", "chunks", "compression", "compression_opts", "shuffle", "fletcher32")
        with h5py.File(self.ours) as file:
            group = file[columns.RSSI.group]
            return {
                column.name: {name: getattr(group[column.name], name) for name in kept}
                for column in columns.RSSI.columns
            }

    def write_ours(self) -> None:
        write_recording(self.ours, self.recording)

    def write_bare(self) -> None:
        part = self.bare.with_suffix(".part")
        with h5py.File(part, "w", libver=_LIBRARY) as file:
            for column, values in zip(columns.RSSI.columns, self.readings.arrays(), strict=True):
                file.create_dataset(column.name, data=values, **self.storage[column.name])
        for path in (part, part.parent):
            handle = os.open(path, os.O_RDONLY)
            os.fsync(handle)
            os.close(handle)
            if path is part:
                part.replace(self.bare)

    def read_ours(self) -> Recording:
        return read_recording(self.ours)

    def read_bare(self) -> list[object]:
        with h5py.File(self.bare) as file:
            return [file[column.name][()] for column in columns.RSSI.columns]


@cache
def _files() -> _Files:
    files = _Files()
    assert read_recording(files.ours).walks[0].observations.readings == files.readings
    return files


def write_ratio() -> float:
    """Speed of `write_recording` as a part of that of bare h5py."""
    return speed_ratio(_files().write_ours, _files().write_bare, rounds=_ROUNDS)


def read_ratio() -> float:
    """Speed of `read_recording` as a part of that of bare h5py."""
    return speed_ratio(_files().read_ours, _files().read_bare, rounds=_ROUNDS)


ROWS = [
    Row(name="HDF5 write / bare h5py", unit="x", goal=">= 0.8", measure=write_ratio),
    Row(name="HDF5 read / bare h5py", unit="x", goal=">= 0.8", measure=read_ratio),
]
