"""Every registered estimator keeps the contract, at its default settings and at some others."""

import pytest

from blesim.estimators.check import check_estimator
from blesim.estimators.registry import estimator_names, make_estimator

OTHER_SETTINGS = (
    "nearest-beacon:signal=averaged",
    "nearest-beacon:signal=averaged,rate=1,window_s=0.2",
)


@pytest.mark.parametrize("text", [*estimator_names(), *OTHER_SETTINGS])
def test_estimator_keeps_the_contract(text):
    check_estimator(make_estimator(text)[1])
