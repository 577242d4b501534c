"""Pictures of the proximity paper's rerun, in the form of its figures and of table I."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from blesim.reruns.base import Curve, Key, Numbers, Picture
from blesim.reruns.proximity_pf_cells import BEACON, Cells
from blesim.reruns.proximity_pf_numbers import (
    ALGORITHMS,
    CELL_M,
    INTERCEPT,
    PENALTIES,
    POINTS,
    RINGS_M,
    SLOPE,
    TRIALS,
    error_key,
    penalty_key,
    published,
    share_key,
)
from blesim.tables import Track, Trajectory
from blesim.units import to_s
from blesim.venue.venue import Venue

Array = NDArray[np.float64]
_CIRCLE_M = 2.4
_ERROR, _SHARE = "position error [m]", "share of read-outs below [-]"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Walked:
    """One trial.

    Attributes
    ----------
    venue : Venue
        Where.
    truth : Trajectory
        Where the tester really was.
    tracks : dict of str to Track
        By algorithm.
    read_out_us : ndarray of int64, (points,)
        When the error was read out. [us]
    """

    venue: Venue
    truth: Trajectory
    tracks: Mapping[str, Track]
    read_out_us: NDArray[np.int64]


def trial_pictures(
    numbers: Mapping[Key, float], cells: Cells, walked: Walked
) -> tuple[Picture, ...]:
    """Pictures of one seed: figures 3 and 4, and the first walk."""
    return (
        _cells(cells, walked.venue),
        _shares({key: np.array([value]) for key, value in numbers.items()}, "figure-4", "one seed"),
        _tracks(walked),
        _errors(walked),
    )


def overview_pictures(numbers: Mapping[Key, Numbers]) -> tuple[Picture, ...]:
    """Pictures over all seeds: figure 4, table I as distributions, the penalty."""
    printed = {each.key: np.array([each.value]) for each in published()}
    penalty_m = [float(np.mean(numbers[penalty_key(each)])) for each in PENALTIES]
    return (
        _shares(numbers, "figure-4-seeds", "mean over the seeds"),
        _distributions(numbers, "errors-seeds", "Simulated errors at both points, all seeds"),
        _distributions(printed, "errors-published", "Published errors at both points (table I)"),
        Picture(
            name="penalty",
            title="Error of the proposed algorithm against the penalty, all seeds",
            x_label="penalty [-]",
            y_label="mean position error [m]",
            kind="line",
            curves=(Curve(label="", x=np.array(PENALTIES), y=np.array(penalty_m)),),
        ),
    )


def _cells(cells: Cells, venue: Venue) -> Picture:
    beacon_m = venue.beacon_xyz_m[venue.beacon_row[BEACON]]
    angle = np.linspace(0.0, 2.0 * np.pi, 121)
    circle = Curve(
        label=f"{_CIRCLE_M:g} m from the beacon",
        x=beacon_m[0] + _CIRCLE_M * np.cos(angle),
        y=beacon_m[1] + _CIRCLE_M * np.sin(angle),
    )
    return Picture(
        name="figure-3",
        title="Cells that measure Near to the beacon on the floor (figure 3)",
        x_label="x [m]",
        y_label="y [m]",
        kind="map",
        curves=(circle, _squares("Near", cells.x_m[cells.near], cells.y_m[cells.near])),
        venue=venue,
    )


def _squares(label: str, x_m: Array, y_m: Array) -> Curve:
    """Outlines of cells as one line with gaps."""
    half_m = 0.4 * CELL_M
    gap = np.nan
    right_m = half_m * np.array([-1.0, 1.0, 1.0, -1.0, -1.0, gap])
    up_m = half_m * np.array([-1.0, -1.0, 1.0, 1.0, -1.0, gap])
    return Curve(
        label=label,
        x=(x_m[:, None] + right_m).ravel(),
        y=(y_m[:, None] + up_m).ravel(),
    )


def _shares(numbers: Mapping[Key, Numbers], name: str, whose: str) -> Picture:
    """P(d) of each ring, the line through it, and Eq 5."""
    ring_m = np.array(RINGS_M)
    printed = {each.key: each.value for each in published()}
    share = np.array([float(np.mean(numbers[share_key(each)])) for each in RINGS_M])
    intercept, slope = float(np.mean(numbers[INTERCEPT])), float(np.mean(numbers[SLOPE]))
    return Picture(
        name=name,
        title=f"Share of cells that measure Near, {whose} (figure 4)",
        x_label="distance on the map to the beacon [m]",
        y_label="share Near [-]",
        kind="line",
        curves=(
            Curve(label="simulated", x=ring_m, y=share),
            Curve(label="line through it", x=ring_m, y=intercept + slope * ring_m),
            Curve(
                label="published line (Eq 5)",
                x=ring_m,
                y=printed[INTERCEPT] + printed[SLOPE] * ring_m,
                published=True,
            ),
        ),
    )


def _tracks(walked: Walked) -> Picture:
    truth, tracks = walked.truth, walked.tracks
    curves = (
        Curve(label="walked", x=_plain(truth.x_m), y=_plain(truth.y_m)),
        *(
            Curve(label=name, x=_plain(each.x_m), y=_plain(each.y_m))
            for name, each in tracks.items()
        ),
    )
    return Picture(
        name="walk",
        title="The first trial of one seed (figure 6)",
        x_label="x [m]",
        y_label="y [m]",
        kind="map",
        curves=curves,
        venue=walked.venue,
    )


def _plain(values: NDArray[np.floating]) -> Array:
    return np.asarray(values, np.float64)


def _errors(walked: Walked) -> Picture:
    curves = []
    for name, track in walked.tracks.items():
        true = walked.truth.at(track.time_us)
        off_m = np.hypot(track.x_m - true.x_m, track.y_m - true.y_m)
        curves.append(Curve(label=name, x=to_s(track.time_us), y=off_m))
    at_s = to_s(walked.read_out_us)
    top_m = max(float(np.max(curve.y)) for curve in curves)
    posts = np.array([0.0, top_m, np.nan])
    read_out = Curve(label="read-outs", x=np.repeat(at_s, len(posts)), y=np.tile(posts, len(at_s)))
    return Picture(
        name="errors-walk",
        title="Errors along the first trial of one seed",
        x_label="time [s]",
        y_label=_ERROR,
        kind="line",
        curves=(*curves, read_out),
    )


def _distributions(numbers: Mapping[Key, Numbers], name: str, title: str) -> Picture:
    curves = []
    for algorithm in ALGORITHMS:
        keys = [error_key(algorithm, *which) for which in product(TRIALS, POINTS)]
        errors_m = np.sort(np.concatenate([numbers[key] for key in keys]))
        # From nothing at the least error.
        share = np.arange(len(errors_m) + 1) / len(errors_m)
        curves.append(Curve(label=algorithm, x=np.append(errors_m[0], errors_m), y=share))
    return Picture(
        name=name,
        title=title,
        x_label=_ERROR,
        y_label=_SHARE,
        kind="step",
        curves=tuple(curves),
    )
