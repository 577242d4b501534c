import pytest

from blesim.radio.phone import SCAN_MODES
from blesim.radio.profiles import PROFILES


@pytest.mark.parametrize(
    ("name", "share"),
    # Measured in uji_library: one-second rows in which a strong beacon of 200 ms was heard.
    [("uji-a5", 0.40), ("uji-bq", 0.67), ("uji-s6", 0.78), ("moto-g3", 0.78)],
)
def test_five_packets_a_second_are_heard_in_the_measured_share_of_seconds(name, share):
    phone = PROFILES[name]
    assert phone.scanner.window_us == phone.scanner.interval_us
    assert 1.0 - phone.receiver.random_loss**5 == pytest.approx(share, abs=0.003)


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
