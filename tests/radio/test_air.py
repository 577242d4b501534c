from dataclasses import replace

import numpy as np
import pytest

from blesim import columns
from blesim.radio.advertising import Advertising
from blesim.radio.air import Air
from blesim.radio.beacon_events import Dies, Moves, Reboots, Sags
from blesim.radio.collisions import Collisions
from blesim.radio.delivery import Delivery
from blesim.radio.fading import Fading
from blesim.radio.life import simulate_life
from blesim.radio.people import People
from blesim.radio.phone import Phone, Receiver, Scanner
from blesim.radio.propagation import Propagation
from blesim.radio.shadowing import Shadowing
from blesim.radio.stock import Stock
from blesim.tables import Carrying
from blesim.venue.graph import GraphPosition
from blesim.walkers.itinerary import Itinerary, Stop
from blesim.walkers.walker import simulate_walkers

FATE = dict(columns.FATES)
SEED = 21
QUIET = Propagation(
    path_loss_exponent=1.0,
    shadowing=Shadowing(standard_deviation_db=0.0),
    fading=Fading(model="none"),
    people=People(body_loss_db=0.0, sway_m=0.0, crossing_db=0.0),
    collisions=Collisions(model="none"),
)
PERFECT = Phone(
    receiver=Receiver(noise_db=0.0, random_loss=0.0, sensitivity_dbm=-120.0), tells_channel=True
)


def walk_along(venue, *nodes, speed_m_s=1.0, pause_s=0.0, start_s=0.0, walker="w"):
    stops = tuple(Stop(place=venue.graph.at_node(node), pause_s=pause_s) for node in nodes)
    itinerary = Itinerary(walker=walker, stops=stops, speed_m_s=speed_m_s, start_s=start_s)
    return simulate_walkers(venue.graph, (itinerary,))[0].trajectory()


def heard(venue, trajectory, propagation=QUIET, phone=PERFECT, walker="w", seed=SEED, **options):
    air = Air.over(venue, propagation, seed, int(trajectory.time_us[-1]) + 1)
    return air.heard_by(phone, walker, trajectory, **{"keep_packets": True, **options})


def test_level_of_a_packet_is_the_sum_of_its_components(section):
    propagation = Propagation(path_loss_exponent=1.7)
    packets = heard(section, walk_along(section, "D1", "D5"), propagation).packets
    measured_power = section.beacons[0].measured_power_dbm
    total = (
        measured_power
        - packets.path_loss_db
        - packets.obstacle_loss_db
        + packets.shadowing_db
        + packets.fading_db
        - packets.body_loss_db
    )
    assert packets.power_dbm == pytest.approx(total, abs=0.01)


def test_standing_beside_a_beacon_reads_its_hand_computed_level(section):
    trajectory = walk_along(section, "E4", "E5", pause_s=60.0)
    result = heard(section, trajectory)
    standing = result.readings.time_us < 60_000_000
    beside = standing & (result.readings.beacon == section.beacon_row["E4"])
    # 1.9 m to the face and 1 m up: 77 + 10 log10(2.147) = 80.3.
    assert set(result.readings.rssi_dbm[beside].tolist()) == {-80}
    over = standing & (result.readings.beacon == section.beacon_row["D4"])
    # D4 at (28.1, 15.4), E4 at (20.0, 8.1): 8.1, 7.3 and 1 m apart, a gondola of 3 dB between.
    expected = -77 - 10 * np.log10(np.sqrt(8.1**2 + 7.3**2 + 1)) - 3.0
    assert set(result.readings.rssi_dbm[over].tolist()) == {round(expected)}


def test_only_the_scanned_channel_is_heard_and_told(section):
    trajectory = walk_along(section, "E1", "E9")
    result = heard(section, trajectory, phone=PERFECT.model_copy(update={"scanner": Scanner()}))
    turn_us = np.flatnonzero(np.diff(result.readings.channel))
    # The channel changes every 4.096 s over the 41 s of the walk, in turn.
    assert 9 <= len(turn_us) <= 11
    steps = np.diff(result.readings.channel.astype(int))
    assert set(steps[steps != 0].tolist()) <= {1, -2}
    received = result.packets.rows(result.packets.fate == FATE["received"])
    assert np.array_equal(received.channel, result.readings.channel)


def test_a_phone_that_does_not_tell_hears_the_same(section):
    trajectory = walk_along(section, "E1", "E9")
    told = heard(section, trajectory).readings
    silent = heard(section, trajectory, phone=PERFECT.model_copy(update={"tells_channel": False}))
    assert set(silent.readings.channel.tolist()) == {0}
    assert np.array_equal(silent.readings.rssi_dbm, told.rssi_dbm)
    assert np.array_equal(silent.readings.time_us, told.time_us)


def test_keeping_packets_changes_no_reading(section):
    trajectory = walk_along(section, "E1", "D1")
    propagation, phone = Propagation(), Phone()
    with_packets = heard(section, trajectory, propagation, phone)
    without = heard(section, trajectory, propagation, phone, keep_packets=False)
    assert with_packets.readings == without.readings
    assert len(without.packets) == 0


def test_every_packet_has_a_fate_and_the_received_are_the_readings(section):
    trajectory = walk_along(section, "E1", "E9", "F8")
    result = heard(
        section, trajectory, Propagation(), Phone(scanner=Scanner(interval_ms=4096, window_ms=2000))
    )
    packets = result.packets
    counts = {name: int((packets.fate == number).sum()) for name, number in columns.FATES}
    assert all(counts.values())
    assert counts["received"] == len(result.readings)
    assert sum(counts.values()) == len(packets)
    assert counts["out_of_window"] / len(packets) == pytest.approx(1 - 2000 / 4096, abs=0.06)
    listened = len(packets) - counts["out_of_window"] - counts["other_channel"]
    assert counts["other_channel"] == pytest.approx(2 * listened, rel=0.1)
    # 9 % of what did not collide, +- 4 standard errors.
    alone = listened - counts["collision"]
    assert counts["random_loss"] / alone == pytest.approx(0.09, abs=4 * (0.09 / alone) ** 0.5)


def test_three_packets_an_event_at_their_spacing(section):
    trajectory = walk_along(section, "E1", "E9")
    propagation = QUIET.model_copy(update={"advertising": Advertising(packet_spacing_us=2500)})
    packets = heard(section, trajectory, propagation).packets
    one = packets.rows(packets.beacon == 4)
    assert one.channel.reshape(-1, 3).tolist() == [[37, 38, 39]] * (len(one) // 3)
    assert (np.diff(one.time_us.reshape(-1, 3), axis=1) == 2500).all()


def test_per_channel_gains_of_beacon_and_phone_add_up(section):
    gains = (-2.9, -1.4, 4.1)
    beacons = tuple(b.model_copy(update={"channel_gain_db": gains}) for b in section.beacons)
    louder = section.with_beacons(beacons)
    phone = PERFECT.model_copy(
        update={"receiver": PERFECT.receiver.model_copy(update={"offset_db": 5.0})}
    )
    trajectory = walk_along(section, "E1", "E9")
    plain = heard(section, trajectory).packets
    changed = heard(louder, trajectory, phone=phone).packets
    expected = np.array(gains)[plain.channel.astype(int) - 37] + 5.0
    assert changed.power_dbm - plain.power_dbm == pytest.approx(expected, abs=0.002)


@pytest.mark.parametrize("change", ["remove", "add", "move"])
def test_changing_one_beacon_leaves_every_other_reading_bit_identical(section, change):
    trajectory = walk_along(section, "D8", "E9", "E1", "F1")
    odd = section.beacon_row["E5"]
    others = [beacon for beacon in section.beacons if beacon.id != "E5"]
    moved = section.beacons[odd].model_copy(update={"x_m": 30.0})
    extra = section.beacons[odd].model_copy(update={"id": "new", "x_m": 29.0})
    beacons = {
        "remove": others,
        "add": [*section.beacons, extra],
        "move": [moved if beacon.id == "E5" else beacon for beacon in section.beacons],
    }[change]
    changed = section.with_beacons(tuple(beacons))
    rows = {}
    for name, venue in (("before", section), ("after", changed)):
        alone = Propagation(path_loss_exponent=1.2, collisions=Collisions(model="none"))
        readings = heard(venue, trajectory, alone, Phone()).readings
        ids = np.array([beacon.id for beacon in venue.beacons])[readings.beacon]
        kept = ~np.isin(ids, ["E5", "new"])
        columns_kept = (ids[kept], readings.time_us[kept], readings.rssi_dbm[kept])
        rows[name] = list(zip(*columns_kept, strict=True))
    assert len(rows["before"]) > 500
    assert rows["before"] == rows["after"]


def test_with_collisions_only_readings_that_overlapped_differ(section):
    trajectory = walk_along(section, "D8", "E9", "E1", "F1")
    propagation = Propagation(path_loss_exponent=1.0)
    fewer = section.with_beacons(tuple(b for b in section.beacons if b.id != "E5"))
    before, after = (heard(venue, trajectory, propagation, Phone()) for venue in (section, fewer))
    odd = before.packets.rows(before.packets.beacon == section.beacon_row["E5"])
    ids = np.array([beacon.id for beacon in section.beacons])
    rows = []
    for venue, packets in ((section, before.packets), (fewer, after.packets)):
        names = np.array([beacon.id for beacon in venue.beacons])[packets.beacon]
        kept = names != "E5"
        rows.append(
            (names[kept], packets.time_us[kept], packets.fate[kept], packets.power_dbm[kept])
        )
    assert np.array_equal(rows[0][0], rows[1][0])
    assert np.array_equal(rows[0][1], rows[1][1])
    assert np.array_equal(rows[0][3], rows[1][3])
    differ = rows[0][2] != rows[1][2]
    assert 0 < differ.sum() < 0.02 * len(differ)
    nearest_us = np.abs(odd.time_us[None, :] - rows[0][1][differ][:, None]).min(axis=1)
    assert (nearest_us < 368).all()
    assert set(ids) == {beacon.id for beacon in section.beacons}


def test_another_walker_or_seed_hears_otherwise_in_the_same_shadows(section):
    trajectory = walk_along(section, "E1", "E9")
    propagation = Propagation(fading=Fading(model="gaussian"))
    one = heard(section, trajectory, propagation, Phone()).packets
    two = heard(section, trajectory, propagation, Phone(), walker="v").packets
    assert np.array_equal(one.time_us, two.time_us)
    assert np.array_equal(one.shadowing_db, two.shadowing_db)
    assert abs(np.corrcoef(one.fading_db, two.fading_db)[0, 1]) < 4 / np.sqrt(len(one))
    third = heard(section, trajectory, propagation, Phone(), seed=SEED + 1).packets
    assert not np.array_equal(one.shadowing_db[:100], third.shadowing_db[:100])


def test_multipath_is_a_place_that_two_walkers_share(section):
    trajectory = walk_along(section, "E1", "E9")
    one = heard(section, trajectory, Propagation(), Phone()).packets
    two = heard(section, trajectory, Propagation(), Phone(), walker="v").packets
    moving = np.isin(trajectory.at(one.time_us).state, [1])
    assert np.array_equal(one.fading_db[moving], two.fading_db[moving])


def test_blocks_change_no_number(section, monkeypatch):
    trajectory = walk_along(section, "D8", "E9", "E1", pause_s=3.0)
    whole = heard(section, trajectory, Propagation(path_loss_exponent=1.0), Phone())
    monkeypatch.setattr("blesim.radio.passage.BLOCK_PACKETS", 500)
    parts = heard(section, trajectory, Propagation(path_loss_exponent=1.0), Phone())
    assert parts.packets == whole.packets
    assert parts.readings == whole.readings


def test_short_blocks_change_no_number_among_people_and_pockets(section, monkeypatch):
    trajectory = walk_along(section, "D8", "E9", "E1", pause_s=3.0)
    others = {str(n): walk_along(section, "D1", f"D{n}", "E9", "D1") for n in range(2, 9)}
    carrying = Carrying(time_us=np.array([0, 20_000_000]), carrying=np.array([3, 5]))

    def with_people():
        until_us, crowd = int(trajectory.time_us[-1]) + 1, {"w": trajectory, **others}
        air = Air.over(section, Propagation(path_loss_exponent=1.0), SEED, until_us, crowd=crowd)
        return air.heard_by(Phone(), "w", trajectory, keep_packets=True, carrying=carrying)

    whole = with_people()
    monkeypatch.setattr("blesim.radio.passage.LONGEST_BLOCK_US", 1_700_000)
    parts = with_people()
    assert parts.packets == whole.packets
    assert parts.readings == whole.readings


def test_a_dedicated_receiver_hears_all_three_channels(section):
    trajectory = walk_along(section, "E1", "E9")
    sniffer = PERFECT.model_copy(update={"scanner": Scanner(all_channels=True), "held": False})
    result = heard(section, trajectory, phone=sniffer)
    assert len(result.readings) == len(result.packets)
    assert set(result.readings.channel.tolist()) == {37, 38, 39}


def test_still_phone_sees_three_levels_one_per_channel(section):
    # Measured: levels of a static link explain 97 % of its variance; noise within one 0.3 to 0.76.
    trajectory = walk_along(section, "E4", "E5", pause_s=120.0)
    sniffer = PERFECT.model_copy(
        update={
            "scanner": Scanner(all_channels=True),
            "held": False,
            "receiver": Receiver(random_loss=0.0, sensitivity_dbm=-120.0),
        }
    )
    readings = heard(section, trajectory, Propagation(), sniffer).readings
    readings = readings.rows(readings.time_us < 120_000_000)
    shares, spreads = [], []
    for beacon in range(len(section.beacons)):
        rows = readings.beacon == beacon
        levels = [readings.rssi_dbm[rows & (readings.channel == c)] for c in (37, 38, 39)]
        within = np.mean([np.var(level.astype(float)) for level in levels])
        shares.append(1 - within / np.var(readings.rssi_dbm[rows].astype(float)))
        spreads.append(np.std([level.mean() for level in levels]))
        assert 0.3 <= np.sqrt(within) <= 0.76
    assert np.median(shares) > 0.9
    assert 1.5 < np.median(spreads) < 5


def test_body_swings_the_level_by_its_front_to_back_loss(section):
    propagation = QUIET.model_copy(update={"people": People(body_loss_db=12.0, sway_m=0.0)})
    there = heard(section, walk_along(section, "E1", "E9"), propagation).packets
    ahead = there.rows(there.beacon == section.beacon_row["E9"])
    behind = there.rows(there.beacon == section.beacon_row["E1"])
    early = ahead.time_us < 10_000_000
    late = behind.time_us > 30_000_000
    assert ahead.body_loss_db[early].max() < 0.2
    assert behind.body_loss_db[late].min() > 11.8
    nobody = heard(
        section,
        walk_along(section, "E1", "E9"),
        propagation,
        PERFECT.model_copy(update={"held": False}),
    )
    assert not nobody.packets.body_loss_db.any()


def test_straight_below_a_beacon_swaying_does_not_swing_the_body(section):
    above = section.beacons[0].model_copy(update={"x_m": 20.0, "y_m": 8.1, "z_m": 3.0})
    venue = section.with_beacons((above,))
    propagation = QUIET.model_copy(update={"people": People(body_loss_db=12.0, sway_m=0.03)})
    trajectory = walk_along(venue, "E4", "E5", pause_s=60.0)
    packets = heard(venue, trajectory, propagation).packets
    still = packets.rows(packets.time_us < 59_000_000)
    assert still.body_loss_db == pytest.approx(6.0, abs=0.7)


def test_people_on_the_link_weaken_it(section):
    # One stands at D3 while another walks away from there along the aisle.
    standing = walk_along(section, "D3", "D4", pause_s=200.0, walker="other")
    trajectory = walk_along(section, "D3", "D1", walker="w")
    propagation = QUIET.model_copy(
        update={"people": People(body_loss_db=0, sway_m=0, crossing_db=5)}
    )
    crowd = {"w": trajectory, "other": standing}
    air = Air.over(section, propagation, SEED, int(trajectory.time_us[-1]) + 1, crowd=crowd)
    packets = air.heard_by(PERFECT, "w", trajectory, keep_packets=True).packets
    assert set(np.unique(packets.body_loss_db).tolist()) == {0.0, 5.0}
    blocked = packets.rows(packets.body_loss_db > 0)
    # The other stands to the east of all links that are blocked.
    assert all(section.beacons[row].x_m > 11.9 for row in np.unique(blocked.beacon))
    assert {section.beacons[row].id for row in np.unique(blocked.beacon)} >= {"D7", "D8"}


def test_people_on_another_level_are_not_on_the_link(section):
    trajectory = walk_along(section, "D3", "D1", walker="w")
    standing = walk_along(section, "D3", "D4", pause_s=200.0, walker="other")
    upstairs = replace(standing, level=np.ones(len(standing), int))
    people = People(body_loss_db=0, sway_m=0, crossing_db=5)
    propagation = QUIET.model_copy(update={"people": people})
    crowd = {"w": trajectory, "other": upstairs}
    air = Air.over(section, propagation, SEED, int(trajectory.time_us[-1]) + 1, crowd=crowd)
    assert not air.heard_by(PERFECT, "w", trajectory, keep_packets=True).packets.body_loss_db.any()


def test_floors_cost_what_the_recommendation_says(section):
    trajectory = walk_along(section, "E1", "E2", pause_s=5.0)
    upstairs = tuple(b.model_copy(update={"level": 1}) for b in section.beacons)
    venue = section.with_beacons(section.beacons)
    object.__setattr__(venue, "beacons", upstairs)
    packets = heard(venue, trajectory).packets
    expected = 10 * np.log10(packets.distance_m) + 6
    assert packets.path_loss_db == pytest.approx(expected, abs=0.01)
    # Four metres higher than the 2 m on its own level, and the phone at 1 m.
    assert packets.distance_m.min() >= 5


def test_indoor_model_of_the_recommendation_starts_from_the_transmit_power(section):
    propagation = QUIET.model_copy(update={"path_loss_model": "itu-office"})
    packets = heard(section, walk_along(section, "E1", "E3"), propagation).packets
    frequency_ghz = np.array([2.402, 2.426, 2.48])[packets.channel.astype(int) - 37]
    loss_db = 14.6 * np.log10(packets.distance_m) + 34.62 + 20.3 * np.log10(frequency_ghz)
    assert packets.power_dbm + packets.obstacle_loss_db == pytest.approx(-12.0 - loss_db, abs=0.01)


def test_stock_varies_along_a_shelf_about_its_mean_and_changes_when_told(section):
    trajectory = walk_along(section, "E1", "E9", pause_s=40.0)
    stock = Stock(spread=0.5, change=1.0, hold_s=60.0)
    packets = heard(section, trajectory, QUIET.model_copy(update={"stock": stock})).packets
    crossed = packets.rows(packets.obstacle_loss_db > 0)
    assert len(np.unique(crossed.obstacle_loss_db)) > 20
    assert 1.5 < crossed.obstacle_loss_db.mean() < 6
    still = packets.rows((packets.beacon == section.beacon_row["D2"]) & (packets.time_us < 39e6))
    assert len(np.unique(still.obstacle_loss_db)) == 1


def test_readings_stay_within_the_walk_and_ascend(section):
    trajectory = walk_along(section, "E1", "E3", start_s=7.0)
    readings = heard(section, trajectory).readings
    assert readings.time_us[0] >= 7_000_000
    assert readings.time_us[-1] <= trajectory.time_us[-1]
    assert (np.diff(readings.time_us) >= 0).all()


def test_a_venue_that_nobody_hears_gives_no_reading(section):
    weak = tuple(b.model_copy(update={"measured_power_dbm": -127.0}) for b in section.beacons)
    result = heard(section.with_beacons(weak), walk_along(section, "E1", "E9"), phone=Phone())
    assert len(result.readings) == 0
    assert len(result.packets) > 1000


def test_a_venue_without_beacons_gives_no_reading(section):
    result = heard(section.with_beacons(()), walk_along(section, "E1", "E9"))
    assert len(result.readings) == 0


def test_a_walk_shorter_than_an_event_gives_no_reading(section):
    route = (Stop(place=GraphPosition(3, 0.0)), Stop(place=GraphPosition(3, 0.0001)))
    log = simulate_walkers(section.graph, (Itinerary(walker="w", stops=route),))[0]
    assert len(heard(section, log.trajectory()).readings) == 0


def test_what_befalls_a_beacon_is_heard(section):
    trajectory = walk_along(section, "E4", "E5", pause_s=120.0)
    until_us = int(trajectory.time_us[-1]) + 1
    events = (
        Dies(at_s=30.0, beacon="E4"),
        Sags(at_s=20.0, beacon="E3", power_db=-6.0, duration_s=0.0),
        Reboots(at_s=40.0, beacon="D4", off_s=10.0),
        Moves(at_s=50.0, beacon="F4", x_m=19.0, y_m=4.6),
    )
    spells = simulate_life(section.beacons, events, until_us).spells
    air = Air.over(section, QUIET, SEED, until_us, spells=spells)
    changed = air.heard_by(PERFECT, "w", trajectory, keep_packets=True).packets
    plain = heard(section, trajectory).packets

    def of(packets, beacon, begin_s=0.0, end_s=120.0):
        inside = (packets.time_us >= begin_s * 1e6) & (packets.time_us < end_s * 1e6)
        return packets.rows(inside & (packets.beacon == section.beacon_row[beacon]))

    assert len(of(changed, "E4", 30)) == 0
    assert of(changed, "E4", 0, 30) == of(plain, "E4", 0, 30)
    sagged, fresh = of(changed, "E3", 20), of(plain, "E3", 20)
    assert np.array_equal(sagged.time_us, fresh.time_us)
    assert sagged.power_dbm == pytest.approx(fresh.power_dbm - 6.0, abs=0.002)
    assert len(of(changed, "D4", 40, 50)) == 0
    assert of(changed, "D4", 0, 40) == of(plain, "D4", 0, 40)
    assert len(of(changed, "D4", 50)) == pytest.approx(len(of(plain, "D4", 50)), rel=0.02)
    assert not np.array_equal(of(changed, "D4", 50).time_us, of(plain, "D4", 50).time_us)
    # From (28.1, 4.6) to one metre from the phone's x: seen past the same gondola, but nearer.
    assert of(changed, "F4", 50).distance_m.mean() < of(plain, "F4", 50).distance_m.mean() - 3
    others = ~np.isin(plain.beacon, [section.beacon_row[name] for name in ("E4", "E3", "D4", "F4")])
    rest = ~np.isin(changed.beacon, [section.beacon_row[name] for name in ("E4", "E3", "D4", "F4")])
    assert changed.rows(rest) == plain.rows(others)


def test_a_beacon_on_a_wall_sends_forwards(section):
    facing = tuple(
        b.model_copy(update={"facing_deg": -90.0, "front_to_back_db": 10.0})
        for b in section.beacons
    )
    trajectory = walk_along(section, "E1", "E9")
    plain = heard(section, trajectory).packets
    aimed = heard(section.with_beacons(facing), trajectory).packets
    loss_db = plain.power_dbm - aimed.power_dbm
    # E beacons face aisle E; F beacons turn their back on it.
    of_e = np.isin(plain.beacon, [section.beacon_row[f"E{n}"] for n in range(1, 10)])
    beside = of_e & (plain.distance_m < 2.5)
    assert loss_db[beside].max() < 2.0
    of_f = np.isin(plain.beacon, [section.beacon_row[f"F{n}"] for n in range(1, 9)])
    assert loss_db[of_f].min() > 5.0
    assert loss_db.max() <= 10.001


def test_an_eddystone_is_on_air_longer(section):
    longer = tuple(b.model_copy(update={"payload": "eddystone-uid"}) for b in section.beacons)
    trajectory = walk_along(section, "E1", "E2")
    plain, later = (heard(v, trajectory).readings for v in (section, section.with_beacons(longer)))
    assert np.array_equal(later.time_us, plain.time_us + 8)


def test_a_system_that_averages_reports_once_a_second(section):
    phone = PERFECT.model_copy(update={"delivery": Delivery(mode="one-second-mean")})
    trajectory = walk_along(section, "E1", "E9", start_s=3.0)
    readings = heard(section, trajectory, phone=phone).readings
    assert set(((readings.time_us - 3_000_000) % 1_000_000).tolist()) == {0}
    pairs = list(zip(readings.time_us.tolist(), readings.beacon.tolist(), strict=True))
    assert len(set(pairs)) == len(pairs)
    assert set(readings.proximity.tolist()) <= {1, 2, 3}
