"""The error table of a recording: a row for each estimator and walk, and one over all walks."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace

import numpy as np

from blesim.columns import NO_EDGE
from blesim.errors import DataError
from blesim.metrics.position_error import PositionErrors, no_errors, pooled, position_errors
from blesim.metrics.summary import ErrorSummary, summarise
from blesim.recording import ALL_WALKS, Failure, Recording, Truth, Walk, WalkKind
from blesim.tables import Track

# Tracks by the label of the estimator and the name of the walk.
Tracks = Mapping[tuple[str, str], Track | Failure]


@dataclass(frozen=True, slots=True, kw_only=True)
class ScoreRow:
    """One row of the error table.

    Attributes
    ----------
    estimator, walk : str
        Label of the estimator; name of the walk, or ``"all"`` for the readings of all walks.
    summary : ErrorSummary
        Its figures.
    failure : str or None
        Why there is no track, or which walks of ``"all"`` have none; their readings count as
        unmatched.
    """

    estimator: str
    walk: str
    summary: ErrorSummary
    failure: str | None = None

    def as_dict(self) -> dict[str, str | int | float | None]:
        """Row as one flat dict of what JSON can hold."""
        figures = asdict(self.summary)
        return {"estimator": self.estimator, "walk": self.walk, **figures, "failure": self.failure}


def score(recording: Recording, truth: Truth, tracks: Tracks) -> list[ScoreRow]:
    """Error table of all estimators.

    Survey walks are not scored. A walk without a track of an estimator counts as failed.

    Parameters
    ----------
    recording : Recording
        What the estimators saw.
    truth : Truth
        What really happened.
    tracks : mapping of (str, str) to Track or Failure
        By the label of the estimator and the name of the walk.

    Returns
    -------
    list of ScoreRow
        For each estimator in the order of `tracks`: its walks in the order of the recording, then
        ``"all"``, pooled over their readings.

    Raises
    ------
    DataError
        If a track is of no walk of the recording, a walk has no truth, or a track does not fit it.
    """
    _refuse_strangers(recording, tracks)
    rows: list[ScoreRow] = []
    for label in dict.fromkeys(label for label, _ in tracks):
        rows += _rows_of(label, recording, truth, tracks)
    return rows


def track_errors(
    recording: Recording, truth: Truth, walk: Walk, track: Track | Failure
) -> PositionErrors:
    """Errors after every reading of a walk; all readings unmatched for a failure.

    Raises
    ------
    DataError
        If the walk has no truth, or the track does not fit it.
    """
    readings = walk.observations.readings
    if isinstance(track, Failure):
        return no_errors(len(readings))
    if walk.name not in truth.walks:
        raise DataError(f"walk '{walk.name}' has no truth in the file; it cannot be scored")
    graph = truth.venue.graph
    if graph != recording.venue.graph:
        track = _off_graph(track)
    try:
        return position_errors(readings, truth.walks[walk.name].trajectory, track, graph)
    except DataError as fault:
        raise DataError(f"walk '{walk.name}': {fault}") from fault


def _rows_of(label: str, recording: Recording, truth: Truth, tracks: Tracks) -> list[ScoreRow]:
    rows: list[ScoreRow] = []
    parts: list[PositionErrors] = []
    for walk in scored_walks(recording):
        track = tracks.get((label, walk.name), Failure(reason="no track of this walk"))
        parts.append(track_errors(recording, truth, walk, track))
        failure = track.reason if isinstance(track, Failure) else None
        rows.append(_row(label, walk.name, parts[-1], failure))
    failed = [row.walk for row in rows if row.failure is not None]
    failure = f"no track of {', '.join(failed)}" if failed else None
    return [*rows, _row(label, ALL_WALKS, pooled(parts), failure)]


def scored_walks(recording: Recording) -> list[Walk]:
    """Walks that estimators are tried on, in the order of the recording."""
    return [walk for walk in recording.walks if walk.kind == WalkKind.WALK]


def _row(label: str, walk: str, errors: PositionErrors, failure: str | None) -> ScoreRow:
    return ScoreRow(estimator=label, walk=walk, summary=summarise(errors), failure=failure)


def _refuse_strangers(recording: Recording, tracks: Tracks) -> None:
    for label, walk in tracks:
        if walk not in recording.by_name:
            known = ", ".join(recording.by_name)
            raise DataError(
                f"a track of '{label}' is of walk '{walk}', but the recording has {known};"
                " were the tracks made from another recording?"
            )


def _off_graph(track: Track) -> Track:
    """Return the track without edges, which are rows of another graph than the true one."""
    nowhere = np.full(len(track), np.nan)
    return replace(track, edge=np.full(len(track), NO_EDGE), offset_m=nowhere)
