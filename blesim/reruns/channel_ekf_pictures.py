"""Pictures of the channel-separate paper's rerun, in the form of its figures."""

from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blesim.metrics.position_error import PositionErrors
from blesim.metrics.score import scored_walks
from blesim.ranging.survey_readings import SurveyReadings
from blesim.recording import Recording, Truth
from blesim.reruns import channel_ekf_numbers as paper
from blesim.reruns.base import Curve, Key, Numbers, Picture
from blesim.reruns.channel_ekf_ranging import DistanceErrors, channel_means, channels_heard
from blesim.tables import Track
from blesim.units import to_s
from blesim.venue.beacons import CHANNELS

Array = NDArray[np.float64]
_SHARE = "share of errors below [-]"
_POSITION_ERROR = "position error [m]"


# The PM puts some readings hundreds of metres away: lines of ranges end here.
_FARTHEST_M = 30.0


def _distribution(label: str, values: Array) -> Curve:
    """Cumulative distribution of some values."""
    return Curve(label=label, x=np.sort(values), y=np.arange(1, len(values) + 1) / len(values))


def _near(curve: Curve) -> Curve:
    """Part of a distribution that is worth a look."""
    shown = curve.x <= _FARTHEST_M
    return Curve(label=curve.label, x=curve.x[shown], y=curve.y[shown])


def ranging_pictures(
    still: SurveyReadings, distances: DistanceErrors, places: Mapping[str, Array]
) -> list[Picture]:
    """Figures 1, 5, 7, 8 and 9, of the dense office."""
    return [
        _still(still),
        Picture(
            name="figure-5",
            title="Mean distance error of each channel, up to 30 m (figure 5)",
            x_label="mean distance error [m]",
            y_label="share of channels below [-]",
            kind="step",
            curves=tuple(
                _near(_distribution(model, channel_means(distances, model)))
                for model in distances.by_model
            ),
        ),
        Picture(
            name="figure-7",
            title="Distance errors of all readings, up to 30 m (figure 7)",
            x_label="distance error [m]",
            y_label=_SHARE,
            kind="step",
            curves=tuple(
                _near(_thinned(label, distances.by_model[model]))
                for label, model in (("PM", "PM"), ("PRM", paper.poly(2)))
            ),
        ),
        Picture(
            name="figure-8",
            title="Distance errors, channels apart and together (figure 8)",
            x_label="distance error [m]",
            y_label=_SHARE,
            kind="step",
            curves=_apart_and_together(distances),
        ),
        Picture(
            name="figure-9",
            title="Fingerprints alone, k = 1, each point among the others (figure 9)",
            x_label=_POSITION_ERROR,
            y_label=_SHARE,
            kind="step",
            curves=tuple(_distribution(mode, error_m) for mode, error_m in places.items()),
        ),
    ]


def _still(still: SurveyReadings) -> Picture:
    """Of the first beacon."""
    first = still.rows(still.spot == 0)
    curves = []
    for channel, name in zip(CHANNELS, paper.CHANNEL_NAMES, strict=True):
        own = first.rows(first.channel == channel)
        time_s = to_s(own.time_us - first.time_us[0])
        curves.append(Curve(label=name, x=time_s, y=own.rssi_dbm))
    return Picture(
        name="figure-1",
        title="A phone that lies still 5 m from a beacon (figure 1)",
        x_label="time [s]",
        y_label="RSSI [dBm]",
        kind="line",
        curves=tuple(curves),
    )


def _apart_and_together(distances: DistanceErrors) -> tuple[Curve, ...]:
    slot, separate = distances.channel % len(CHANNELS), distances.by_model[paper.poly(2)]
    apart = [_thinned(name, separate[slot == row]) for row, name in enumerate(paper.CHANNEL_NAMES)]
    return (*apart, _thinned(paper.AGGREGATE, distances.aggregate))


def _thinned(label: str, values: Array) -> Curve:
    """Distribution at every half per cent: a survey has tens of thousands of readings."""
    share = np.linspace(0.0, 1.0, 201)[:-1]
    return Curve(label=label, x=np.percentile(values, 100.0 * share), y=share)


def office_pictures(
    deployment: str,
    recording: Recording,
    truth: Truth,
    tracks: Mapping[tuple[str, str], Track],
    errors: Mapping[tuple[str, str], PositionErrors],
) -> list[Picture]:
    """Figures 11 to 17 of one deployment: channels heard, tracks, and error distributions."""
    drawn = [_heard(deployment, recording)]
    for walk, trajectory in paper.TRAJECTORIES.items():
        true = truth.walks[walk].trajectory
        of_methods = [(method, tracks[method, walk]) for method in paper.METHODS]
        drawn += [
            Picture(
                name=f"tracks-{deployment}-{trajectory}",
                title=f"Tracks, {deployment} beacons, trajectory {trajectory}",
                x_label="x [m]",
                y_label="y [m]",
                kind="map",
                curves=(
                    _way("true", true.x_m, true.y_m),
                    *(_way(name, track.x_m, track.y_m) for name, track in of_methods),
                ),
                venue=recording.venue,
            ),
            Picture(
                name=f"errors-{deployment}-{trajectory}",
                title=f"Position errors, {deployment} beacons, trajectory {trajectory}",
                x_label=_POSITION_ERROR,
                y_label=_SHARE,
                kind="step",
                curves=tuple(
                    _distribution(method, errors[method, walk].error_m) for method in paper.METHODS
                ),
            ),
        ]
    return drawn


def _way(label: str, x_m: NDArray[Any], y_m: NDArray[Any]) -> Curve:
    return Curve(label=label, x=x_m.astype(np.float64), y=y_m.astype(np.float64))


def _heard(deployment: str, recording: Recording) -> Picture:
    curves = []
    for walk in scored_walks(recording):
        count = channels_heard(walk.observations.readings).astype(np.float64)
        label = f"trajectory {paper.TRAJECTORIES[walk.name]}"
        curves.append(Curve(label=label, x=np.arange(len(count), dtype=np.float64), y=count))
    return Picture(
        name=f"figure-11-{deployment}",
        title=f"Channels heard in each second, {deployment} beacons (figure 11)",
        x_label="time [s]",
        y_label="channels [-]",
        kind="line",
        curves=tuple(curves),
    )


def error_overview(numbers: Mapping[Key, Numbers]) -> list[Picture]:
    """90 % errors over all seeds, simulated and published."""
    printed = {each.key: each.value for each in paper.PUBLISHED}
    cases = list(product(paper.DEPLOYMENTS, paper.TRAJECTORIES.values()))
    curves = []
    for method in paper.METHODS:
        keys = [paper.error_key(*case, method, paper.COLUMNS[1]) for case in cases]
        simulated = np.array([np.mean(numbers[key]) for key in keys])
        published = np.array([printed[key] for key in keys])
        case = np.arange(1.0, len(cases) + 1)
        curves += [
            Curve(label=f"{method}, simulated", x=case, y=simulated),
            Curve(label=f"{method}, published", x=case, y=published, published=True),
        ]
    return [
        Picture(
            name="overview",
            title="90 % position errors, mean over the seeds",
            x_label="beacons and trajectory",
            y_label="90 % position error [m]",
            kind="bars",
            curves=tuple(curves),
            x_names=tuple(" ".join(each) for each in cases),
        )
    ]
