"""The experiment on map-compensated headings with one thing otherwise, to see what hangs on it."""

from collections.abc import Container, Mapping
from typing import Any, Literal

from blesim.reruns import map_ekf_numbers as names
from blesim.reruns.base import Change, Key
from blesim.reruns.map_ekf import MapEkf
from blesim.reruns.map_ekf_walk import TRIED, Solving, Tried

_PHONE = "phones.galaxy-note-3"
_IRON = f"{_PHONE}.imu.magnetometer.hard_iron_ut"
_ONE_HEIGHT = {"walks.*.gait": {"length_at_rest_m": 0.142}}


def _azimuth(azimuth_deg: float, column: str) -> Key:
    return Key(names.HEADINGS, names.azimuth_row(azimuth_deg), column)


def _beacons(count: int, column: str) -> Key:
    return Key(names.DENSITIES, names.beacons_row(count), column)


_COUNTS = (
    Key(names.STEPS, "walk, straight", names.NEAR_FROM),
    Key(names.STEPS, "run, straight", names.BEST_FROM),
    Key(names.STEPS, "run, straight", names.BEST_TO),
    Key(names.STEPS, "run, turning", names.NEAR_TO),
    Key(names.STEPS, "run, turning", names.BEST_WIDTH),
    Key(names.STEPS, "walk, turning", names.BEST_WIDTH),
)
_LENGTHS = (
    Key(names.LENGTHS, "Eq 6", names.OFF_MEAN),
    Key(names.LENGTHS, "Eq 7", names.OFF_MEAN),
    Key(names.LENGTHS, "Eq 7", names.OFF_VARIANCE),
    Key(names.LENGTHS, "Eq 8", names.OFF_MEAN),
    Key(names.LENGTHS, "Eq 8", names.OFF_MOST),
    Key(names.LENGTHS, "Eq 8", names.OFF_VARIANCE),
)
_COMPASS = (
    _azimuth(90, names.RAW_MEAN),
    _azimuth(90, names.MENDED_MEAN),
    _azimuth(270, names.RAW_MEAN),
    Key(names.SOLUTIONS, "OHPDR", names.MEAN),
    Key(names.SOLUTIONS, "OHPDR", names.MOST),
    Key(names.SOLUTIONS, "AHPDR", names.MEAN),
)
_CORRIDORS = (
    _azimuth(180, names.MENDED_MEAN),
    _azimuth(180, names.MENDED_MOST),
    _azimuth(270, names.MENDED_MEAN),
    _azimuth(305, names.RAW_MEAN),
    _azimuth(305, names.MENDED_MEAN),
    _azimuth(305, names.MENDED_MOST),
)
_FIXES = (
    _beacons(20, names.LEAST),
    _beacons(20, names.MOST),
    _beacons(15, names.MOST),
    _beacons(10, names.MOST),
    _beacons(10, names.MEAN),
    Key(names.SOLUTIONS, "BEPDR", names.LEAST),
)


def _tried(*, of: Container[str], settings: str = "") -> Tried:
    """Only some of the solutions, with other settings."""
    chosen = {
        beacons: {row: text + settings for row, text in rows.items() if row in of}
        for beacons, rows in TRIED.items()
    }
    return {beacons: rows for beacons, rows in chosen.items() if rows}


_FUSED = ("EKFPDR", "BEPDR")


def _steps(name: str, why: str, values: Mapping[str, Any]) -> Change:
    experiment = MapEkf(values=values, solving=Solving(tried={}))
    return Change(name=name, why=why, experiment=experiment, shown=_COUNTS)


def _lengths(
    name: str,
    why: str,
    strength: Literal["person", "all"],
    values: Mapping[str, Any] | None = None,
) -> Change:
    experiment = MapEkf(values=values or {}, strength=strength, solving=Solving(tried={}))
    return Change(name=name, why=why, experiment=experiment, shown=_LENGTHS)


def _headings(
    name: str,
    why: str,
    shown: tuple[Key, ...],
    *,
    values: Mapping[str, Any] | None = None,
    compensated: str = "",
    trained_steps: int = 0,
    start_off_m: float = names.START_OFF_M,
) -> Change:
    raw = _tried(of=("OHPDR",))[20]
    mended = _tried(of=("AHPDR",), settings=compensated)[20]
    solving = Solving(
        tried={20: {**raw, **mended}}, trained_steps=trained_steps, start_off_m=start_off_m
    )
    experiment = MapEkf(values=values or {}, solving=solving)
    return Change(name=name, why=why, experiment=experiment, shown=shown)


def _fixes(
    name: str,
    why: str,
    *,
    values: Mapping[str, Any] | None = None,
    settings: str = "",
    every_steps: int = 1,
) -> Change:
    solving = Solving(tried=_tried(of=_FUSED, settings=settings), every_steps=every_steps)
    experiment = MapEkf(values=values or {}, solving=solving)
    return Change(name=name, why=why, experiment=experiment, shown=_FIXES)


CHANGES = (
    _steps(
        "1 m/s2 of noise in the acceleration",
        "The paper shows a rough signal when running, of which there is no recording.",
        {f"{_PHONE}.imu.accelerometer.noise_ug_per_rthz": 2e4},
    ),
    _steps(
        "runners as irregular as walkers",
        "Step intervals of runners vary by 3 %, which is assumed, those of walkers by 8.5 %.",
        {"walks.*.gait.running_interval_variation": 0.085},
    ),
    _lengths(
        "four people",
        "The seven walks are of four people, where ours each have a strength of gait of their own.",
        "person",
    ),
    _lengths(
        "the same strength of gait for all",
        "How much the strength of gait differs between people is assumed, a spread of 20 %.",
        "all",
    ),
    _lengths(
        "one person",
        "Shows how much comes of four heights and four strengths of gait together.",
        "person",
        _ONE_HEIGHT,
    ),
    _headings(
        "10 uT of iron in the phone",
        "The paper does not say how its phone was calibrated; 1 uT is assumed.",
        _COMPASS,
        values={_IRON: 10.0},
    ),
    _headings(
        "10 uT of iron, corridors up to 20 m away",
        "With iron AHPDR comes too far off its corridor to find it within the 5 m assumed.",
        _COMPASS,
        values={_IRON: 10.0},
        compensated=",reach_m=20",
    ),
    _headings(
        "twice the anomalies of the building",
        "How much steel there is in the paper's building is not told.",
        _COMPASS,
        values={"magnetics.anomaly_ut": 7.6, "magnetics.clutter_ut": 2.6},
    ),
    _headings(
        "corridors within 20 degrees",
        "How the paper picks a step's corridor is not told, and A and C differ by 35 degrees;"
        " 45 is assumed.",
        _CORRIDORS,
        compensated=",agree_deg=20",
    ),
    _headings(
        "training steps left out",
        "The first ten steps of each corridor train, uncompensated; whether table 3 has them is"
        " not told.",
        _CORRIDORS,
        trained_steps=10,
    ),
    _headings(
        "anomalies four times as long",
        "A correction learned in ten steps holds as far as the field is the same; 60 m are"
        " assumed.",
        _CORRIDORS,
        values={"magnetics.anomaly_m": 240.0},
    ),
    _headings(
        "an exact start",
        "Positions begin 2 m off as in the paper, any way, which is assumed.",
        _CORRIDORS,
        start_off_m=0.0,
    ),
    _fixes(
        "no multipath",
        "Shows what comes of fixes by beacons far away, of which a packet is strong by chance.",
        values={"radio.fading.model": "none"},
    ),
    _fixes(
        "a mean over three seconds",
        "What the paper's positioning system makes of the packets is not told; a fix is then"
        " looked for every three seconds.",
        settings=",fix_s=3",
    ),
    _fixes(
        "zones from -70 dBm on",
        "How strong the paper's beacons are is not told, so that -74 dBm may lie nearer to them.",
        settings=",zone_dbm=-70",
    ),
    _fixes(
        "zones from -82 dBm on",
        "The same the other way: more fixes from beacons farther away.",
        settings=",zone_dbm=-82",
    ),
    _fixes(
        "74 % of the packets lost",
        "How many packets the paper's phone gets is not told; 9 % are lost by default.",
        values={f"{_PHONE}.receiver.random_loss": 0.74},
    ),
    _fixes(
        "errors every 15 steps",
        "At how many places the paper knows where its walker is is not told; here about every"
        " ten metres.",
        every_steps=15,
    ),
)
