from dataclasses import replace

import numpy as np
import pytest

from blesim import columns
from blesim.radio.air import Air
from blesim.radio.carrying import Bag, Pocket, Trolley, WaysOfCarrying
from blesim.radio.collisions import Collisions
from blesim.radio.fading import Fading
from blesim.radio.people import People
from blesim.radio.phone import Phone, Receiver
from blesim.radio.propagation import Propagation
from blesim.radio.shadowing import Shadowing
from blesim.tables import Carrying
from blesim.walkers.itinerary import Itinerary, Stop
from blesim.walkers.walker import simulate_walkers

WAY = dict(columns.CARRYINGS)
SEED = 31
BODILESS = People(body_loss_db=0.0, sway_m=0.0, crossing_db=0.0)
QUIET = Propagation(
    shadowing=Shadowing(standard_deviation_db=0.0),
    fading=Fading(model="none"),
    people=BODILESS,
    collisions=Collisions(model="none"),
)
PHONE = Phone(receiver=Receiver(noise_db=0.0, random_loss=0.0, sensitivity_dbm=-120.0))


def carried(*rows):
    """A timeline of (time in seconds, name of the way)."""
    return Carrying(
        time_us=np.array([int(time_s * 1e6) for time_s, _ in rows]),
        carrying=np.array([WAY[name] for _, name in rows]),
    )


@pytest.fixture(scope="module")
def eastwards(section):
    """Along aisle D towards larger x, after 20 s of standing at its western end."""
    stops = (
        Stop(place=section.graph.at_node("D1"), pause_s=20.0),
        Stop(place=section.graph.at_node("D5"), pause_s=0.0),
    )
    itinerary = Itinerary(walker="w", stops=stops, speed_m_s=1.0)
    return simulate_walkers(section.graph, (itinerary,))[0].trajectory()


def packets(venue, trajectory, *rows, propagation=QUIET, phone=PHONE):
    air = Air.over(venue, propagation, SEED, int(trajectory.time_us[-1]) + 1)
    timeline = carried(*rows) if rows else None
    heard = air.heard_by(phone, "w", trajectory, keep_packets=True, carrying=timeline)
    return heard.packets


def test_every_way_of_the_file_has_its_settings():
    assert tuple(WaysOfCarrying.model_fields) == tuple(WAY)


def test_one_number_may_be_given_and_the_others_stay():
    people = People.model_validate({"carrying": {"pocket": {"loss_db": 10.0}, "bag": {}}})
    assert people.carrying.pocket == Pocket(loss_db=10.0)
    assert people.carrying.pocket.height_m == 0.9
    assert people.carrying.bag == Bag()
    with pytest.raises(ValueError, match="extra"):
        People.model_validate({"carrying": {"sleeve": {}}})


@pytest.mark.parametrize("way", ["hand", "flat"])
def test_in_front_of_the_body_is_as_without_a_timeline(section, eastwards, way):
    propagation = Propagation()
    plain = packets(section, eastwards, propagation=propagation, phone=Phone())
    assert packets(section, eastwards, (0, way), propagation=propagation, phone=Phone()) == plain
    empty = Air.over(section, propagation, SEED, int(eastwards.time_us[-1]) + 1).heard_by(
        Phone(), "w", eastwards, keep_packets=True, carrying=Carrying.empty()
    )
    assert empty.packets == plain


@pytest.mark.parametrize(
    ("way", "height_m", "loss_db"),
    [
        ("hand", 1.1, 0.0),
        ("flat", 1.1, 0.0),
        ("swinging", 0.75, 0.0),
        # Half of the 15 to 19 dB between links from pocket to pocket and from hand to hand.
        ("pocket", 0.9, 8.0),
        ("bag", 0.9, 4.0),
        ("trolley", 1.0, 3.0),
    ],
)
def test_each_way_has_its_height_and_its_loss(section, eastwards, way, height_m, loss_db):
    phone = PHONE.model_copy(update={"height_m": 1.1})
    found = packets(section, eastwards, (0, way), phone=phone)
    assert set(found.body_loss_db.tolist()) == {loss_db}
    poses = eastwards.at(found.time_us)
    ahead_m = 0.5 if way == "trolley" else 0.0
    phone_m = np.stack(
        [
            poses.x_m + ahead_m * np.cos(poses.heading_rad),
            poses.y_m + ahead_m * np.sin(poses.heading_rad),
            np.full(len(found), height_m),
        ],
        axis=1,
    )
    expected_m = np.linalg.norm(section.beacon_xyz_m[found.beacon] - phone_m, axis=1)
    assert found.distance_m == pytest.approx(expected_m, abs=1e-3)


def test_from_the_switch_on_it_is_carried_otherwise(section, eastwards):
    hand, pocket = (packets(section, eastwards, (0, way)) for way in ("hand", "pocket"))
    both = packets(section, eastwards, (0, "hand"), (30, "pocket"), (40, "hand"))
    inside = (both.time_us >= 30_000_000) & (both.time_us < 40_000_000)
    assert 100 < inside.sum() < len(both) / 2
    assert both.rows(inside) == pocket.rows(inside)
    assert both.rows(~inside) == hand.rows(~inside)


@pytest.mark.parametrize(
    ("way", "cosine"),
    [
        # Walking east, the beacons of aisle D hang to the south or north of the walk.
        ("hand", lambda along, _: along),
        ("pocket", lambda along, _: along),
        ("trolley", lambda along, _: along),
        ("bag", lambda _, left: -left),
        ("swinging", lambda _, left: -left),
    ],
)
def test_the_body_shadows_the_side_away_from_the_phone(section, eastwards, way, cosine):
    people = BODILESS.model_copy(update={"body_loss_db": 10.0})
    found = packets(
        section, eastwards, (0, way), propagation=QUIET.model_copy(update={"people": people})
    )
    moving = (found.time_us > 21_000_000) & (found.time_us < eastwards.time_us[-1] - 1_000_000)
    found = found.rows(moving)
    poses = eastwards.at(found.time_us)
    assert poses.heading_rad == pytest.approx(0.0, abs=1e-6)
    settings = getattr(people.carrying, way)
    away_m = section.beacon_xyz_m[found.beacon, :2] - np.stack([poses.x_m, poses.y_m], axis=1)
    away_m[:, 0] -= settings.ahead_m
    towards = cosine(*(away_m.T / found.distance_m))
    expected_db = 5.0 * (1 - towards) + settings.loss_db
    assert np.ptp(expected_db) > 8
    assert found.body_loss_db == pytest.approx(expected_db, abs=2e-3)


def test_a_share_of_the_body_counts(section, eastwards):
    def with_share(share):
        ways = WaysOfCarrying(pocket=Pocket(body_share=share, loss_db=0.0))
        people = BODILESS.model_copy(update={"body_loss_db": 10.0, "carrying": ways})
        return packets(
            section,
            eastwards,
            (0, "pocket"),
            propagation=QUIET.model_copy(update={"people": people}),
        ).body_loss_db

    assert with_share(0.5) == pytest.approx(0.5 * with_share(1.0), abs=2e-3)
    assert not with_share(0.0).any()


def test_a_standing_trolley_does_not_sway_with_its_carrier(section, eastwards):
    people = BODILESS.model_copy(update={"sway_m": 0.05})
    propagation = QUIET.model_copy(update={"people": people})
    distances = {}
    for way in ("hand", "trolley"):
        found = packets(section, eastwards, (0, way), propagation=propagation)
        still = found.rows((found.time_us < 19_000_000) & (found.beacon == 3))
        distances[way] = np.unique(still.distance_m)
    assert len(distances["hand"]) > 20
    assert len(distances["trolley"]) == 1


def test_without_a_heading_a_trolley_is_where_the_walk_is(section, eastwards):
    unknown = replace(eastwards, heading_rad=np.full(len(eastwards), np.nan))
    low = QUIET.model_copy(update={"people": BODILESS.model_copy(update={"body_loss_db": 10.0})})
    found = packets(section, unknown, (0, "trolley"), propagation=low)
    at_hand = PHONE.model_copy(update={"height_m": 1.0})
    assert found.distance_m == pytest.approx(
        packets(section, eastwards, phone=at_hand).distance_m, abs=1e-4
    )
    assert set(found.body_loss_db.tolist()) == {Trolley().loss_db}


def test_a_tripod_is_not_carried(section, eastwards):
    tripod = PHONE.model_copy(update={"held": False})
    plain = packets(section, eastwards, phone=tripod)
    assert packets(section, eastwards, (0, "pocket"), phone=tripod) == plain
    assert not plain.body_loss_db.any()
