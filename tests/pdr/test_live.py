"""However the samples are cut into blocks, every detector finds the same steps at the same time."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from blesim.errors import DataError
from blesim.pdr.band_pass import BandPass, BandPassDetector
from blesim.pdr.double_threshold import DoubleThreshold, DoubleThresholdDetector
from blesim.pdr.multi_threshold import MultiThreshold, MultiThresholdDetector

DETECTORS = {
    "multi": lambda: MultiThresholdDetector(MultiThreshold(interval_s=0.05)),
    "double": lambda: DoubleThresholdDetector(DoubleThreshold(lower_m_s2=1.0, interval_s=0.05)),
    "band": lambda: BandPassDetector(BandPass(height_m_s2=0.01, interval_s=0.05)),
}
FIELDS = ("time_us", "told_us", "peak_m_s2", "valley_m_s2")


def told(parts):
    return {name: np.concatenate([getattr(p, name) for p in parts]).tolist() for name in FIELDS}


@pytest.mark.parametrize("name", DETECTORS)
@given(
    signal=st.lists(st.integers(-4, 4), max_size=80),
    cuts=st.lists(st.integers(0, 80), max_size=6),
)
def test_blocks_find_what_one_go_finds(name, signal, cuts):
    time_us = np.arange(len(signal)) * 20_000
    values = np.array(signal, float)
    whole, live = DETECTORS[name](), DETECTORS[name]()
    at_once = [whole.advance(time_us, values), whole.finish()]
    bounds = [0, *sorted(min(cut, len(signal)) for cut in cuts), len(signal)]
    parts = [
        live.advance(time_us[first:last], values[first:last]) for first, last in pairwise(bounds)
    ]
    assert told([*parts, live.finish()]) == told(at_once)


@pytest.mark.parametrize("name", DETECTORS)
@given(signal=st.lists(st.integers(-4, 4), min_size=1, max_size=80))
def test_steps_come_in_order_and_are_told_after_they_happened(name, signal):
    time_us = np.arange(len(signal)) * 20_000
    found = DETECTORS[name]().advance(time_us, np.array(signal, float))
    assert np.all(np.diff(found.time_us) > 0)
    assert np.all(np.diff(found.told_us) >= 0)
    assert np.all(found.told_us > found.time_us)
    assert np.all(found.peak_m_s2 >= found.valley_m_s2)


@pytest.mark.parametrize("name", DETECTORS)
def test_blocks_out_of_order_are_refused(name):
    detector = DETECTORS[name]()
    detector.advance(np.array([0, 20_000]), np.zeros(2))
    with pytest.raises(DataError, match="in order of time"):
        detector.advance(np.array([10_000]), np.zeros(1))
