"""Every registered estimator keeps the contract, at its default settings and at some others."""

import pytest

from blesim.estimators.check import check_estimator
from blesim.estimators.registry import estimator_names, make_estimator

OTHER_SETTINGS = (
    "nearest-beacon:signal=averaged",
    "nearest-beacon:signal=averaged,rate=1,window_s=0.2",
    "pm-ekf:every_reading=true,epoch_s=0.3,smoothing=exponential",
    "fp-ekf:separate=true,grid_m=none,search_scale=none",
    "channel-ekf:separate=false,grid_m=none,outliers_1=false,outliers_2=false",
    "channel-ekf:every_reading=true,grid_m=none,silence_s=0.5,confidence=0.5",
)


@pytest.mark.parametrize("text", [*estimator_names(), *OTHER_SETTINGS])
def test_estimator_keeps_the_contract(text):
    check_estimator(make_estimator(text)[1])
