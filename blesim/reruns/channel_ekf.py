"""Rerun of the channel-separate paper [1]_: ranges, fingerprints, and three filters in an office.

Two offices are simulated a seed, with dense and with sparse beacons, whose surveys and walks all
methods share. Figures 1, 5, 7, 8 and 9 are of the dense one, as in the paper. Where the paper shows
an example channel or beacon, which one it is is not told: the mean over all of them stands here.

References
----------
.. [1] Channel-separate regression, fingerprints and EKF, 2016; digest "channel-separate-ekf".
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import hypot, inf, sqrt
from typing import Any

import numpy as np

from blesim.errors import InvariantError
from blesim.estimators.base import Estimator
from blesim.estimators.channel_ekf import ChannelEkf
from blesim.estimators.fingerprint_ekf import FingerprintEkf
from blesim.estimators.path_loss_ekf import PathLossEkf
from blesim.estimators.run import surveys_of
from blesim.metrics.position_error import PositionErrors
from blesim.metrics.score import scored_walks, track_errors
from blesim.metrics.summary import summarise
from blesim.ranging.survey_readings import WALKING, SurveyReadings, survey_readings
from blesim.recording import Recording, Truth
from blesim.reruns import channel_ekf_numbers as paper
from blesim.reruns.base import Expected, Key, Numbers, Picture, Published, Trial
from blesim.reruns.channel_ekf_numbers import DEPLOYMENTS, FP, PM, PROPOSED
from blesim.reruns.channel_ekf_pictures import error_overview, office_pictures, ranging_pictures
from blesim.reruns.channel_ekf_ranging import (
    DistanceErrors,
    beacon_errors,
    channel_means,
    channels_heard,
    distance_errors,
    far_error_m,
    mean_levels,
    place_errors,
)
from blesim.reruns.followed import followed, learned
from blesim.reruns.sites import scenario_of
from blesim.scenario.reading import ScenarioFile
from blesim.scenario.survey_plan import Spot, SurveyPlan
from blesim.simulate import Simulation
from blesim.tables import Track
from blesim.venue.beacons import CHANNELS, Beacon
from blesim.venue.venue import Venue

# Fingerprints are of the points surveyed, as in the paper, not of what was heard between them.
ESTIMATORS: Mapping[str, Estimator] = {
    PM: PathLossEkf(),
    FP: FingerprintEkf(cell_m=None),
    PROPOSED: ChannelEkf(cell_m=None),
}
_PHONE_HEIGHT_M = ChannelEkf().phone_height_m
_PHONE = "iphone-4s"
# Figure 1: 5 m from a beacon, along its aisle, of which the south one is the longest; how long is
# assumed.
_STILL_BEACONS = ("r01", "r02", "r03", "r04", "r05")
_STILL_M, _STILL_S, _AISLE_Y_M = 5.0, 20.0, 8.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Office:
    """One deployment: its recording and truth, and tracks and errors by method and walk."""

    deployment: str
    recording: Recording
    truth: Truth
    tracks: Mapping[tuple[str, str], Track]
    errors: Mapping[tuple[str, str], PositionErrors]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ranging:
    """What figures 1 and 5 to 9 are made of."""

    still: SurveyReadings
    distances: DistanceErrors
    places: Mapping[str, Numbers]


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelEkfExperiment:
    """The experiment; stateless.

    Attributes
    ----------
    values : mapping of str to object
        Other values of both scenarios, by path, as in `blesim.scenario.other_values.laid_in`.
    estimators : mapping of str to Estimator
        What stands for each of the three methods; none to simulate the signals alone.
    deployments : tuple of str
        Offices to simulate. Figures 1 to 9 are of the dense one.
    phone_held : bool
        Whether somebody holds the phone of figure 1, or it lies there.
    farthest_m : float
        Calibration points of figures 5 to 8 farther from the beacon are left out. [m]
    """

    paper: str = "channel-ekf"
    title: str = "polynomial ranges and fingerprints of each channel in an extended Kalman filter"
    values: Mapping[str, Any] = field(default_factory=dict)
    estimators: Mapping[str, Estimator] = field(default_factory=lambda: ESTIMATORS)
    deployments: tuple[str, ...] = DEPLOYMENTS
    phone_held: bool = False
    farthest_m: float = inf

    @property
    def published(self) -> Sequence[Published]:
        """Figures 1, 5, 7, 8, 9, 11, Eq 32, tables 1 and 2, and the headline."""
        return paper.PUBLISHED

    @property
    def expected(self) -> Sequence[Expected]:
        """Methods, polynomials and path loss, channels apart and together, dense and sparse."""
        return paper.EXPECTED

    def trial(self, seed: int, *, pictures: bool = False) -> Trial:
        """Numbers of one seed, and its pictures if asked for."""
        offices = [self.visited(each, seed) for each in self.deployments]
        ranged = [self.ranged(each, seed) for each in offices if each.deployment == "dense"]
        positions = position_numbers(offices)
        numbers = {key: value for each in ranged for key, value in ranging_numbers(each).items()}
        numbers |= {**positions, **headline(positions)}
        if not pictures:
            return Trial(numbers=numbers)
        drawn = [
            picture
            for each in ranged
            for picture in ranging_pictures(each.still, each.distances, each.places)
        ]
        for office in offices:
            drawn += office_pictures(
                office.deployment, office.recording, office.truth, office.tracks, office.errors
            )
        return Trial(numbers=numbers, pictures=tuple(drawn))

    def visited(self, deployment: str, seed: int) -> Office:
        """An office, surveyed, walked through, and positioned in by each method."""
        file = scenario_of(f"office-{deployment}", self.values)
        recording, truth = Simulation.run(file, seed).recording()
        tracks, errors = {}, {}
        for method, estimator in self.estimators.items():
            ready = learned(estimator, recording, method)
            for walk in scored_walks(recording):
                track = followed(ready, recording, walk, seed, method)
                tracks[method, walk.name] = track
                errors[method, walk.name] = track_errors(recording, truth, walk, track)
        return Office(
            deployment=deployment, recording=recording, truth=truth, tracks=tracks, errors=errors
        )

    def ranged(self, office: Office, seed: int) -> Ranging:
        """Signals, distances and places of the dense office, no filter."""
        file = scenario_of("office-dense", self.values)
        survey = survey_readings(surveys_of(office.recording))
        distance_m = distances_from(office.recording)
        near = survey.rows(distance_m(survey) <= self.farthest_m)
        return Ranging(
            still=still_readings(file, office.truth.venue, seed, held=self.phone_held),
            distances=distance_errors(near, distance_m),
            places=place_errors(survey),
        )

    def overview(self, numbers: Mapping[Key, Numbers]) -> Sequence[Picture]:
        """90 % errors of the three methods, mean over the seeds, beside the published ones."""
        return error_overview(numbers)


def still_readings(
    file: ScenarioFile, office: Venue, seed: int, *, held: bool = False
) -> SurveyReadings:
    """Readings of the south wall's beacons by a phone that lies 5 m from each in turn: figure 1.

    Spots are numbered like the beacons. Static is taken at its word: nobody holds the phone, unless
    it is said to be held.
    """
    lying = file.scenario.phones[_PHONE].model_copy(update={"held": held})
    beacons = [(row, each) for row, each in enumerate(office.beacons) if each.id in _STILL_BEACONS]
    spots = tuple(_spot_beside(each, lying.height_m) for _, each in beacons)
    plan = SurveyPlan(name="still", phone=_PHONE, spots=spots, stand_s=_STILL_S)
    changed = file.with_parameters(walks=(), surveys=(plan,), phones={_PHONE: lying})
    recording, _ = Simulation.run(changed, seed).recording()
    heard = survey_readings((recording,))
    of_spot = np.array([row for row, _ in beacons])[heard.spot]
    return heard.rows((heard.spot != WALKING) & (heard.beacon == of_spot))


def _spot_beside(beacon: Beacon, height_m: float) -> Spot:
    """Place in the aisle of a beacon, west of it."""
    across_m = hypot(beacon.y_m - _AISLE_Y_M, beacon.z_m - height_m)
    return Spot(x_m=beacon.x_m - sqrt(_STILL_M**2 - across_m**2), y_m=_AISLE_Y_M)


def distances_from(recording: Recording) -> Callable[[SurveyReadings], Numbers]:
    """True distances of the readings of a survey, as its venue was surveyed. [m]."""
    return lambda each: each.distance_m(recording.venue, _PHONE_HEIGHT_M)


def ranging_numbers(ranging: Ranging) -> dict[Key, float]:
    """Figures 1 and 5 to 9, and Eq 32."""
    distances, found = ranging.distances, {}
    for channel, name in zip(CHANNELS, paper.CHANNEL_NAMES, strict=True):
        own = ranging.still.rows(ranging.still.channel == channel)
        mean_dbm, spread_db = mean_levels(own.spot, own.rssi_dbm)
        found[paper.still_key(name, paper.MEAN_RSSI)] = mean_dbm
        found[paper.still_key(name, paper.RSSI_SPREAD)] = spread_db
    found[paper.LEVEL] = float(np.mean(distances.level_dbm))
    found[paper.EXPONENT] = float(np.mean(distances.exponent))
    for model, error_m in distances.by_model.items():
        of_channels = channel_means(distances, model)
        found[paper.spread_key(model)] = float(np.percentile(of_channels, 90))
        found[paper.example_key(model)] = far_error_m(distances.channel, error_m)
    found |= {paper.beacon_key(mode): far_m for mode, far_m in beacon_errors(distances).items()}
    for mode, error_m in ranging.places.items():
        found[paper.place_key(mode)] = float(np.percentile(error_m, 90))
    return found


def position_numbers(offices: Sequence[Office]) -> dict[Key, float]:
    """Tables 1 and 2, and figure 11."""
    found = {}
    for office in offices:
        heard = [
            channels_heard(walk.observations.readings) for walk in scored_walks(office.recording)
        ]
        counts = np.concatenate(heard)
        found[paper.heard_key(office.deployment, paper.FEWEST)] = float(counts.min())
        found[paper.heard_key(office.deployment, paper.MOST)] = float(counts.max())
        for (method, walk), errors in office.errors.items():
            trajectory = paper.TRAJECTORIES[walk]
            for column, value in zip(paper.COLUMNS, _figures(errors), strict=True):
                found[paper.error_key(office.deployment, trajectory, method, column)] = value
    return found


def _figures(errors: PositionErrors) -> tuple[float, ...]:
    summary = summarise(errors)
    values = (summary.median_m, summary.p90_m, summary.mean_m, summary.rmse_m)
    finite = tuple(value for value in values if value is not None)
    if len(finite) < len(values):
        raise InvariantError("a track was checked, yet its errors are not finite")
    return finite


def headline(positions: Mapping[Key, float]) -> dict[Key, float]:
    """90 % errors of both trajectories, and how far the proposed ones are below the others.

    As in the abstract: the mean of two percentiles, and the mean of two reductions. Of the
    deployments that were positioned in.
    """
    found = {}
    trajectory, *_ = paper.TRAJECTORIES.values()
    for deployment in DEPLOYMENTS:
        if paper.error_key(deployment, trajectory, PROPOSED, paper.COLUMNS[1]) not in positions:
            continue
        far_m = {
            method: np.array(
                [
                    positions[paper.error_key(deployment, trajectory, method, paper.COLUMNS[1])]
                    for trajectory in paper.TRAJECTORIES.values()
                ]
            )
            for method in paper.METHODS
        }
        for method in paper.METHODS:
            found[paper.both_key(deployment, method)] = float(np.mean(far_m[method]))
        for method in (PM, FP):
            less = 1.0 - far_m[PROPOSED] / far_m[method]
            found[paper.reduction_key(deployment, method)] = float(100.0 * np.mean(less))
    return found


EXPERIMENT = ChannelEkfExperiment()
