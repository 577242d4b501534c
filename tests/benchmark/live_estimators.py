"""What each estimator costs a live phone, and how many phones one core could serve."""

import gc
from functools import cache, partial
from time import process_time

from measure import Row

from blesim.estimators.events import one_reading_each
from blesim.estimators.practice import practice_recording
from blesim.estimators.registry import estimator_names, make_estimator
from blesim.estimators.run import fit, start_of, visible
from blesim.rng import Draws

# A phone that scans without pause hears about so many beacons' packets a second (in the
# published store: 1000 to 1300 readings in 85 s).
READINGS_A_SECOND = 13.0


@cache
def live_us(name: str) -> float:
    """Processor time of one reading, handed over alone as a live phone does. [us]."""
    recording = practice_recording()
    _, estimator = make_estimator(name)
    fitted = fit(estimator, recording)
    walk = recording.by_name["there"]
    blocks = list(one_reading_each(visible(walk.observations)))
    best = float("inf")
    for _ in range(3):
        gc.collect()
        tracker = fitted.start(start_of(walk), Draws(seed=1, purpose="bench").generator())
        begin = process_time()
        for block in blocks:
            tracker.advance(block)
        best = min(best, process_time() - begin)
    return best / len(walk.observations.readings) * 1e6


def phones(name: str) -> float:
    """Phones that one core could serve."""
    return 1e6 / (live_us(name) * READINGS_A_SECOND)


ROWS = [
    row
    for name in estimator_names()
    for row in (
        Row(name=f"{name}, live", unit="us a reading", measure=partial(live_us, name)),
        Row(name=f"{name}, live phones", unit="a core", measure=partial(phones, name)),
    )
]
