"""Pictures of the paper on map-compensated headings: its figures, and its tables over all seeds."""

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from blesim.pdr.steps import step_signal_m_s2
from blesim.reruns import map_ekf_numbers as names
from blesim.reruns.base import Curve, Key, Numbers, Picture
from blesim.reruns.map_ekf_gait import THRESHOLDS_S, CountedWalk
from blesim.reruns.map_ekf_walk import KEPT_ROW, Solutions, heading_errors_deg
from blesim.tables import Track, Trajectory
from blesim.units import MICROSECONDS_PER_SECOND

_SHOWN = {"OHPDR": 20, "AHPDR": 20, "BEPDR": 5, "EKFPDR": 20}
# Some seconds after the start, when all walk.
_SIGNAL_S = (5.0, 9.0)
_FAR_M = 30
_ZONE_DBM = -74.0


def trial_pictures(counted: Mapping[str, CountedWalk], found: Solutions) -> Iterator[Picture]:
    """Pictures of one seed."""
    yield _acceleration(counted)
    yield _thresholds(counted)
    yield _headings(found)
    yield _trajectories(found)
    four = {name: found.solved[name, beacons].error_m for name, beacons in _SHOWN.items()}
    yield _by_step("errors", "Error of the four solutions", four)
    yield _distribution("errors-cdf", "Errors of the four solutions", four)
    by_count = {
        f"{beacons} beacons": found.solved["EKFPDR", beacons].error_m for beacons in names.BEACONS
    }
    yield _by_step("beacons", "Error of EKFPDR with 10, 15 and 20 beacons", by_count)
    yield _distribution("beacons-cdf", "Errors of EKFPDR with 10, 15 and 20 beacons", by_count)
    kept = {"errors reset": four["EKFPDR"], "errors kept": found.solved[KEPT_ROW, 20].error_m}
    yield _by_step("kept", "Error of EKFPDR, and of Eq 17 read to the letter", kept)
    yield _signal(found)


def _acceleration(counted: Mapping[str, CountedWalk]) -> Picture:
    curves = []
    for name in ("walk, straight", "run, straight"):
        imu = counted[name].imu
        since_s = (imu.time_us - imu.time_us[0]) / MICROSECONDS_PER_SECOND
        shown = (since_s >= _SIGNAL_S[0]) & (since_s < _SIGNAL_S[1])
        curves.append(Curve(label=name, x=since_s[shown], y=step_signal_m_s2(imu)[shown]))
    return Picture(
        name="acceleration",
        title="Acceleration less gravity while walking and running (figures 4 and 5)",
        x_label="time since the start [s]",
        y_label="acceleration [m/s²]",
        kind="line",
        curves=tuple(curves),
    )


def _thresholds(counted: Mapping[str, CountedWalk]) -> Picture:
    return Picture(
        name="thresholds",
        title="Steps counted with each time threshold (table 1)",
        x_label="time threshold [s]",
        y_label="steps counted, of those taken [%]",
        kind="step",
        curves=tuple(
            Curve(label=name, x=THRESHOLDS_S, y=100.0 * walk.counts / walk.steps)
            for name, walk in counted.items()
        ),
    )


def _headings(found: Solutions) -> Picture:
    time_us, azimuth_deg, _ = heading_errors_deg(found, "OHPDR")
    since_s = (time_us - found.trajectory.time_us[0]) / MICROSECONDS_PER_SECOND
    curves = [Curve(label="corridor", x=since_s, y=azimuth_deg)]
    for label, solution in (("raw", "OHPDR"), ("compensated", "AHPDR")):
        _, map_deg, off_deg = heading_errors_deg(found, solution)
        curves.append(Curve(label=label, x=since_s, y=map_deg + off_deg))
    return Picture(
        name="headings",
        title="Azimuth of the straight steps (figure 8)",
        x_label="time since the start [s]",
        y_label="azimuth [degree]",
        kind="line",
        curves=tuple(curves),
    )


def _trajectories(found: Solutions) -> Picture:
    true = found.trajectory
    tracks = {name: found.solved[name, beacons].track for name, beacons in _SHOWN.items()}
    return Picture(
        name="trajectories",
        title="The walk by the four solutions (figures 10 and 11; beacons: the 20 of EKFPDR)",
        x_label="x [m]",
        y_label="y [m]",
        kind="map",
        curves=(
            _way("walked", true),
            *(_way(name, track) for name, track in tracks.items()),
        ),
        venue=found.truth.venue,
    )


def _way(label: str, places: Trajectory | Track) -> Curve:
    return Curve(label=label, x=places.x_m.astype(np.float64), y=places.y_m.astype(np.float64))


def _by_step(name: str, title: str, errors_m: Mapping[str, Numbers]) -> Picture:
    return Picture(
        name=name,
        title=title,
        x_label="steps taken [-]",
        y_label="error [m]",
        kind="line",
        curves=tuple(
            Curve(label=label, x=np.arange(len(error_m), dtype=np.float64), y=error_m)
            for label, error_m in errors_m.items()
        ),
    )


def _distribution(name: str, title: str, errors_m: Mapping[str, Numbers]) -> Picture:
    return Picture(
        name=name,
        title=title,
        x_label="error [m]",
        y_label="share of steps [-]",
        kind="step",
        curves=tuple(
            Curve(
                label=label,
                x=np.sort(error_m),
                y=np.arange(1, len(error_m) + 1, dtype=np.float64) / len(error_m),
            )
            for label, error_m in errors_m.items()
        ),
    )


def _signal(found: Solutions) -> Picture:
    """RSSI against distance on all walks, with the edge of the zones."""
    off_m, rssi_dbm = heard(found)
    within = [rssi_dbm[(off_m >= low) & (off_m < low + 1)] for low in range(_FAR_M)]
    middle_m = np.array([low + 0.5 for low, values in enumerate(within) if len(values)])
    values = [each for each in within if len(each)]
    quantiles = np.array([np.percentile(each, (10, 50, 90)) for each in values])
    return Picture(
        name="signal",
        title="RSSI by distance, and the edge of the zones (figures 1 and 2)",
        x_label="horizontal distance from the beacon [m]",
        y_label="RSSI [dBm]",
        kind="line",
        curves=(
            Curve(label="median", x=middle_m, y=quantiles[:, 1]),
            Curve(label="10 % are less", x=middle_m, y=quantiles[:, 0]),
            Curve(label="10 % are more", x=middle_m, y=quantiles[:, 2]),
            Curve(
                label=f"{_ZONE_DBM:g} dBm",
                x=np.array([0.0, float(_FAR_M)]),
                y=np.array([_ZONE_DBM, _ZONE_DBM]),
            ),
        ),
    )


def heard(found: Solutions) -> tuple[Numbers, Numbers]:
    """Horizontal distance and RSSI of all readings with 20 beacons, (n,) each. [m], [dBm]."""
    beacon_m = np.array([(beacon.x_m, beacon.y_m) for beacon in found.truth.venue.beacons])
    off_m, rssi_dbm = [], []
    for walk in found.recording.walks:
        readings = walk.observations.readings
        true = found.truth.walks[walk.name].trajectory.at(readings.time_us)
        x_m, y_m = beacon_m[readings.beacon].T
        off_m.append(np.hypot(x_m - true.x_m, y_m - true.y_m))
        rssi_dbm.append(readings.rssi_dbm.astype(np.float64))
    return np.concatenate(off_m), np.concatenate(rssi_dbm)


def overview_pictures(numbers: Mapping[Key, Numbers]) -> Iterator[Picture]:
    """Pictures over all seeds."""
    mean = {key: float(np.mean(values)) for key, values in numbers.items()}
    printed = {each.key: each.value for each in names.PUBLISHED}
    yield _bars(
        "lengths",
        "Mean difference from the real length (table 2)",
        ("step-length model", "difference [m]"),
        {6.0: "Eq 6", 7.0: "Eq 7", 8.0: "Eq 8"},
        {"": lambda at: Key(names.LENGTHS, f"Eq {at:g}", names.OFF_MEAN)},
        (mean, printed),
    )
    yield _bars(
        "azimuths",
        "Mean error of the azimuth in each corridor (table 3)",
        ("azimuth of the corridor [degree]", "error [degree]"),
        {float(each): f"{each:g}" for each in names.AZIMUTHS_DEG},
        {
            "raw, ": lambda at: Key(names.HEADINGS, names.azimuth_row(at), names.RAW_MEAN),
            "compensated, ": lambda at: Key(
                names.HEADINGS, names.azimuth_row(at), names.MENDED_MEAN
            ),
        },
        (mean, printed),
    )
    yield _bars(
        "solutions",
        "Mean error of the solutions (table 4)",
        ("solution", "error [m]"),
        {float(place): name for place, name in enumerate(_SHOWN, start=1)},
        {"": lambda at: Key(names.SOLUTIONS, list(_SHOWN)[int(at) - 1], names.MEAN)},
        (mean, printed),
    )
    yield Picture(
        name="beacon-number",
        title="Mean and largest error of EKFPDR against the number of beacons (table 5)",
        x_label="beacons [-]",
        y_label="error [m]",
        kind="line",
        curves=tuple(_density_curves(mean, printed)),
    )


def _bars(
    name: str,
    title: str,
    labels: tuple[str, str],
    at: Mapping[float, str],
    keys: Mapping[str, Callable[[float], Key]],
    values: tuple[Mapping[Key, float], Mapping[Key, float]],
) -> Picture:
    """Bars at named places of the x axis: of each kind of key one simulated, one published."""
    curves = [
        Curve(
            label=kind + source,
            x=np.array(list(at)),
            y=np.array([found[key_of(place)] for place in at]),
            published=source == "published",
        )
        for kind, key_of in keys.items()
        for source, found in zip(("simulated", "published"), values, strict=True)
    ]
    return Picture(
        name=name,
        title=title,
        x_label=labels[0],
        y_label=labels[1],
        kind="bars",
        curves=tuple(curves),
        x_names=tuple(at.values()),
    )


def _density_curves(mean: Mapping[Key, float], printed: Mapping[Key, float]) -> Iterator[Curve]:
    for column, word in ((names.MEAN, "mean"), (names.MOST, "largest")):
        for source, found in (("simulated", mean), ("published", printed)):
            keys = [
                Key(names.DENSITIES, names.beacons_row(count), column) for count in names.BEACONS
            ]
            yield Curve(
                label=f"{word}, {source}",
                x=np.array(names.BEACONS, np.float64),
                y=np.array([found[key] for key in keys]),
                published=source == "published",
            )
