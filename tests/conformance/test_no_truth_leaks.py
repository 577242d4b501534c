"""What really happened changes no estimate: with nonsense for truth, the tracks are the same."""

from types import MappingProxyType

import h5py
import numpy as np
import pytest

from blesim.dataset.reader import read_recording
from blesim.dataset.writer import write_recording
from blesim.estimators.practice import practice_recording
from blesim.estimators.registry import estimator_names, make_estimator
from blesim.estimators.run import run
from blesim.recording import Truth, WalkTruth
from blesim.tables import StepTruth, Trajectory


def walked(walk) -> WalkTruth:
    """The way between the marks, at a steady pace."""
    marks = walk.observations.marks
    nowhere = np.full(len(marks), np.nan)
    return WalkTruth(
        trajectory=Trajectory(
            time_us=marks.time_us,
            x_m=marks.x_m,
            y_m=marks.y_m,
            level=marks.level,
            heading_rad=np.zeros(len(marks)),
            speed_m_s=np.ones(len(marks)),
            edge=np.full(len(marks), -1),
            offset_m=nowhere,
            edge_speed_m_s=nowhere,
            state=np.ones(len(marks)),
        ),
        steps=StepTruth(
            time_us=marks.time_us,
            length_m=np.ones(len(marks)),
            heading_rad=np.zeros(len(marks)),
            foot=np.zeros(len(marks)),
        ),
    )


@pytest.fixture(scope="module")
def two_files(tmp_path_factory):
    """A recording with its truth, and the same with nonsense for truth."""
    folder = tmp_path_factory.mktemp("truth")
    recording = practice_recording()
    truth = Truth(
        venue=recording.venue,
        walks=MappingProxyType({walk.name: walked(walk) for walk in recording.walks}),
    )
    paths = folder / "true.h5", folder / "nonsense.h5"
    for path in paths:
        write_recording(path, recording, truth)
    changed = 0
    with h5py.File(paths[1], "r+") as file:
        for group in ("truth/trajectory", "truth/steps"):
            for dataset in file[group].values():
                if dataset.dtype.kind == "f" and len(dataset) and not dataset.is_scale:
                    dataset[...] = 77.0
                    changed += 1
    assert changed > 6
    return [read_recording(path) for path in paths]


@pytest.mark.parametrize("name", estimator_names())
def test_truth_changes_no_estimate(two_files, name):
    label, estimator = make_estimator(name)
    tracks = [run(estimator, r, r.by_name["there"], seed=1, label=label) for r in two_files]
    assert len(tracks[0])
    assert tracks[0] == tracks[1]
