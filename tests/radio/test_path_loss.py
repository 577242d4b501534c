import numpy as np
import pytest

from blesim.radio.path_loss import log_distance_loss_db


def test_loss_grows_by_ten_n_a_decade():
    distance_m = np.array([1.0, 10.0, 100.0])
    assert log_distance_loss_db(distance_m, 1.3) == pytest.approx([0.0, 13.0, 26.0])


def test_a_published_office_follows_the_law():
    # Published levels in an office; a least-squares line leaves far less than the 3.8 dB of
    # ITU-R P.1238 for an office with line of sight.
    distance_m = np.array([1.0, 5.0, 10.0, 16.0])
    published_dbm = np.array([-65.5, -78.4, -84.1, -90.8])
    unit_db = log_distance_loss_db(distance_m, 1.0)
    slope, level_dbm = np.polyfit(unit_db, published_dbm, 1)
    assert -slope == pytest.approx(2.0, abs=0.15)
    modelled_dbm = level_dbm - log_distance_loss_db(distance_m, -slope)
    assert np.std(modelled_dbm - published_dbm) < 1.1


def test_more_distance_is_always_weaker():
    assert (np.diff(log_distance_loss_db(np.geomspace(0.2, 100, 50), 1.0)) > 0).all()


def test_the_near_field_does_not_diverge():
    assert log_distance_loss_db(np.array([0.0]), 2.0) == log_distance_loss_db(np.array([0.1]), 2.0)
