"""The run of an estimator over the walks of a recording, and what is asked of both."""

from dataclasses import replace

import numpy as np

from blesim.columns import CHANNEL_NOT_TOLD, NO_EDGE
from blesim.errors import BlesimError, UsageError
from blesim.estimators.base import Estimator, Need, StartInfo
from blesim.estimators.registry import one_line
from blesim.recording import Failure, Observations, Recording, Walk, WalkKind
from blesim.rng import Draws
from blesim.tables import Marks, Track
from blesim.units import to_us
from blesim.venue.venue import Venue

# A mark pressed later than this after the first observation no longer says where the walk began.
START_WITHIN_S = 2.0


def run(
    estimator: Estimator, recording: Recording, walk: Walk, *, seed: int, label: str
) -> Track | Failure:
    """Track of one walk by an estimator that is first fitted on the recording.

    Parameters
    ----------
    estimator : Estimator
        Left as it is.
    recording : Recording
        Whose venue and survey walks the estimator learns from.
    walk : Walk
        A walk of the recording.
    seed : int
        With the label and the name of the walk, it addresses the random numbers.
    label : str
        What the estimator is called, such as the label of `make_estimator`.

    Returns
    -------
    Track or Failure
        A failure where the estimator raises, or returns what is no track of this walk.

    Raises
    ------
    UsageError
        If the recording lacks what the estimator needs.
    """
    refuse_missing(estimator, recording, walk, label)
    learned = fit(estimator, recording)
    if isinstance(learned, Failure):
        return learned
    return follow(learned, recording.venue, walk, seed=seed, label=label)


def fit(estimator: Estimator, recording: Recording) -> Estimator | Failure:
    """Copy fitted on the venue and the survey walks of a recording, or why that failed."""
    try:
        return estimator.fit(recording.venue, surveys_of(recording))
    except Exception as fault:  # one estimator's fault must not stop the others
        return Failure(reason=f"fit: {_reason(fault)}")


def follow(
    fitted: Estimator, venue: Venue, walk: Walk, *, seed: int, label: str
) -> Track | Failure:
    """Track of one walk by a fitted estimator, or why that failed; see `run`."""
    draws = Draws(seed=seed, purpose=f"estimator {label}", walker=walk.name)
    start = start_of(walk) if Need.START in fitted.needs else None
    seen = visible(walk.observations)
    try:
        track = fitted.start(start, draws.generator()).advance(seen)
    except Exception as fault:  # one estimator's fault must not stop the others
        return Failure(reason=_reason(fault))
    fault_found = fault_of_track(track, venue, seen)
    return track if fault_found is None else Failure(reason=fault_found)


def refuse_missing(estimator: Estimator, recording: Recording, walk: Walk, label: str) -> None:
    """Raise `UsageError` that names everything the recording lacks for an estimator."""
    lacking = missing_needs(estimator.needs, recording, walk)
    if lacking:
        raise UsageError(
            f"estimator '{label}' needs {' and '.join(_WORDS[need] for need in lacking)},"
            f" which walk '{walk.name}' or its recording does not have"
        )


def missing_needs(needs: frozenset[Need], recording: Recording, walk: Walk) -> tuple[Need, ...]:
    """What of the needs a walk and its recording cannot give, in the order of `Need`."""
    seen = walk.observations
    surveys = [survey for survey in recording.walks if survey.kind == WalkKind.SURVEY]
    given = {
        Need.SURVEY: bool(surveys),
        Need.IMU: len(seen.imu) > 0,
        Need.STEPS: len(seen.steps) > 0,
        Need.CHANNELS: all(_tells_channels(each) for each in (walk, *surveys)),
        Need.GRAPH: recording.venue.graph is not None,
        Need.START: start_of(walk) is not None,
    }
    return tuple(need for need in Need if need in needs and not given[need])


_WORDS = {
    Need.SURVEY: "a survey walk",
    Need.IMU: "IMU samples",
    Need.STEPS: "step events",
    Need.CHANNELS: "readings that tell their advertising channel",
    Need.GRAPH: "an aisle graph",
    Need.START: "a mark at the start of the walk",
}


def _tells_channels(walk: Walk) -> bool:
    return not np.any(walk.observations.readings.channel == CHANNEL_NOT_TOLD)


def surveys_of(recording: Recording) -> tuple[Recording, ...]:
    """Survey walks of a recording, as one recording of the same venue; none if it has none.

    Without scenario and seed, from which the truth could be simulated once more.
    """
    surveys = tuple(walk for walk in recording.walks if walk.kind == WalkKind.SURVEY)
    origin = replace(recording.provenance, scenario="", seed=None)
    return (replace(recording, walks=surveys, provenance=origin),) if surveys else ()


def visible(observations: Observations) -> Observations:
    """What an estimator under trial may see: all but the marks, which tell true positions."""
    return replace(observations, marks=Marks.empty())


def start_of(walk: Walk) -> StartInfo | None:
    """Place of the first mark, if it was pressed when the walk began, and its heading if told."""
    marks = walk.observations.marks
    begin_us, _ = span_us(walk.observations)
    if not len(marks) or marks.time_us[0] - begin_us > to_us(START_WITHIN_S):
        return None
    heading_rad = float(marks.heading_rad[0])
    return StartInfo(
        x_m=float(marks.x_m[0]),
        y_m=float(marks.y_m[0]),
        level=int(marks.level[0]),
        heading_rad=None if np.isnan(heading_rad) else heading_rad,
    )


def span_us(observations: Observations) -> tuple[int, int]:
    """Times of the first and the last event of all streams; (0, 0) if there is none. [us]."""
    times = [table[table.STREAM.columns[0]] for table in observations.tables() if len(table)]
    if not times:
        return 0, 0
    return min(int(time_us[0]) for time_us in times), max(int(time_us[-1]) for time_us in times)


def fault_of_track(track: object, venue: Venue, seen: Observations) -> str | None:
    """What makes a result no track of a walk in a venue, in one line; none if it is one."""
    if not isinstance(track, Track):
        return f"no Track but a {type(track).__name__} was returned"
    if not len(track):
        return None
    begin_us, end_us = span_us(seen)
    if track.time_us[0] < begin_us or track.time_us[-1] > end_us:
        return f"estimates reach outside the walk, which lasts from {begin_us} to {end_us} us"
    return _fault_of_values(track) or _fault_of_places(track, venue)


def _fault_of_values(track: Track) -> str | None:
    for name in ("x_m", "y_m", "variance_x_m2", "variance_y_m2", "covariance_xy_m2"):
        bad = np.flatnonzero(~np.isfinite(getattr(track, name)))
        if len(bad):
            return f"{name} is not a finite number at {track.time_us[bad[0]]} us"
    return None


def _fault_of_places(track: Track, venue: Venue) -> str | None:
    levels = [level.level for level in venue.floor_plan.levels]
    if not np.all(np.isin(track.level, levels)):
        return "an estimate is on a level that the venue does not have"
    on_edge = track.edge != NO_EDGE
    lengths_m = np.empty(0) if venue.graph is None else venue.graph.length_m
    edge, offset_m = track.edge[on_edge], track.offset_m[on_edge]
    if np.any((edge < 0) | (edge >= len(lengths_m))):
        return "an estimate is on an edge that the aisle graph does not have"
    # Offsets are recorded to a micrometre, so one at the very end may be rounded beyond it.
    if not np.all((offset_m >= 0) & (offset_m <= lengths_m[edge] + 1e-6)):
        return "an estimate's offset lies beyond its edge"
    return None


def _reason(fault: Exception) -> str:
    return " ".join(str(fault).split()) if isinstance(fault, BlesimError) else one_line(fault)
