import numpy as np
import pytest

from blesim import columns
from blesim.errors import UsageError
from blesim.radio.advertising import Advertising
from blesim.radio.air import Air, Propagation
from blesim.radio.fading import Fading
from blesim.radio.phone import Phone, Receiver, Scanner
from blesim.radio.shadowing import Shadowing
from blesim.venue.graph import GraphPosition
from blesim.walkers.itinerary import Itinerary, Stop
from blesim.walkers.walker import simulate_walkers

FATE = dict(columns.FATES)
SEED = 21
QUIET = Propagation(
    path_loss_exponent=1.0,
    shadowing=Shadowing(standard_deviation_db=0.0),
    fading=Fading(model="none"),
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
    result = heard(section, trajectory, Propagation(), Phone(scanner=Scanner(window_ms=2000)))
    packets = result.packets
    counts = {name: int((packets.fate == number).sum()) for name, number in columns.FATES}
    assert counts["received"] == len(result.readings)
    assert sum(counts.values()) == len(packets)
    assert counts["out_of_window"] / len(packets) == pytest.approx(1 - 2000 / 4096, abs=0.06)
    listened = counts["received"] + counts["below_sensitivity"] + counts["random_loss"]
    assert counts["other_channel"] == pytest.approx(2 * listened, rel=0.02)
    # 9 % +- 4 standard errors.
    assert counts["random_loss"] / listened == pytest.approx(0.09, abs=4 * (0.09 / listened) ** 0.5)


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
        readings = heard(venue, trajectory, Propagation(), Phone()).readings
        ids = np.array([beacon.id for beacon in venue.beacons])[readings.beacon]
        kept = ~np.isin(ids, ["E5", "new"])
        columns_kept = (ids[kept], readings.time_us[kept], readings.rssi_dbm[kept])
        rows[name] = list(zip(*columns_kept, strict=True))
    assert len(rows["before"]) > 500
    assert rows["before"] == rows["after"]


def test_another_walker_or_seed_hears_otherwise_in_the_same_shadows(section):
    trajectory = walk_along(section, "E1", "E9")
    one = heard(section, trajectory, Propagation(), Phone()).packets
    two = heard(section, trajectory, Propagation(), Phone(), walker="v").packets
    assert np.array_equal(one.time_us, two.time_us)
    assert np.array_equal(one.shadowing_db, two.shadowing_db)
    assert abs(np.corrcoef(one.fading_db, two.fading_db)[0, 1]) < 4 / np.sqrt(len(one))
    third = heard(section, trajectory, Propagation(), Phone(), seed=SEED + 1).packets
    assert not np.array_equal(one.shadowing_db[:100], third.shadowing_db[:100])


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


def test_a_beacon_on_another_level_is_refused(section):
    upstairs = (section.beacons[0].model_copy(update={"level": 1}), *section.beacons[1:])
    venue = section.with_beacons(section.beacons)
    object.__setattr__(venue, "beacons", upstairs)
    with pytest.raises(UsageError, match="one level is simulated at a time"):
        heard(venue, walk_along(section, "E1", "E2"))
