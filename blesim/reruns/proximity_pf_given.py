"""Recordings of the proximity experiment with something told that no phone could tell [1]_.

They show what limits the algorithms; nothing else of the recording changes.

References
----------
.. [1] Particle filter on beacon proximity and a floor map; digest "proximity-particle-filter".
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from blesim.estimators.walked_steps import StepReading
from blesim.ranging.proximity import Proximity
from blesim.ranging.proximity_likelihood import PUBLISHED_NEAR
from blesim.recording import Observations, Recording, Truth, Walk, WalkKind
from blesim.rng import Draws
from blesim.tables import Steps


def without_survey(recording: Recording) -> Recording:
    """Nothing to learn from."""
    walks = tuple(walk for walk in recording.walks if walk.kind != WalkKind.SURVEY)
    return replace(recording, walks=walks)


def with_true_headings(recording: Recording, truth: Truth) -> Recording:
    """Step events of the walks as sensed in the acceleration, with the headings as they were.

    Those of the survey are gone, or an offset would be learned and taken off true headings.
    """

    def told(walk: Walk) -> Observations:
        if walk.kind == WalkKind.SURVEY:
            return replace(walk.observations, steps=Steps.empty())
        sensed = StepReading(source="imu", compass_weight=1.0).start().advance(walk.observations)
        true = truth.walks[walk.name].trajectory.at(sensed.time_us)
        steps = Steps(
            time_us=sensed.time_us, length_m=sensed.length_m, heading_rad=true.heading_rad
        )
        return replace(walk.observations, steps=steps)

    return _told_otherwise(recording, told)


def with_near_by_chance(recording: Recording, truth: Truth, seed: int) -> Recording:
    """Every reading of the walks tells Near with the probability of Eq 5, by itself; else Far."""
    beacons_m = recording.venue.beacon_xyz_m

    def told(walk: Walk) -> Observations:
        if walk.kind == WalkKind.SURVEY:
            return walk.observations
        readings = walk.observations.readings
        true = truth.walks[walk.name].trajectory.at(readings.time_us)
        # No wall of this course hides a beacon as close as one can be Near.
        beacon_m = beacons_m[readings.beacon]
        distance_m = np.hypot(true.x_m - beacon_m[:, 0], true.y_m - beacon_m[:, 1])
        draws = Draws(seed=seed, purpose="proximity-pf near", walker=walk.name).generator()
        near = draws.random(len(readings)) < PUBLISHED_NEAR.share(distance_m)
        proximity = np.where(near, int(Proximity.NEAR), int(Proximity.FAR))
        return replace(walk.observations, readings=replace(readings, proximity=proximity))

    return _told_otherwise(recording, told)


def _told_otherwise(recording: Recording, told: Callable[[Walk], Observations]) -> Recording:
    walks = tuple(replace(walk, observations=told(walk)) for walk in recording.walks)
    return replace(recording, walks=walks)
