"""A package of somebody else's: the mean place of the beacons, the strong ones counting more."""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from blesim.estimators.base import Need, fitted, make_track


@dataclass(frozen=True, slots=True, kw_only=True)
class WeightedPlace:
    """Mean of the beacon positions, each weighted by 10^(RSSI / scale), forgetting the past."""

    scale_db: float = 20.0
    memory: float = 0.9
    beacons_m: np.ndarray | None = field(default=None, init=False)
    needs: ClassVar[frozenset[Need]] = frozenset()

    def fit(self, venue, surveys):  # noqa: ARG002
        return fitted(self, beacons_m=venue.beacon_xyz_m[:, :2])

    def start(self, start, rng):  # noqa: ARG002
        return WeightedPlaceTracker(self)


class WeightedPlaceTracker:
    def __init__(self, settings):
        self.settings = settings
        self.weights = np.zeros(len(settings.beacons_m))

    def advance(self, block):
        places = np.array([self.place(*r) for r in self.rows(block.readings)]).reshape(-1, 2)
        x_m, y_m = places.T
        times = block.readings.time_us
        return make_track(time_us=times, x_m=x_m, y_m=y_m, variance_x_m2=9.0, variance_y_m2=9.0)

    def rows(self, readings):
        return zip(readings.beacon, readings.rssi_dbm, strict=True)

    def place(self, beacon, rssi_dbm):
        self.weights *= self.settings.memory
        self.weights[beacon] += 10 ** (float(rssi_dbm) / self.settings.scale_db)
        return self.weights @ self.settings.beacons_m / self.weights.sum()
