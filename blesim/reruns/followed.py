"""Estimators on the walks of an experiment, where one that fails ends the trial."""

from blesim.errors import DataError
from blesim.estimators.base import Estimator
from blesim.estimators.run import fit, follow
from blesim.recording import Failure, Recording, Walk
from blesim.tables import Track


def learned(estimator: Estimator, recording: Recording, label: str) -> Estimator:
    """Copy of an estimator that has learned from the surveys of a recording.

    Raises
    ------
    DataError
        If it fails; the label says which it was.
    """
    fitted = fit(estimator, recording)
    if isinstance(fitted, Failure):
        raise DataError(f"{label}: {fitted.reason}")
    return fitted


def followed(
    estimator: Estimator, recording: Recording, walk: Walk, seed: int, label: str
) -> Track:
    """Track of a walk by an estimator that has learned.

    Parameters
    ----------
    estimator : Estimator
        As of `learned`.
    recording : Recording
        Whose venue it is in.
    walk : Walk
        What it follows.
    seed : int
        Of its random numbers.
    label : str
        The same label is the same random numbers.

    Raises
    ------
    DataError
        If it fails.
    """
    track = follow(estimator, recording.venue, walk, seed=seed, label=label)
    if isinstance(track, Failure):
        raise DataError(f"{label}, seed {seed}, {walk.name}: {track.reason}")
    return track
