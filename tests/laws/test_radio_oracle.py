"""The fast radio against a plain one: the same packets, and the same statistics in any case."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from blesim.radio.air import Air
from blesim.radio.collisions import Collisions
from blesim.radio.fading import Fading
from blesim.radio.people import People
from blesim.radio.phone import Phone, Receiver, Scanner
from blesim.radio.propagation import Propagation
from blesim.walkers.itinerary import Itinerary, Stop
from blesim.walkers.walker import simulate_walkers

sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmark"))
import oracle

# A standing carrier does not sway here: the plain radio has no memory from packet to packet.
STEADY = People(body_loss_db=8.0, sway_m=0.0, crossing_db=0.0)
PHONES = {
    "continuous": Phone(tells_channel=True),
    "half": Phone(
        tells_channel=True,
        scanner=Scanner(interval_ms=300, window_ms=150),
        receiver=Receiver(channel_gain_db=(1.0, -2.0, 0.5), offset_db=3.0),
    ),
}


def trajectory(venue, *nodes):
    stops = tuple(Stop(place=venue.graph.at_node(node), pause_s=1.0) for node in nodes)
    return simulate_walkers(venue.graph, (Itinerary(walker="w", stops=stops),))[0].trajectory()


def fast(venue, propagation, seed, phone, walk):
    air = Air.over(venue, propagation, seed, int(walk.time_us[-1]) + 1)
    readings = air.heard_by(phone, "w", walk, keep_packets=False).readings
    columns = (readings.time_us, readings.beacon, readings.rssi_dbm, readings.channel)
    return sorted(zip(*(column.tolist() for column in columns), strict=True))


@pytest.mark.parametrize("phone", PHONES.values(), ids=PHONES)
@pytest.mark.parametrize(
    "propagation",
    [
        Propagation(path_loss_exponent=1.0, people=STEADY),
        Propagation(
            path_loss_exponent=1.6,
            people=STEADY,
            fading=Fading(model="gaussian"),
            collisions=Collisions(model="none"),
            traffic_loss=0.1,
        ),
    ],
    ids=["rician with collisions", "gaussian without"],
)
def test_with_randomness_named_alike_the_two_give_the_same_packets(section, phone, propagation):
    walk = trajectory(section, "E7", "E9", "D8")
    plain, _ = oracle.listen(section, propagation, 17, {"w": (phone, walk)})
    quick = fast(section, propagation, 17, phone, walk)
    assert len(quick) > 200
    assert quick == plain["w"]


def test_with_other_randomness_the_two_agree_in_their_statistics(section):
    propagation = Propagation(path_loss_exponent=1.0, people=STEADY)
    walk = trajectory(section, "E8", "E9", "D8")
    phone = PHONES["continuous"]
    pools = {"plain": [], "quick": []}
    for seed in range(6):
        pools["plain"].append(
            oracle.listen(section, propagation, 100 + seed, {"w": (phone, walk)})[0]["w"]
        )
        pools["quick"].append(fast(section, propagation, 200 + seed, phone, walk))
    rssi, gaps, counts = {}, {}, {}
    for name, pool in pools.items():
        # Neighbouring packets share shadows: thinned to one in seven they are nearly independent.
        rssi[name] = np.concatenate([[row[2] for row in rows[::7]] for rows in pool])
        gaps[name] = np.concatenate([np.diff([row[0] for row in rows]) for rows in pool])
        counts[name] = np.array([len(rows) for rows in pool])
    # False alarm 1e-4 each.
    assert stats.ks_2samp(rssi["plain"], rssi["quick"]).pvalue > 1e-4
    assert stats.ks_2samp(gaps["plain"][::3], gaps["quick"][::3]).pvalue > 1e-4
    assert stats.ttest_ind(counts["plain"], counts["quick"]).pvalue > 1e-4
