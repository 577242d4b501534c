"""Headings whose compass error is learned from the directions of the aisles walked along.

References
----------
.. [1] PDR with map-compensated heading, Eq 10 to 15; digest "map-heading-ekf".
"""

import math

import numpy as np

from blesim.estimators.aisle_zones import NO_JUNCTION, AisleZones
from blesim.pdr.compass import CompassCorrection, CompassCorrector
from blesim.units import azimuth_to_heading, heading_to_azimuth


class MapHeadings:
    """The live headings of one phone, its compass corrected by the directions of aisles [1]_.

    A straight step in a linear zone trains the correction with the direction of the aisle (Eq 14);
    in a non-linear zone, and where no aisle agrees, the direction is not known.

    Parameters
    ----------
    zones : AisleZones
        Of the level.
    correction : CompassCorrection
        Filter and training.
    reach_m, agree_rad : float
        Which aisle a step belongs to; see `AisleZones.way_rad`. [m], [rad]
    """

    def __init__(
        self,
        zones: AisleZones,
        correction: CompassCorrection,
        *,
        reach_m: float,
        agree_rad: float,
    ) -> None:
        self._zones = zones
        self._corrector = CompassCorrector(correction)
        self._reach_m = reach_m
        self._agree_rad = agree_rad

    def corrected_rad(self, heading_rad: float, turning: bool, x_m: float, y_m: float) -> float:
        """Corrected heading of the next step. [rad].

        Parameters
        ----------
        heading_rad : float
            As measured. [rad]
        turning : bool
            Whether the step turns.
        x_m, y_m : float
            Position before the step. [m]
        """
        way_rad = np.nan
        if not turning and self._zones.junction_at(x_m, y_m) == NO_JUNCTION:
            way_rad = self._zones.way_rad(
                x_m, y_m, heading_rad, reach_m=self._reach_m, agree_rad=self._agree_rad
            )
        azimuths = heading_to_azimuth([heading_rad, way_rad])
        corrected = self._corrector.advance(azimuths[:1], azimuths[1:], np.array([turning]))
        return float(azimuth_to_heading(corrected[0]))


def map_headings(
    zones: AisleZones, *, training_steps: int, reach_m: float, agree_deg: float
) -> MapHeadings:
    """Headings of one walk corrected by the zones of its level."""
    correction = CompassCorrection(training_steps=training_steps)
    return MapHeadings(zones, correction, reach_m=reach_m, agree_rad=math.radians(agree_deg))
