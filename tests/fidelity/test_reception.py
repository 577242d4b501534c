import numpy as np
import pytest

from blesim.fidelity.reception import gap_s, received_share, reception_at


def test_events_of_several_packets_count_once():
    events_s = np.arange(100) * 0.455
    heard_s = np.sort(np.concatenate([events_s[:50], events_s[:20] + 0.002]))
    assert received_share(heard_s, 45.5, 0.455) == pytest.approx(0.5)
    assert received_share(np.empty(0), 45.5, 0.455) == 0.0


def test_gaps():
    time_s = np.cumsum(np.tile([0.455, 0.455, 0.91], 100))
    assert gap_s(time_s, 0.5) == pytest.approx(0.455)
    assert gap_s(time_s, 0.95) == pytest.approx(0.91)
    assert np.isnan(gap_s(np.array([1.0]), 0.5))


def test_reception_by_level():
    level, share = np.array([-90.0, -80.0, -70.0]), np.array([0.5, 0.8, 0.9])
    assert reception_at(level, share, -85.0, -60.0) == pytest.approx(0.85)
    assert np.isnan(reception_at(level, share, -60.0, -50.0))
