"""A recording opens in programs that know nothing of blesim."""

from pathlib import Path

import h5py
import netCDF4
import numpy as np
import pytest
import xarray

from blesim import columns
from blesim.dataset.layout import RECORDED, attributes, dimension
from blesim.dataset.writer import write_recording
from blesim.recording import Recording, Truth

TABLES = (*columns.STATIC, *RECORDED)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory, recording: Recording, truth: Truth) -> Path:
    target = tmp_path_factory.mktemp("recording") / "a.h5"
    write_recording(target, recording, truth)
    return target


@pytest.mark.parametrize("engine", ["h5netcdf", "netcdf4"])
@pytest.mark.parametrize("stream", TABLES, ids=lambda stream: stream.group)
def test_xarray(path: Path, engine: str, stream: columns.Stream) -> None:
    with xarray.open_dataset(
        path, group=stream.group, engine=engine, decode_timedelta=False
    ) as table:
        assert list(table.sizes) == [dimension(stream)]
        for column in stream.columns:
            assert table[column.name].attrs["long_name"] == column.long_name
            assert table[column.name].attrs.get("units", "") == column.units


def test_xarray_sees_the_values(path: Path, recording: Recording) -> None:
    with xarray.open_dataset(path, group="rssi", decode_timedelta=False) as rssi:
        heard = np.concatenate([walk.observations.readings.rssi_dbm for walk in recording.walks])
        assert np.array_equal(rssi["rssi"].values, heard)
        assert rssi["time"].dtype == np.int64
        assert rssi["time"].attrs["units"] == "microseconds"
    with xarray.open_dataset(path, group="walks") as walks:
        assert walks["walk"].values.tolist() == ["radio map", "1", "2"]
        assert walks["walk"].attrs["cf_role"] == "trajectory_id"
        assert walks["rssi_row_size"].values.tolist() == [90, 700, 40]
        assert walks["rssi_row_size"].attrs["sample_dimension"] == "/rssi/obs"


def test_netcdf4(path: Path) -> None:
    with netCDF4.Dataset(path) as file:
        assert file.Conventions == "CF-1.11"
        assert int(file.seed) == 2**64 - 1
        channel = file["rssi"]["channel"]
        assert channel.dimensions == ("obs",)
        assert channel.flag_values.tolist() == [0, 37, 38, 39]
        assert channel.flag_meanings.split()[1] == "channel_37_2402_MHz"
        assert "obs" not in file["rssi"].variables
        assert '"FeatureCollection"' in file["venue"]["built"][...]


def test_plain_h5py(path: Path) -> None:
    with h5py.File(path, "r") as file:
        time = file["rssi/time"]
        assert (time.shuffle, time.compression, time.compression_opts) == (True, "gzip", 1)
        assert time.fletcher32
        assert time.chunks == (32768,)
        assert time.dims[0][0].name == "/rssi/obs"


@pytest.mark.parametrize("stream", [*TABLES, columns.TRACK], ids=lambda stream: stream.group)
def test_valid_range_is_exact_in_the_type_of_the_column(stream: columns.Stream) -> None:
    for column in stream.columns:
        if column.valid_range is not None:
            found = attributes(column)["valid_range"]
            assert found.dtype == column.numpy_dtype
            assert tuple(found.astype(float)) == column.valid_range
