"""Pictures of the rerun of dead reckoning and four-direction fingerprints."""

from collections.abc import Iterator, Mapping
from itertools import product

import numpy as np
from numpy.typing import NDArray

from blesim.metrics.position_error import PositionErrors
from blesim.recording import Recording, Truth
from blesim.reruns import pdr_fingerprint_numbers as paper
from blesim.reruns.base import Curve, Key, Numbers, Picture
from blesim.tables import Track, Trajectory
from blesim.units import to_s

Array = NDArray[np.float64]
_TURNS_DEG = np.array([0.0, 90.0, 180.0, 270.0])


def pictures_of(
    recording: Recording,
    truth: Truth,
    tracks: Mapping[tuple[str, str], Track],
    errors: Mapping[tuple[str, str], PositionErrors],
    point_dbm: Array,
) -> list[Picture]:
    """Both walks of figure 8, errors along them, their distributions, and the sample vectors."""
    drawn = [_walk(path, recording, truth, tracks) for path in paper.PATHS]
    drawn += [_errors_in_time(path, errors) for path in paper.PATHS]
    names = [beacon.id for beacon in recording.venue.beacons]
    return [
        *drawn,
        _distributions(errors),
        _vectors("point-simulated", "Simulated", names, point_dbm),
        _vectors(
            "point-published",
            "Published",
            [f"beacon {number}" for number in range(1, 5)],
            np.array(paper.POINT_DBM),
        ),
    ]


def _line(label: str, walked: Trajectory | Track) -> Curve:
    return Curve(label=label, x=walked.x_m.astype(np.float64), y=walked.y_m.astype(np.float64))


def _walk(
    path: str, recording: Recording, truth: Truth, tracks: Mapping[tuple[str, str], Track]
) -> Picture:
    trajectory = truth.walks[path].trajectory
    way = _line("true path", trajectory)
    followed = [_line(mode, tracks[path, mode]) for mode in paper.MODES]
    return Picture(
        name=f"figure-8-{path}",
        title=f"The {path} path and its tracks (figure 8)",
        x_label="x [m]",
        y_label="y [m]",
        kind="map",
        curves=(way, *followed),
        venue=recording.venue,
    )


def _errors_in_time(path: str, errors: Mapping[tuple[str, str], PositionErrors]) -> Picture:
    return Picture(
        name=f"errors-{path}",
        title=f"Errors along the {path} path",
        x_label="time since the first reading [s]",
        y_label="position error [m]",
        kind="step",
        curves=tuple(_in_time(mode, errors[path, mode]) for mode in paper.MODES),
    )


def _in_time(label: str, errors: PositionErrors) -> Curve:
    time_s = to_s(errors.time_us - errors.time_us[0])
    return Curve(label=label, x=np.asarray(time_s, np.float64), y=errors.error_m)


def _distributions(errors: Mapping[tuple[str, str], PositionErrors]) -> Picture:
    return Picture(
        name="error-distributions",
        title="Errors after every reading, with and without correction",
        x_label="position error [m]",
        y_label="share of readings below [-]",
        kind="step",
        curves=tuple(
            distribution(_short(path, mode), errors[path, mode].error_m)
            for path, mode in product(paper.PATHS, paper.MODES)
        ),
    )


def _short(path: str, mode: str) -> str:
    """Label of a legend: four of the full ones are wider than the figure."""
    return f"{path}, {mode.split()[0]}"


def distribution(label: str, values: Array) -> Curve:
    """Cumulative distribution of some values, from 0 on."""
    count = len(values)
    found = np.sort(values)
    return Curve(
        label=label,
        x=np.concatenate([found[:1], found]),
        y=np.arange(count + 1) / count,
    )


def _vectors(name: str, whose: str, beacons: list[str], point_dbm: Array) -> Picture:
    return Picture(
        name=name,
        title=f"{whose} fingerprints of the point (8, 9), looking four ways",
        x_label="direction [degree]",
        y_label="RSSI [dBm]",
        kind="line",
        curves=tuple(
            Curve(label=beacon, x=_TURNS_DEG, y=point_dbm[:, column])
            for column, beacon in enumerate(beacons)
        ),
    )


def error_overview(numbers: Mapping[Key, Numbers]) -> list[Picture]:
    """Mean errors of all seeds: of whole walks, and at the ends of stands."""
    return [
        _over_seeds("overview-walks", "Mean error of a walk", _mean_errors(numbers)),
        _over_seeds("overview-stands", "Mean error at the ends of stands", _at_stands(numbers)),
    ]


def _mean_errors(numbers: Mapping[Key, Numbers]) -> Iterator[Curve]:
    for path, mode in product(paper.PATHS, paper.MODES):
        yield distribution(_short(path, mode), numbers[paper.error_key(path, mode, paper.MEAN)])


def _at_stands(numbers: Mapping[Key, Numbers]) -> Iterator[Curve]:
    for path, mode in product(paper.PATHS, paper.MODES):
        yield distribution(_short(path, mode), numbers[paper.stand_key(path, mode, paper.MEAN)])


def _over_seeds(name: str, title: str, curves: Iterator[Curve]) -> Picture:
    return Picture(
        name=name,
        title=f"{title}, with and without correction, all seeds",
        x_label="mean position error [m]",
        y_label="share of seeds below [-]",
        kind="step",
        curves=tuple(curves),
    )
