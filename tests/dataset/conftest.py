"""A small recording with everything in it, and its truth."""

from types import MappingProxyType
from uuid import UUID

import numpy as np
import pytest
import shapely

from blesim.columns import BEACON_EVENTS, IMU
from blesim.recording import (
    Crowd,
    Observations,
    Person,
    Provenance,
    Recording,
    Role,
    Truth,
    Walk,
    WalkKind,
    WalkTruth,
)
from blesim.tables import (
    BeaconHistory,
    Carrying,
    Headings,
    Imu,
    Marks,
    Packets,
    Pressures,
    Readings,
    Steps,
    StepTruth,
    Trajectory,
    Visits,
)
from blesim.venue.beacons import Beacon
from blesim.venue.floor_plan import FloorPlan, Level, Obstacle
from blesim.venue.graph import AisleGraph, Edge, Node
from blesim.venue.sections import Section
from blesim.venue.venue import Georeference, Venue


def _beacon(number: int, x_m: float) -> Beacon:
    return Beacon(
        id=f"B{number}",
        uuid=UUID("f7826da6-4fa2-4e98-8024-bc5b71e0893e"),
        major=1,
        minor=number,
        x_m=x_m,
        y_m=2.0,
        z_m=1.5,
        tx_power_dbm=-12.0,
        measured_power_dbm=-71.0,
        advertising_interval_s=0.35,
        channel_gain_db=(0.0, -1.5, 0.25),
    )


@pytest.fixture(scope="session")
def venue() -> Venue:
    return Venue(
        name="Prüfstand",
        floor_plan=FloorPlan(
            levels=(Level(level=0, bounds=shapely.box(0, 0, 20, 10)),),
            obstacles=(
                Obstacle(id="S1", outline=shapely.box(2, 2, 18, 3), material="gondola-dry"),
                Obstacle(
                    id="S2", outline=shapely.box(2, 7, 18, 8), material="bookcase", height_m=1.8
                ),
            ),
        ),
        beacons=(_beacon(1, 4.0), _beacon(2, 10.1), _beacon(3, 16.0)),
        graph=AisleGraph(
            nodes=(Node(id="a", x_m=1, y_m=5), Node(id="b", x_m=19, y_m=5)),
            edges=(Edge(first="a", second="b", branch="A1", one_way=True),),
        ),
        sections=(Section(id="tea", category="drinks", branch="A1", start_m=(3, 5), end_m=(5, 5)),),
        georeference=Georeference(latitude_deg=48.0, longitude_deg=11.5, bearing_deg=12.0),
    )


def _observations(rng: np.random.Generator, count: int) -> Observations:
    time_us = np.cumsum(rng.integers(0, 20_000, count))
    axes = {column.field: rng.normal(size=count) for column in IMU.columns[1:]}
    return Observations(
        readings=Readings(
            time_us=time_us,
            beacon=rng.integers(0, 3, count),
            rssi_dbm=rng.integers(-100, -50, count),
            channel=rng.choice([0, 37, 38, 39], count),
            proximity=rng.integers(0, 4, count),
        ),
        imu=Imu(time_us=time_us, **axes),
        steps=Steps(
            time_us=time_us[::10],
            length_m=rng.uniform(0.5, 0.8, len(time_us[::10])),
            heading_rad=rng.uniform(-3, 3, len(time_us[::10])),
        ),
        marks=Marks(time_us=[0, 5], x_m=[1.0, 2.0], y_m=[5.0, 5.0], level=[0, 0]),
        headings=Headings(time_us=time_us[::5], heading_rad=rng.uniform(-3, 3, len(time_us[::5]))),
        pressures=Pressures(
            time_us=time_us[::7], pressure_hpa=rng.uniform(990, 1010, len(time_us[::7]))
        ),
    )


def _truth(rng: np.random.Generator, observations: Observations) -> WalkTruth:
    end_us = int(observations.readings.time_us[-1])
    count = len(observations.readings)
    parts = ("path_loss", "obstacle_loss", "shadowing", "fading", "body_loss")
    return WalkTruth(
        trajectory=Trajectory(
            time_us=[0, end_us],
            x_m=[1.0, 19.0],
            y_m=[5.0, 5.0],
            level=[0, 0],
            heading_rad=[0.0, np.nan],
            speed_m_s=[1.25, 0.0],
            edge=[0, 0],
            offset_m=[0.0, 18.0],
            edge_speed_m_s=[1.25, 0.0],
            state=[1, 0],
        ),
        steps=StepTruth(time_us=[3], length_m=[0.7], heading_rad=[0.1], foot=[1]),
        packets=Packets(
            time_us=observations.readings.time_us,
            beacon=observations.readings.beacon,
            channel=rng.choice([37, 38, 39], count),
            fate=rng.integers(0, 6, count),
            distance_m=rng.uniform(1, 20, count),
            power_dbm=rng.uniform(-90, -60, count),
            **{f"{part}_db": rng.normal(size=count) for part in parts},
        ),
        carrying=Carrying(time_us=[0, end_us // 2], carrying=[0, 3]),
    )


def _person(name: str, role: Role, start_us: int) -> Person:
    walked = Trajectory(
        time_us=[start_us, start_us + 4_000_000],
        x_m=[1.0, 3.0],
        y_m=[5.0, 5.5],
        level=[0, 0],
        heading_rad=[0.2, 0.2],
        speed_m_s=[0.0, 1.03],
        acceleration_m_s2=[0.2577, 0.0],
        edge=[0, 0],
        offset_m=[0.0, 2.0],
        edge_speed_m_s=[0.5, 0.0],
        state=[1, 0],
    )
    return Person(name=name, role=role, group="family", trajectory=walked)


@pytest.fixture(scope="session")
def truth(recording: Recording, venue: Venue) -> Truth:
    rng = np.random.default_rng(2)
    return Truth(
        venue=venue.with_beacons((*venue.beacons, _beacon(4, 17.0))),
        walks=MappingProxyType(
            {walk.name: _truth(rng, walk.observations) for walk in recording.walks}
        ),
        beacon_events=BeaconHistory(
            time_us=[5, 5, 900],
            beacon=[0, 3, 0],
            event=[dict(BEACON_EVENTS)[name] for name in ("sags", "moves", "dies")],
            x_m=[4.0, 17.5, 4.0],
            y_m=[2.0, 2.0, 2.0],
            z_m=[1.5, 1.5, 1.5],
            level=[0, 0, 0],
            power_change_db=[-3.0, 0.0, -3.0],
        ),
        crowd=Crowd(
            people=(_person("Eva", Role.SHOPPER, 0), _person("Bo", Role.STAFF, 77)),
            visits=Visits(time_us=[80, 90], person=[1, 0], section=[0, 0], dwell_us=[0, 3_000_000]),
        ),
    )


@pytest.fixture(scope="session")
def recording(venue: Venue) -> Recording:
    rng = np.random.default_rng(1)
    common = {"walker": "Ana", "phone": "pixel"}
    return Recording(
        venue=venue,
        walks=(
            Walk(
                name="radio map",
                kind=WalkKind.SURVEY,
                split="tuning",
                observations=_observations(rng, 90),
                **common,
            ),
            Walk(name="1", observations=_observations(rng, 700), **common),
            Walk(name="2", carrying="Tasche", observations=_observations(rng, 40), **common),
        ),
        provenance=Provenance(
            title="everything in it",
            source="blesim 0.1.0",
            scenario="venue: Prüfstand\n",
            seed=2**64 - 1,
            references="nobody",
        ),
    )
