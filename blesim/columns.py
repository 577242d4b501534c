"""Every recorded column, once: its name in the file, its field in Python, type, unit and meaning.

The in-memory tables, the HDF5 writer and reader, the validator and the schema page are all made
from this file.
"""

from dataclasses import dataclass

import numpy as np

NO_EDGE = -1
CHANNEL_NOT_TOLD = 0
PROXIMITY_NOT_TOLD = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """One recorded quantity.

    Attributes
    ----------
    name : str
        Name in the file; the unit travels in an attribute beside it.
    field : str
        Name in Python, unit included.
    dtype : str
        NumPy type name, or ``"str"`` for UTF-8 text of any length.
    units : str
        UDUNITS spelling; ``"1"`` for a number without unit, ``""`` for text.
    long_name : str
        What it means, in one line.
    valid_range : tuple of float or None
        Smallest and largest value a valid file holds, NaN apart.
    decimals : int or None
        Decimals kept of a floating-point value, so that a last-bit difference between two
        machines never reaches the file.
    flags : dict of str to int
        The meaning of each value of an enumeration.
    missing : bool
        Whether NaN is a legal value, for what is not known.
    """

    name: str
    field: str
    dtype: str
    units: str
    long_name: str
    valid_range: tuple[float, float] | None = None
    decimals: int | None = None
    flags: tuple[tuple[str, int], ...] = ()
    missing: bool = False

    @property
    def is_text(self) -> bool:
        """Whether the column holds text."""
        return self.dtype == "str"

    @property
    def numpy_dtype(self) -> np.dtype[np.generic]:
        """The NumPy type of the column's values; ``object`` for text."""
        return np.dtype(object if self.is_text else self.dtype)


@dataclass(frozen=True, slots=True, kw_only=True)
class Stream:
    """One flat table of a file: its HDF5 group, what a row is, its columns."""

    name: str
    group: str
    row: str
    columns: tuple[Column, ...]
    ascending: bool = True

    @property
    def row_size(self) -> str:
        """Name of the column of ``/walks`` that says how many of the rows belong to each walk."""
        return f"{self.group.strip('/').replace('/', '_')}_row_size"


_TIME_LIMIT_US = 366 * 24 * 3600 * 1e6
_MAP_LIMIT_M = 1e5
LONGEST_STEP_M = 3.0
_PI_ROUNDED_UP = 3.15

KINDS = (("survey", 0), ("walk", 1))
STATES = (("standing", 0), ("walking", 1), ("turning", 2))
FEET = (("left", 0), ("right", 1))
CARRYINGS = (
    ("hand", 0),
    ("flat", 1),
    ("swinging", 2),
    ("pocket", 3),
    ("bag", 4),
    ("trolley", 5),
)
ROLES = (("shopper", 0), ("staff", 1), ("tester", 2))
PROXIMITIES = (("not_told", PROXIMITY_NOT_TOLD), ("immediate", 1), ("near", 2), ("far", 3))
BEACON_EVENTS = (
    ("dies", 0),
    ("reboots", 1),
    ("returns", 2),
    ("moves", 3),
    ("replaced", 4),
    ("sags", 5),
)
FATES = (
    ("received", 0),
    ("out_of_window", 1),
    ("other_channel", 2),
    ("collision", 3),
    ("below_sensitivity", 4),
    ("random_loss", 5),
)


def _time(long_name: str) -> Column:
    return Column(
        name="time",
        field="time_us",
        dtype="int64",
        units="microseconds",
        long_name=long_name,
        valid_range=(0, _TIME_LIMIT_US),
    )


def _metres(name: str, long_name: str, *, missing: bool = False) -> Column:
    return Column(
        name=name,
        field=f"{name}_m",
        dtype="float64",
        units="m",
        long_name=long_name,
        valid_range=(-_MAP_LIMIT_M, _MAP_LIMIT_M),
        decimals=6,
        missing=missing,
    )


def _decibels(name: str, long_name: str) -> Column:
    return Column(
        name=name,
        field=f"{name}_db",
        dtype="float32",
        units="dB",
        long_name=long_name,
        valid_range=(-300, 300),
        decimals=3,
    )


def _axes(
    name: str, field_unit: str, units: str, long_name: str, limit: float
) -> tuple[Column, ...]:
    return tuple(
        Column(
            name=f"{name}_{axis}",
            field=f"{name}_{axis}_{field_unit}",
            dtype="float32",
            units=units,
            long_name=f"{long_name}, {axis} axis of the phone",
            valid_range=(-limit, limit),
            decimals=5,
        )
        for axis in "xyz"
    )


def _heading(long_name: str, *, missing: bool = False) -> Column:
    return Column(
        name="heading",
        field="heading_rad",
        dtype="float64",
        units="radian",
        long_name=f"{long_name}, from the map's x axis counter-clockwise",
        valid_range=(-_PI_ROUNDED_UP, _PI_ROUNDED_UP),
        decimals=6,
        missing=missing,
    )


def _variance(name: str, long_name: str) -> Column:
    return Column(
        name=name,
        field=f"{name}_m2",
        dtype="float64",
        units="m2",
        long_name=long_name,
        valid_range=(-(_MAP_LIMIT_M**2), _MAP_LIMIT_M**2),
    )


_LEVEL = Column(
    name="level",
    field="level",
    dtype="int16",
    units="1",
    long_name="level of the building, 0 at the entrance",
    valid_range=(-50, 200),
)
_BEACON = Column(
    name="beacon",
    field="beacon",
    dtype="int32",
    units="1",
    long_name="row of /beacons",
    valid_range=(0, 2**31 - 1),
)
_CHANNEL = Column(
    name="channel",
    field="channel",
    dtype="uint8",
    units="1",
    long_name="advertising channel, where the phone tells it",
    flags=(
        ("not_told", CHANNEL_NOT_TOLD),
        ("channel_37_2402_MHz", 37),
        ("channel_38_2426_MHz", 38),
        ("channel_39_2480_MHz", 39),
    ),
)
_EDGE = Column(
    name="edge",
    field="edge",
    dtype="int32",
    units="1",
    long_name="row of /venue/edges, -1 where the position is on no edge",
    valid_range=(NO_EDGE, 2**31 - 1),
)
_OFFSET = _metres("offset", "distance along the edge from its first node", missing=True)


def _step_columns(whose: str) -> tuple[Column, ...]:
    return (
        _time("time of the step"),
        Column(
            name="length",
            field="length_m",
            dtype="float64",
            units="m",
            long_name=f"step length, {whose}",
            valid_range=(0, LONGEST_STEP_M),
            decimals=4,
        ),
        _heading(f"heading of the step, {whose}"),
    )


RSSI = Stream(
    name="rssi",
    group="/rssi",
    row="one advertisement that the phone reported",
    columns=(
        _time("time the phone received the packet"),
        _BEACON,
        Column(
            name="rssi",
            field="rssi_dbm",
            dtype="int8",
            units="dBm",
            long_name="received signal strength",
            valid_range=(-127, 20),
        ),
        _CHANNEL,
        Column(
            name="proximity",
            field="proximity",
            dtype="uint8",
            units="1",
            long_name="proximity class, where the phone's system tells one",
            flags=PROXIMITIES,
        ),
    ),
)
IMU = Stream(
    name="imu",
    group="/imu",
    row="one sample of the phone's inertial and magnetic sensors",
    columns=(
        _time("time of the sample"),
        *_axes("acceleration", "m_s2", "m s-2", "specific force", 400),
        *_axes("angular_rate", "rad_s", "radian s-1", "angular rate", 100),
        *_axes("magnetic_field", "ut", "microtesla", "magnetic flux density", 5000),
    ),
)
STEPS = Stream(
    name="steps",
    group="/steps",
    row="one step event of the phone",
    columns=_step_columns("as the phone reads it"),
)
HEADING = Stream(
    name="heading",
    group="/heading",
    row="one heading that the phone's system makes of its sensors",
    columns=(_time("time of the heading"), _heading("heading as the system tells it")),
)
PRESSURE = Stream(
    name="pressure",
    group="/pressure",
    row="one sample of the phone's barometer",
    columns=(
        _time("time of the sample"),
        Column(
            name="pressure",
            field="pressure_hpa",
            dtype="float32",
            units="hPa",
            long_name="air pressure",
            valid_range=(200, 1200),
            decimals=4,
        ),
    ),
)
MARKS = Stream(
    name="marks",
    group="/marks",
    row="one way point the tester pressed while passing it",
    columns=(
        _time("time of the press"),
        _metres("x", "x of the way point"),
        _metres("y", "y of the way point"),
        _LEVEL,
        _heading("heading of the tester, where told", missing=True),
    ),
)
TRAJECTORY = Stream(
    name="trajectory",
    group="/truth/trajectory",
    row="one knot of the walk; until the next the way is straight, the acceleration constant",
    columns=(
        _time("time of the knot"),
        _metres("x", "true x"),
        _metres("y", "true y"),
        _LEVEL,
        _heading("true heading", missing=True),
        Column(
            name="speed",
            field="speed_m_s",
            dtype="float64",
            units="m s-1",
            long_name="true speed at the knot",
            valid_range=(0, 20),
            decimals=6,
        ),
        Column(
            name="acceleration",
            field="acceleration_m_s2",
            dtype="float64",
            units="m s-2",
            long_name="change of the speed until the next knot",
            valid_range=(-20, 20),
            decimals=6,
        ),
        _EDGE,
        _OFFSET,
        Column(
            name="edge_speed",
            field="edge_speed_m_s",
            dtype="float64",
            units="m s-1",
            long_name="mean change of the offset until the next knot, + towards the second node",
            valid_range=(-20, 20),
            decimals=6,
            missing=True,
        ),
        Column(
            name="state",
            field="state",
            dtype="uint8",
            units="1",
            long_name="what the walker does until the next knot",
            flags=STATES,
        ),
    ),
)
STEP_TRUTH = Stream(
    name="steps",
    group="/truth/steps",
    row="one step the walker took",
    columns=(
        *_step_columns("true"),
        Column(
            name="foot",
            field="foot",
            dtype="uint8",
            units="1",
            long_name="which foot",
            flags=FEET,
        ),
    ),
)
PACKETS = Stream(
    name="rssi",
    group="/truth/rssi",
    row="one packet sent while the phone was there, heard or not",
    columns=(
        _time("time the packet was sent"),
        _BEACON,
        Column(
            name="channel",
            field="channel",
            dtype="uint8",
            units="1",
            long_name="advertising channel the packet was sent on",
            flags=_CHANNEL.flags,
        ),
        Column(
            name="fate",
            field="fate",
            dtype="uint8",
            units="1",
            long_name="whether the packet was received, or why not",
            flags=FATES,
        ),
        Column(
            name="distance",
            field="distance_m",
            dtype="float32",
            units="m",
            long_name="distance between beacon and phone in three dimensions",
            valid_range=(0, _MAP_LIMIT_M),
            decimals=4,
        ),
        _decibels("path_loss", "log-distance loss beyond one metre"),
        _decibels("obstacle_loss", "loss through obstacles on the line of sight"),
        _decibels("shadowing", "shadowing, + stronger"),
        _decibels("fading", "multipath fading, + stronger"),
        _decibels("body_loss", "loss through people"),
        Column(
            name="power",
            field="power_dbm",
            dtype="float32",
            units="dBm",
            long_name="received power before noise, rounding and sensitivity",
            valid_range=(-400, 100),
            decimals=3,
        ),
    ),
)
CARRYING = Stream(
    name="carrying",
    group="/truth/carrying",
    row="one way of carrying the phone, from its time on",
    columns=(
        _time("time from which the phone is carried so"),
        Column(
            name="carrying",
            field="carrying",
            dtype="uint8",
            units="1",
            long_name="how the phone is carried until the next row",
            flags=CARRYINGS,
        ),
    ),
)
CROWD = Stream(
    name="crowd",
    group="/truth/crowd",
    row=TRAJECTORY.row,
    columns=TRAJECTORY.columns,
)
VISITS = Stream(
    name="visits",
    group="/truth/visits",
    row="one person who stopped at a product section",
    columns=(
        _time("time of arrival"),
        Column(
            name="person",
            field="person",
            dtype="int32",
            units="1",
            long_name="row of /truth/people",
            valid_range=(0, 2**31 - 1),
        ),
        Column(
            name="section",
            field="section",
            dtype="int32",
            units="1",
            long_name="product section, counted in /venue/built from 0",
            valid_range=(0, 2**31 - 1),
        ),
        Column(
            name="dwell",
            field="dwell_us",
            dtype="int64",
            units="microseconds",
            long_name="how long the person stood there",
            valid_range=(0, _TIME_LIMIT_US),
        ),
    ),
)
BEACON_HISTORY = Stream(
    name="beacon_events",
    group="/truth/beacon_events",
    row="one thing that happened to a beacon, with what it is like from then on",
    columns=(
        _time("time of the event"),
        _BEACON,
        Column(
            name="event",
            field="event",
            dtype="uint8",
            units="1",
            long_name="what happened",
            flags=BEACON_EVENTS,
        ),
        _metres("x", "x of the beacon from then on"),
        _metres("y", "y of the beacon from then on"),
        _metres("z", "height above the level's floor from then on"),
        _LEVEL,
        _decibels("power_change", "power from then on, relative to the beacon as built"),
    ),
)
TRACK = Stream(
    name="track",
    group="/track",
    row="one estimate",
    columns=(
        _time("time of the estimate"),
        _metres("x", "estimated x"),
        _metres("y", "estimated y"),
        _LEVEL,
        _variance("variance_x", "variance of the estimated x"),
        _variance("variance_y", "variance of the estimated y"),
        _variance("covariance_xy", "covariance of the estimated x and y"),
        _EDGE,
        _OFFSET,
    ),
)

OBSERVATIONS = (RSSI, IMU, STEPS, MARKS, HEADING, PRESSURE)
TRUTH = (TRAJECTORY, STEP_TRUTH, PACKETS, CARRYING)
# What belongs to the whole recording: no walk counts its rows.
HISTORY = (BEACON_HISTORY, VISITS)


def _text(name: str, long_name: str) -> Column:
    return Column(name=name, field=name, dtype="str", units="", long_name=long_name)


BEACONS = Stream(
    name="beacons",
    group="/beacons",
    row="one beacon, where the installer wrote it down",
    ascending=False,
    columns=(
        _text("id", "name of the beacon on the map"),
        _text("uuid", "iBeacon UUID"),
        Column(
            name="major",
            field="major",
            dtype="uint16",
            units="1",
            long_name="iBeacon major number",
        ),
        Column(
            name="minor",
            field="minor",
            dtype="uint16",
            units="1",
            long_name="iBeacon minor number",
        ),
        _metres("x", "surveyed x"),
        _metres("y", "surveyed y"),
        _metres("z", "surveyed height above the level's floor"),
        _LEVEL,
        Column(
            name="tx_power",
            field="tx_power_dbm",
            dtype="float64",
            units="dBm",
            long_name="transmit power setting",
            valid_range=(-60, 30),
        ),
        Column(
            name="measured_power",
            field="measured_power_dbm",
            dtype="float64",
            units="dBm",
            long_name="RSSI at one metre that the beacon announces",
            valid_range=(-127, 20),
        ),
        Column(
            name="advertising_interval",
            field="advertising_interval_s",
            dtype="float64",
            units="s",
            long_name="advertising interval setting",
            valid_range=(0.02, 10.24),
        ),
    ),
)
WALKS = Stream(
    name="walks",
    group="/walks",
    row="one walk of one phone",
    ascending=False,
    columns=(
        _text("walk", "name of the walk"),
        _text("walker", "who walked"),
        _text("phone", "phone profile"),
        _text("carrying", "how the phone was carried"),
        Column(
            name="kind",
            field="kind",
            dtype="uint8",
            units="1",
            long_name="whether an estimator may learn from the walk's marks, or is tried on it",
            flags=KINDS,
        ),
        _text("split", "part of a benchmark the walk belongs to"),
    ),
)
NODES = Stream(
    name="nodes",
    group="/venue/nodes",
    row="one node of the aisle graph",
    ascending=False,
    columns=(
        _text("id", "name of the node"),
        _metres("x", "x of the node"),
        _metres("y", "y of the node"),
        _LEVEL,
    ),
)
EDGES = Stream(
    name="edges",
    group="/venue/edges",
    row="one edge of the aisle graph",
    ascending=False,
    columns=(
        Column(
            name="first",
            field="first",
            dtype="int32",
            units="1",
            long_name="first node, row of /venue/nodes",
        ),
        Column(
            name="second",
            field="second",
            dtype="int32",
            units="1",
            long_name="second node, row of /venue/nodes",
        ),
        _text("branch", "aisle or connecting aisle the edge belongs to"),
        Column(
            name="one_way",
            field="one_way",
            dtype="uint8",
            units="1",
            long_name="whether the edge may be walked from first to second node only",
            flags=(("both_ways", 0), ("one_way", 1)),
        ),
    ),
)
RUNS = Stream(
    name="runs",
    group="/runs",
    row="one estimator tried on one walk",
    ascending=False,
    columns=(
        _text("estimator", "label of the estimator"),
        _text("walk", "name of the walk"),
        _text("failure", "why there is no track; empty where there is one"),
    ),
)
PEOPLE = Stream(
    name="people",
    group="/truth/people",
    row="one person who was in the venue while it was open",
    ascending=False,
    columns=(
        _text("person", "name of the person, the walker of /walks where a phone was recorded"),
        Column(
            name="role",
            field="role",
            dtype="uint8",
            units="1",
            long_name="what the person was there for",
            flags=ROLES,
        ),
        _text("group", "who came together; empty for a person alone"),
    ),
)
STATIC = (NODES, EDGES, BEACONS, WALKS)
# Tables whose rows own stretches of rows of other streams.
COUNTED = {
    WALKS.group: (*OBSERVATIONS, *TRUTH),
    PEOPLE.group: (CROWD,),
    RUNS.group: (TRACK,),
}
