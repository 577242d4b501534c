import numpy as np
import pytest

from blesim.radio.air import Air
from blesim.radio.phone import SCAN_MODES
from blesim.radio.profiles import PROFILES
from blesim.radio.propagation import Propagation
from blesim.units import MICROSECONDS_PER_SECOND
from blesim.walkers.itinerary import Itinerary, Stop
from blesim.walkers.walker import simulate_walkers


@pytest.mark.parametrize(
    ("name", "share", "within"),
    # Measured in uji_library: scans of a second that heard a beacon of 200 ms above -80 dBm,
    # once the scanner had started up: 0.49 to 0.61, 0.86 to 0.88 and 0.99 to 1.00.
    [("uji-a5", 0.55, 0.07), ("uji-bq", 0.87, 0.05), ("uji-s6", 0.995, 0.006)],
)
def test_strong_beacons_are_heard_in_the_measured_share_of_seconds(section, name, share, within):
    seconds = 2000
    beacon = section.beacons[0].model_copy(
        update={"measured_power_dbm": -50.0, "advertising_interval_s": 0.2}
    )
    venue = section.with_beacons((beacon,))
    stops = tuple(
        Stop(place=venue.graph.at_node(node), pause_s=pause_s)
        for node, pause_s in (("D/west", seconds), ("D/east", 0.0))
    )
    itinerary = Itinerary(walker="still", stops=stops, speed_m_s=1.0, start_s=0.0)
    still = simulate_walkers(venue.graph, (itinerary,))[0].trajectory()
    radio = Propagation(path_loss_exponent=1.0)
    air = Air.over(venue, radio, 1, 2 * seconds * MICROSECONDS_PER_SECOND)
    readings = air.heard_by(PROFILES[name], "still", still, keep_packets=False).readings
    second = np.unique(readings.time_us // MICROSECONDS_PER_SECOND)
    heard = np.count_nonzero(second < seconds) / seconds
    assert heard == pytest.approx(share, abs=within)


def test_two_phones_of_one_maker_are_11_db_apart():
    strong, weak = PROFILES["pair-strong"].receiver, PROFILES["pair-weak"].receiver
    assert strong.offset_db - weak.offset_db == 11.0


def test_the_slow_phone_is_silent_for_1_4_s():
    scanner = PROFILES["slow-phone"].scanner
    assert scanner.interval_us - scanner.window_us == 1_400_000


@pytest.mark.parametrize("name", ["low-latency", "balanced", "low-power"])
def test_a_current_phone_scans_as_its_mode_says(name):
    scanner = PROFILES[f"android-{name}"].scanner
    window_ms, interval_ms = SCAN_MODES[f"android-2023-{name}"]
    assert (scanner.window_us, scanner.interval_us) == (1000 * window_ms, 1000 * interval_ms)


def test_what_each_system_tells():
    telling = {name for name, phone in PROFILES.items() if phone.tells_channel}
    assert telling == {"nrf52-sniffer", "iphone-4s"}
    classes = {name for name, phone in PROFILES.items() if phone.delivery.mode != "each"}
    assert classes == {"iphone-5c", "nexus-9"}
    assert {name for name, phone in PROFILES.items() if phone.scanner.all_channels} == {
        "nrf52-sniffer"
    }
    assert not PROFILES["nrf52-sniffer"].held
