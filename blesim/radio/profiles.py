"""Phones and receivers by name: what was measured of each, what is specified, what is assumed.

``measured`` numbers come from recordings, ``spec`` from Android's sources (see
`blesim.radio.phone.SCAN_MODES`) or Apple's documentation, ``paper`` from the experiment a phone was
used in; everything else is ``assumed``. Where nothing is said, the defaults of the models hold.

A phone gets fewer packets than its scan windows promise. Where only the share p of one-second rows
is known in which it heard a strong beacon that sends five times a second, each event is taken to be
lost on its own with the probability ``(1 - p)^(1/5)``.
"""

from collections.abc import Mapping
from types import MappingProxyType

from blesim.radio.delivery import Delivery
from blesim.radio.phone import Phone, Receiver, Scanner

PROFILES: Mapping[str, Phone] = MappingProxyType(
    {
        # Dedicated receivers on the three channels at once, as philotuxo's and mitll_static's.
        # Measured: 9 % lost even when strong, 0.4 dB of noise, the soft edge at -95 dBm; they tell
        # the channel. Assumed: on a tripod.
        "nrf52-sniffer": Phone(
            scanner=Scanner(interval_ms=100.0, window_ms=100.0, all_channels=True),
            receiver=Receiver(noise_db=0.4, random_loss=0.09),
            held=False,
            tells_channel=True,
        ),
        # Motorola Moto G (3rd generation), Android 6, of the aisle-graph paper (IPIN 2016). Spec:
        # low latency. Measured on another phone: 78 % of rows (uji_library, the best of three);
        # with that a run has the paper's 1000 to 1300 readings. Paper: held at about 1 m.
        "moto-g3": Phone(
            scanner=Scanner(mode="android-2014-low-latency"),
            receiver=Receiver(random_loss=0.74),
            height_m=1.0,
        ),
        # Samsung Galaxy Note 3 of the map-heading paper, held flat. Spec: Android 5 low latency.
        # Assumed: the loss of the Moto G.
        "galaxy-note-3": Phone(
            scanner=Scanner(mode="android-2014-low-latency"),
            receiver=Receiver(random_loss=0.74),
            height_m=1.1,
        ),
        # iPhone 4S, iOS 8, of the channel-separate paper, whose beacons (TI CC2540) put the channel
        # into the payload, so that this application knows it. Assumed: every packet is reported,
        # one channel after the other without pause.
        "iphone-4s": Phone(
            scanner=Scanner(interval_ms=100.0, window_ms=100.0),
            height_m=1.1,
            tells_channel=True,
        ),
        # iPhone 5C, iOS 10, of the PDR-and-fingerprints paper, held flat. Spec: ranging calls back
        # once a second. Assumed: scans without pause.
        "iphone-5c": Phone(
            scanner=Scanner(interval_ms=100.0, window_ms=100.0),
            delivery=Delivery(mode="one-second-mean"),
            height_m=1.1,
        ),
        # Nexus 9 tablet of the proximity paper, at the chest. Paper: classes up to about 1 m and
        # up to 3 m, 1.0 m high. Spec: Android 5 low latency. Assumed: one class a second.
        "nexus-9": Phone(
            scanner=Scanner(mode="android-2014-low-latency"),
            delivery=Delivery(mode="one-second-mean", immediate_m=1.0, near_m=3.0),
            receiver=Receiver(random_loss=0.74),
            height_m=1.0,
        ),
        # A current Android phone in each of its modes. Spec: windows. Measured: 9 % lost.
        "android-low-latency": Phone(scanner=Scanner(mode="android-2023-low-latency")),
        "android-balanced": Phone(scanner=Scanner(mode="android-2023-balanced")),
        "android-low-power": Phone(scanner=Scanner(mode="android-2023-low-power")),
        # The three phones of uji_library: a strong 200 ms beacon heard in 40, 67 and 78 % of
        # one-second rows (measured). Offsets: median differences at the same points and beacons, of
        # those heard in most rows, with the S6 at 0 (measured, campaigns 2 and 3). Assumed: scans
        # without pause.
        "uji-a5": Phone(
            scanner=Scanner(mode="android-2014-low-latency"),
            receiver=Receiver(offset_db=18.0, random_loss=0.903),
        ),
        "uji-bq": Phone(
            scanner=Scanner(mode="android-2014-low-latency"),
            receiver=Receiver(offset_db=-1.0, random_loss=0.801),
        ),
        "uji-s6": Phone(
            scanner=Scanner(mode="android-2014-low-latency"),
            receiver=Receiver(offset_db=0.0, random_loss=0.739),
        ),
        # Two phones of one maker on the same walks read 11 dB apart (measured). Assumed: half of it
        # each; the rest as on a current phone.
        "pair-strong": Phone(
            scanner=Scanner(mode="android-2016-low-latency"),
            receiver=Receiver(offset_db=5.5),
        ),
        "pair-weak": Phone(
            scanner=Scanner(mode="android-2016-low-latency"),
            receiver=Receiver(offset_db=-5.5),
        ),
        # Scans in bursts with 1.4 s of silence between (measured on one phone). Assumed: bursts of
        # 0.6 s, in which it loses as many packets as a dedicated receiver.
        "slow-phone": Phone(
            scanner=Scanner(interval_ms=2000.0, window_ms=600.0),
        ),
    }
)
