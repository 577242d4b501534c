import numpy as np
import pytest

from blesim.radio.packets import OTHER_CHANNEL, OUT_OF_WINDOW, RECEIVED, Scan, packets_sent

FOREVER = (-(10**9), 10**9)


def sent(events_us, scan, between_us=FOREVER, *, keep_all=True, first_event=0):
    events = np.array(events_us, dtype=np.int64)
    return packets_sent(events, first_event, 1000, 368, between_us, scan, keep_all=keep_all)


def test_packets_stand_channel_after_channel_with_their_ordinals():
    packets = sent([0, 350_000], Scan(0, 10**8, 10**8, True), first_event=7)
    assert packets.time_us.tolist() == [0, 350_000, 1000, 351_000, 2000, 352_000]
    assert packets.channel.tolist() == [37, 37, 38, 38, 39, 39]
    assert packets.ordinal.tolist() == [21, 24, 22, 25, 23, 26]
    assert packets.first.tolist() == [0, 2, 4, 6]


def test_a_scanner_listens_to_one_channel_after_the_other():
    scan = Scan(0, 100_000, 60_000, False)
    packets = sent([0, 59_632, 59_633, 100_000, 250_000, 300_000], scan)
    of_37 = packets.fate[packets.channel == 37]
    window, other = OUT_OF_WINDOW, OTHER_CHANNEL
    assert of_37.tolist() == [RECEIVED, RECEIVED, window, other, other, RECEIVED]
    of_38 = packets.fate[packets.channel == 38]
    assert of_38.tolist() == [other, window, window, RECEIVED, other, other]


def test_only_what_is_listened_to_is_kept_unless_all_is_wanted():
    scan = Scan(-12_345, 100_000, 60_000, False)
    events = np.arange(0, 10_000_000, 3_777)
    everything, heard = (sent(events, scan, keep_all=keep) for keep in (True, False))
    kept = everything.fate == RECEIVED
    assert np.array_equal(everything.time_us[kept], heard.time_us)
    assert np.array_equal(everything.ordinal[kept], heard.ordinal)
    # A window of 60 of 100 ms, less the length of a packet, on one channel of three.
    assert kept.mean() == pytest.approx((60_000 - 368) / 100_000 / 3, abs=0.01)


def test_a_dedicated_receiver_hears_all_channels_while_it_listens():
    packets = sent(np.arange(0, 10_000_000, 3_777), Scan(0, 100_000, 50_000, True))
    assert (packets.fate == RECEIVED).mean() == pytest.approx(0.5 - 368 / 100_000, abs=0.01)
    assert not (packets.fate == OTHER_CHANNEL).any()


def test_packets_outside_the_times_are_left_out():
    packets = sent([0, 10_000, 20_000], Scan(0, 10**8, 10**8, True), (1000, 20_001))
    assert sorted(packets.time_us.tolist()) == [1000, 2000, 10_000, 11_000, 12_000, 20_000]
