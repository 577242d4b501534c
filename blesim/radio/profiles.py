"""Phones and receivers by name: what was measured of each, what is specified, what is assumed.

``measured`` numbers come from recordings, ``spec`` from Android's sources (see
`blesim.radio.phone.SCAN_MODES`) or Apple's documentation, ``paper`` from the experiment a phone was
used in; everything else is ``assumed``. Where nothing is said, the defaults of the models hold.

What a phone misses is measured on three phones of 2015 and 2016 in a library (uji_library), fitted
such that the simulated campaign hears what the real one does: their sensitivities are -94.4, -91.5
and -87.8 dBm, and one of them, the Galaxy S6, heard a strong beacon that sends five times a second
in more than 99 % of one-second scans, once its scanner had started up. A phone that nobody measured
gets the median sensitivity and, beside the pauses of its system's scan windows, loses no more
packets than a dedicated receiver.
"""

from collections.abc import Mapping
from types import MappingProxyType

from blesim.radio.delivery import Delivery
from blesim.radio.phone import Mode, Phone, Receiver, Scanner

# Measured: the median of three phones, see above; a dedicated receiver hears 3.5 dB more.
_PHONE_DBM = -91.5
# Of the phones in that library: held at the chest, assumed. [m]
LIBRARY_HEIGHT_M = 1.2
_CURRENT: Mapping[str, Mode] = {
    "low-latency": "android-2023-low-latency",
    "balanced": "android-2023-balanced",
    "low-power": "android-2023-low-power",
}


def library_phone(offset_db: float, sensitivity_dbm: float, window_ms: float) -> Phone:
    """A phone of uji_library, with what is fitted of it: the window too, in scans of a second."""
    return Phone(
        scanner=Scanner(interval_ms=1000.0, window_ms=window_ms),
        receiver=Receiver(offset_db=offset_db, sensitivity_dbm=sensitivity_dbm),
        height_m=LIBRARY_HEIGHT_M,
    )


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
        # low latency. Paper: held at about 1 m, and 1000 to 1300 readings a run, for which it must
        # lose 54 % of the packets of the store's beacons, if they send every 350 ms.
        "moto-g3": Phone(
            scanner=Scanner(mode="android-2014-low-latency"),
            receiver=Receiver(sensitivity_dbm=_PHONE_DBM, random_loss=0.54),
            height_m=1.0,
        ),
        # Samsung Galaxy Note 3 of the map-heading paper, held flat. Spec: Android 5 low latency.
        "galaxy-note-3": Phone(
            scanner=Scanner(mode="android-2014-low-latency"),
            receiver=Receiver(sensitivity_dbm=_PHONE_DBM),
            height_m=1.1,
        ),
        # iPhone 4S, iOS 8, of the channel-separate paper, whose beacons (TI CC2540) put the channel
        # into the payload, so that this application knows it. Assumed: every packet is reported,
        # one channel after the other without pause.
        "iphone-4s": Phone(
            scanner=Scanner(interval_ms=100.0, window_ms=100.0),
            receiver=Receiver(sensitivity_dbm=_PHONE_DBM),
            height_m=1.1,
            tells_channel=True,
        ),
        # iPhone 5C, iOS 10, of the PDR-and-fingerprints paper, held flat. Spec: ranging calls back
        # once a second. Assumed: scans without pause.
        "iphone-5c": Phone(
            scanner=Scanner(interval_ms=100.0, window_ms=100.0),
            delivery=Delivery(mode="one-second-mean"),
            receiver=Receiver(sensitivity_dbm=_PHONE_DBM),
            height_m=1.1,
        ),
        # Nexus 9 tablet of the proximity paper, at the chest. Paper: classes up to about 1 m and
        # up to 3 m, 1.0 m high. Spec: Android 5 low latency. Assumed: one class a second.
        "nexus-9": Phone(
            scanner=Scanner(mode="android-2014-low-latency"),
            delivery=Delivery(mode="one-second-mean", immediate_m=1.0, near_m=3.0),
            receiver=Receiver(sensitivity_dbm=_PHONE_DBM),
            height_m=1.0,
        ),
        # A current Android phone in each of its modes. Spec: windows. Measured: 9 % lost.
        **{
            f"android-{name}": Phone(
                scanner=Scanner(mode=mode), receiver=Receiver(sensitivity_dbm=_PHONE_DBM)
            )
            for name, mode in _CURRENT.items()
        },
        # The three phones of uji_library, fitted on its campaign 2 (`blesim.fidelity.fit_library`).
        # Offsets are to beacons that have -59 dBm at one metre.
        "uji-a5": library_phone(offset_db=16.4, sensitivity_dbm=-87.8, window_ms=119.0),
        "uji-bq": library_phone(offset_db=-3.4, sensitivity_dbm=-94.4, window_ms=225.0),
        "uji-s6": library_phone(offset_db=-1.6, sensitivity_dbm=-91.5, window_ms=543.0),
        # Two phones of one maker on the same walks read 11 dB apart (measured). Assumed: half of it
        # each; the rest as on a current phone.
        "pair-strong": Phone(
            scanner=Scanner(mode="android-2016-low-latency"),
            receiver=Receiver(offset_db=5.5, sensitivity_dbm=_PHONE_DBM),
        ),
        "pair-weak": Phone(
            scanner=Scanner(mode="android-2016-low-latency"),
            receiver=Receiver(offset_db=-5.5, sensitivity_dbm=_PHONE_DBM),
        ),
        # Scans in bursts with 1.4 s of silence between (measured on one phone). Assumed: bursts of
        # 0.6 s, in which it loses as many packets as a dedicated receiver.
        "slow-phone": Phone(
            scanner=Scanner(interval_ms=2000.0, window_ms=600.0),
            receiver=Receiver(sensitivity_dbm=_PHONE_DBM),
        ),
    }
)
