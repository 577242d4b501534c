"""Invented surveys: readings at known places, without recordings around them."""

from types import SimpleNamespace

import numpy as np
import pytest

from blesim.dataset.exchange.philotuxo import read_philotuxo
from blesim.ranging.survey_readings import WALKING, SurveyReadings, survey_readings
from blesim.recording import WalkKind


@pytest.fixture(scope="session")
def hall(data_dir):
    """The philotuxo hall: its recording, its static points as a survey, its walks with truth."""
    imported = read_philotuxo(data_dir("philotuxo"))
    walks = []
    for walk in imported.recording.walks:
        if walk.kind == WalkKind.WALK:
            truth = imported.truth.walks[walk.name].trajectory
            readings = walk.observations.readings
            inside = (readings.time_us >= truth.time_us[0]) & (
                readings.time_us <= truth.time_us[-1]
            )
            readings = readings.rows(inside)
            walks.append((readings, truth.at(readings.time_us)))
    return SimpleNamespace(
        recording=imported.recording,
        venue=imported.recording.venue,
        survey=survey_readings([imported.recording]),
        walks=walks,
    )


@pytest.fixture(scope="session")
def readings_at():
    """Build survey readings of n rows; a single value stands for all of them."""

    def build(rssi_dbm, *, beacons=1, **columns):
        count = len(rssi_dbm)
        given = {"x_m": 0.0, "y_m": 0.0, "heading_rad": np.nan, **columns}
        whole = {"time_us": np.arange(count), "beacon": 0, "channel": 0, "proximity": 0}
        whole |= {"level": 0, "spot": WALKING, "walk": 0}

        def column(name, dtype, default):
            return np.array(np.broadcast_to(given.get(name, default), count), dtype)

        return SurveyReadings(
            beacons=beacons,
            rssi_dbm=np.array(rssi_dbm, np.float64),
            **{name: column(name, np.int64, default) for name, default in whole.items()},
            **{name: column(name, np.float64, 0.0) for name in ("x_m", "y_m", "heading_rad")},
        )

    return build
