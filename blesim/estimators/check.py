"""The conformance suite: the rules of the contract, tried on an estimator one after the other."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np

from blesim.columns import CHANNEL_NOT_TOLD
from blesim.errors import ConformanceError
from blesim.estimators.base import Estimator, Need, StartInfo, Tracker
from blesim.estimators.events import cut, event_order, one_reading_each
from blesim.estimators.practice import practice_recording
from blesim.estimators.registry import one_line
from blesim.estimators.run import (
    fault_of_track,
    missing_needs,
    span_us,
    start_of,
    surveys_of,
    visible,
)
from blesim.estimators.snapshots import global_randomness, inputs_of, same, state_of
from blesim.recording import Observations, Recording, Walk, WalkKind
from blesim.rng import Draws
from blesim.tables import Imu, Readings, Steps, Track

_SEED = 1
_RANDOM_CUTS = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """An estimator with the walk it is tried on; `inputs` as they were before it was let loose."""

    estimator: Estimator
    recording: Recording
    walk: Walk
    inputs: list[Any]

    @property
    def seen(self) -> Observations:
        """What a tracker may see of the walk."""
        return visible(self.walk.observations)

    @property
    def start_info(self) -> StartInfo | None:
        """Where the walk begins, for an estimator that asks."""
        return start_of(self.walk) if Need.START in self.estimator.needs else None

    def fit(self) -> Estimator:
        """Fitted copy."""
        return self.estimator.fit(self.recording.venue, surveys_of(self.recording))

    def start(self, fitted: Estimator) -> Tracker:
        """Tracker of the walk, always with the same random numbers."""
        draws = Draws(seed=_SEED, purpose="conformance", walker=self.walk.name)
        return fitted.start(self.start_info, draws.generator())

    def track(self) -> Track:
        """Track of the whole walk in one block."""
        return self.start(self.fit()).advance(self.seen)


def check_estimator(estimator: Estimator, recording: Recording | None = None) -> None:
    """Nothing, if an estimator keeps the contract.

    Parameters
    ----------
    estimator : Estimator
        Not fitted, with the settings to be tried.
    recording : Recording, optional
        To try it on, with everything it needs; a small invented one unless given.

    Raises
    ------
    ConformanceError
        That names the first rule broken, and how.
    """
    with _rule("declared"):
        _declared(estimator)
    case = _case(estimator, practice_recording() if recording is None else recording)
    for name, rule in RULES.items():
        with _rule(name):
            rule(case)


def _case(estimator: Estimator, recording: Recording) -> Case:
    for walk in recording.walks:
        lacking = missing_needs(estimator.needs, recording, walk)
        if walk.kind == WalkKind.WALK and not lacking:
            inputs = inputs_of(recording)
            return Case(estimator=estimator, recording=recording, walk=walk, inputs=inputs)
    raise ConformanceError(f"declared: no walk of the recording has {sorted(estimator.needs)}")


@contextmanager
def _rule(name: str) -> Iterator[None]:
    try:
        yield
    except ConformanceError as broken:
        raise ConformanceError(f"{name}: {broken}") from broken
    except Exception as fault:  # the estimator is a stranger's; whatever it raises breaks the rule
        raise ConformanceError(f"{name}: it raises {one_line(fault)}") from fault


def _require(kept: bool, otherwise: str) -> None:
    if not kept:
        raise ConformanceError(otherwise)


def _declared(estimator: Any) -> None:
    frozen = is_dataclass(estimator) and getattr(estimator, "__dataclass_params__").frozen  # noqa: B009 (no stub knows it)
    _require(frozen, "settings belong into a frozen dataclass")
    for name in [field.name for field in fields(estimator)]:
        try:
            setattr(estimator, name, getattr(estimator, name))
        except AttributeError:
            continue
        raise ConformanceError(f"setting '{name}' can be changed; freeze the dataclass")
    needs = estimator.needs
    proper = isinstance(needs, frozenset) and all(isinstance(need, Need) for need in needs)
    _require(proper, "'needs' must be a frozenset of Need")


def _fit_copies(case: Case) -> None:
    before = state_of(case.estimator)
    fitted = case.fit()
    _require(type(fitted) is type(case.estimator), "fit must return the estimator's own type")
    _require(fitted is not case.estimator, "fit must return a copy, not the estimator itself")
    _require(same(state_of(case.estimator), before), "fit changed the estimator; use fitted(self)")


def _global_randomness(case: Case) -> None:
    before = global_randomness()
    case.track()
    _require(
        same(global_randomness(), before), "it draws from a global generator; draw from rng alone"
    )


def _inputs_untouched(case: Case) -> None:
    case.track()
    _require(
        same(inputs_of(case.recording), case.inputs), "it changed its observations or the venue"
    )
    locked = all(
        not array.flags.writeable for table in case.seen.tables() for array in table.arrays()
    )
    _require(locked, "it made the arrays of its observations writeable")


def _valid(case: Case) -> None:
    fault = fault_of_track(case.track(), case.recording.venue, case.seen)
    _require(fault is None, str(fault))
    _require(len(case.track()) > 0, "it gave no estimate on a whole walk")


def _covariance(case: Case) -> None:
    track = case.track()
    variances_x_m2, variances_y_m2 = track.variance_x_m2, track.variance_y_m2
    _require(bool(np.all(variances_x_m2 >= 0) and np.all(variances_y_m2 >= 0)), "negative variance")
    limit_m2 = np.sqrt(variances_x_m2 * variances_y_m2)
    # A covariance of full correlation may exceed the bound by rounding.
    kept = np.all(np.abs(track.covariance_xy_m2) <= limit_m2 * (1 + 1e-9) + 1e-12)
    _require(bool(kept), "|covariance| exceeds the square root of the product of the variances")


def _repeatable(case: Case) -> None:
    _require(
        case.track() == case.track(),
        "the same seed gave another track; draw from rng alone, keep no state outside the tracker",
    )


def _own_state(case: Case) -> None:
    """Follow two phones at once, the second of which hears other beacons."""
    fitted = case.fit()
    alone = _in_blocks(case, _random_blocks(case.seen))
    first, second = case.start(fitted), case.start(fitted)
    mine: list[Track] = []
    for block in _random_blocks(case.seen):
        mine.append(first.advance(block))
        second.advance(_elsewhere(block, case.recording))
    _require(
        _joined(mine) == alone, "two trackers of one estimator share state; keep it in the tracker"
    )


def _elsewhere(block: Observations, recording: Recording) -> Observations:
    """Return the block as if the beacons hung in the opposite order."""
    beacon = len(recording.venue.beacons) - 1 - block.readings.beacon
    return replace(block, readings=replace(block.readings, beacon=beacon))


def _no_peeking(case: Case) -> None:
    begin_us, end_us = span_us(case.seen)
    for share in (0.2, 0.5, 0.8):
        now_us = begin_us + round(share * (end_us - begin_us))
        past = case.seen.between(begin_us, now_us)
        known = case.start(case.fit()).advance(past)
        for future in _futures(case.seen.between(now_us, end_us + 1)):
            whole = case.start(case.fit()).advance(_after(past, future))
            _require(
                whole.rows(slice(0, len(known))) == known,
                f"estimates up to {now_us} us change with what happens later",
            )


def _futures(rest: Observations) -> Iterator[Observations]:
    """Yield what happened, the same with all readings 20 dB weaker, and the same half as long."""
    yield rest
    weaker_dbm = np.maximum(rest.readings.rssi_dbm.astype(np.int64) - 20, -127)
    yield replace(rest, readings=replace(rest.readings, rssi_dbm=weaker_dbm))
    begin_us, end_us = span_us(rest)
    yield rest.between(begin_us, (begin_us + end_us) // 2)


def _blocks_do_not_matter(case: Case) -> None:
    whole = case.track()
    live = _in_blocks(case, one_reading_each(case.seen))
    _require(live == whole, "one reading at a time gives another track than the whole walk")
    cuts = _in_blocks(case, _random_blocks(case.seen))
    _require(cuts == whole, "blocks cut at random give another track than the whole walk")


def _times(case: Case) -> None:
    tracker, before_us = case.start(case.fit()), span_us(case.seen)[0]
    for block in one_reading_each(case.seen):
        track = tracker.advance(block)
        after_us = max(before_us, span_us(block)[1])
        inside = np.all((track.time_us >= before_us) & (track.time_us <= after_us))
        _require(
            bool(inside), f"an estimate lies outside the time of its block, up to {after_us} us"
        )
        before_us = after_us


def _empty_input(case: Case) -> None:
    nothing = Observations()
    halves = list(cut(case.seen, [len(event_order(case.seen)[0]) // 2]))
    plain, interrupted = _in_blocks(case, halves), case.start(case.fit())
    _require(len(_track(interrupted.advance(nothing))) == 0, "an empty block gave estimates")
    parts = [interrupted.advance(block) for block in (halves[0], nothing, halves[1], nothing)]
    _require(_joined(parts) == plain, "an empty block in between changed the track")
    silent = replace(case.seen, readings=Readings.empty())
    _track(case.start(case.fit()).advance(silent))


def _needs_are_complete(case: Case) -> None:
    """Try it on a walk that has nothing but readings and what it asked for."""
    needs = case.estimator.needs
    readings = case.seen.readings
    bare = replace(
        case.seen,
        readings=readings if Need.CHANNELS in needs else _untold(readings),
        imu=case.seen.imu if Need.IMU in needs else Imu.empty(),
        steps=case.seen.steps if Need.STEPS in needs else Steps.empty(),
    )
    venue = case.recording.venue
    recording = case.recording
    plain = replace(venue, graph=venue.graph if Need.GRAPH in needs else None, sections=())
    surveys = surveys_of(replace(recording, venue=plain)) if Need.SURVEY in needs else ()
    tracker = case.start(case.estimator.fit(plain, surveys))
    fault = fault_of_track(tracker.advance(bare), plain, bare)
    _require(fault is None, f"with nothing but what it needs, {fault}")


def _untold(readings: Readings) -> Readings:
    return replace(readings, channel=np.full(len(readings), CHANNEL_NOT_TOLD, np.uint8))


RULES: dict[str, Callable[[Case], None]] = {
    "fit returns a copy": _fit_copies,
    "valid track": _valid,
    "no global randomness": _global_randomness,
    "inputs untouched": _inputs_untouched,
    "repeatable": _repeatable,
    "empty input": _empty_input,
    "trackers of their own": _own_state,
    "no peeking ahead": _no_peeking,
    "blocks do not matter": _blocks_do_not_matter,
    "times": _times,
    "covariance": _covariance,
    "needs are complete": _needs_are_complete,
}


def _in_blocks(case: Case, blocks: Iterable[Observations]) -> Track:
    tracker = case.start(case.fit())
    return _joined([tracker.advance(block) for block in blocks])


def _random_blocks(observations: Observations) -> Iterator[Observations]:
    """Yield blocks of very different size, some of them empty."""
    count = len(event_order(observations)[0])
    rng = Draws(seed=_SEED, purpose="conformance cuts").generator()
    ends = np.sort(rng.integers(0, count + 1, _RANDOM_CUTS))
    return cut(observations, np.sort(np.append(ends, ends[::4])).tolist())


def _joined(parts: list[Track]) -> Track:
    return Track.concatenate([_track(part) for part in parts])


def _track(result: object) -> Track:
    if not isinstance(result, Track):
        raise ConformanceError(f"no Track but a {type(result).__name__} was returned")
    return result


def _after(past: Observations, future: Observations) -> Observations:
    pairs = zip(past.tables(), future.tables(), strict=True)
    return Observations.of(type(before).concatenate([before, after]) for before, after in pairs)
