"""What a survey teaches of steps: the offset of the compass and the lengths of steps.

Between two marks at different places of one level the tester walked straight, so that the heading
and the way are known; between two at the same place the tester stood, and may have told the
heading.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from blesim.errors import DataError
from blesim.estimators.walked_steps import SensedSteps, StepReading
from blesim.pdr.attitude import Leveller, Levelling
from blesim.pdr.features import StepFeatures
from blesim.pdr.heading import compass_heading_rad, compass_offset_rad
from blesim.pdr.step_length import KnownWalk, StepLengthModel, fit_step_length
from blesim.recording import Observations, Recording, Walk, WalkKind
from blesim.tables import Marks
from blesim.units import heading_to_azimuth
from blesim.venue.venue import Venue

# A shorter way has no direction, and fewer steps tell no length.
_SHORTEST_WAY_M = 0.3
_FEWEST_STEPS = 20
# Way a step of a survey may stand for; beyond it steps were missed, or were none.
_STEP_RANGE_M = (0.3, 1.2)
_RIDGE = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Spans:
    """What the tester did between successive marks of one level; arrays (n,).

    Attributes
    ----------
    begin_us, end_us : ndarray of int64
        [us]
    heading_rad : ndarray of float64
        Walked or faced, NaN where not known. [rad]
    length_m : ndarray of float64
        Length of the way, 0 for standing. [m]
    """

    begin_us: NDArray[np.int64]
    end_us: NDArray[np.int64]
    heading_rad: NDArray[np.float64]
    length_m: NDArray[np.float64]

    def at(self, time_us: NDArray[np.integer]) -> NDArray[np.int64]:
        """Span in which each moment lies, (m,), -1 for none; a span's end belongs to it."""
        if not len(self.begin_us):
            return np.full(len(time_us), -1)
        span = np.searchsorted(self.begin_us, time_us, side="left") - 1
        inside = (span >= 0) & (time_us <= self.end_us[span])
        return np.where(inside, span, -1)


def spans_between(marks: Marks) -> Spans:
    """Spans between the marks of one survey walk."""
    along_x_m, along_y_m = np.diff(marks.x_m), np.diff(marks.y_m)
    length_m = np.hypot(along_x_m, along_y_m)
    walked = length_m >= _SHORTEST_WAY_M
    same = np.diff(marks.level.astype(np.int64)) == 0
    heading_rad = np.where(walked, np.arctan2(along_y_m, along_x_m), marks.heading_rad[:-1])
    return Spans(
        begin_us=marks.time_us[:-1][same].astype(np.int64),
        end_us=marks.time_us[1:][same].astype(np.int64),
        heading_rad=heading_rad[same],
        length_m=np.where(walked, length_m, 0.0)[same],
    )


def learned_steps(
    how: StepReading,
    venue: Venue,
    surveys: Sequence[Recording],
    offset_rad: float | None,
    *,
    lengths: bool = True,
) -> StepReading:
    """Copy that has the offset of the compass and the lengths of a survey, as far as there is one.

    Without a survey walk that tells the offset, a compass has that of the venue's georeference, and
    the system's headings have none. Lengths are fitted for steps of the IMU, with a ridge of 1e-3
    towards the model given.

    Parameters
    ----------
    how : StepReading
        How steps are read; left as it is.
    venue : Venue
        As surveyed.
    surveys : sequence of Recording
        May be empty.
    offset_rad : float or None
        Offset that is already known. [rad]
    lengths : bool
        Whether lengths are fitted at all.
    """
    walks = [walk for survey in surveys for walk in survey.walks if walk.kind == WalkKind.SURVEY]
    if offset_rad is None:
        offset_rad = _surveyed_offset_rad(how, walks, _georeferenced_rad(how, venue))
    if lengths and how.source == "imu":
        how = replace(how, length=_surveyed_length(how, walks))
    return replace(how, offset_rad=offset_rad)


def _georeferenced_rad(how: StepReading, venue: Venue) -> float:
    if how.source == "system" or venue.georeference is None:
        return 0.0
    return math.radians(venue.georeference.bearing_deg)


def _surveyed_offset_rad(how: StepReading, walks: Sequence[Walk], otherwise_rad: float) -> float:
    measured: list[NDArray[np.floating]] = [np.empty(0)]
    known: list[NDArray[np.floating]] = [np.empty(0)]
    for walk in walks:
        time_us, heading_rad = _measured_headings(how, walk.observations)
        spans = spans_between(walk.observations.marks)
        span = spans.at(time_us)
        measured.append(heading_rad[span >= 0])
        known.append(spans.heading_rad[span[span >= 0]])
    try:
        azimuth_rad = heading_to_azimuth(np.concatenate(measured))
        return compass_offset_rad(azimuth_rad, np.concatenate(known))
    except DataError:
        return otherwise_rad


def _measured_headings(
    how: StepReading, seen: Observations
) -> tuple[NDArray[np.integer], NDArray[np.floating]]:
    """Times and headings by the compass, or by what of the system the steps are read from."""
    if how.source == "imu":
        level = Leveller(Levelling()).advance(seen.imu)
        return level.time_us, compass_heading_rad(level.azimuth_rad)
    told = seen.headings if how.heading == "stream" and len(seen.headings) else seen.steps
    return told.time_us, told.heading_rad


def _surveyed_length(how: StepReading, walks: Sequence[Walk]) -> StepLengthModel:
    known = [each for walk in walks if (each := _known_walk(how, walk)) is not None]
    return fit_step_length(how.length, known, ridge=_RIDGE) if known else how.length


def _known_walk(how: StepReading, walk: Walk) -> KnownWalk | None:
    spans = spans_between(walk.observations.marks)
    # Lengths ask for no heading, and the gyroscope alone would ask for the first.
    felt = SensedSteps(replace(how, compass_weight=1.0)).felt(walk.observations)
    span = spans.at(felt.time_us)
    inside = (span >= 0) & (spans.length_m[span] > 0) if len(spans.length_m) else span >= 0
    steps, way_m = int(np.count_nonzero(inside)), float(spans.length_m.sum())
    if steps < _FEWEST_STEPS or not _STEP_RANGE_M[0] <= way_m / steps <= _STEP_RANGE_M[1]:
        return None
    return KnownWalk(features=_selected(felt.features, inside), distance_m=way_m)


def _selected(features: StepFeatures, rows: NDArray[np.bool_]) -> StepFeatures:
    columns = {each.name: getattr(features, each.name)[rows] for each in fields(StepFeatures)}
    return StepFeatures(**columns)
