"""What the four systems of the map-heading paper have in common: steps, start and beacon zones.

References
----------
.. [1] PDR with map-compensated heading; digest "map-heading-ekf".
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from blesim.estimators.base import Need
from blesim.estimators.refusals import refuse_other, refuse_outside
from blesim.estimators.surveyed_steps import learned_steps
from blesim.estimators.walked_steps import StepReading, StepSource, SystemHeading, step_need
from blesim.pdr.multi_threshold import MultiThreshold
from blesim.recording import Recording
from blesim.venue.venue import Venue


@dataclass(frozen=True, slots=True, kw_only=True)
class GaitSettings:
    """Steps of [1]_: peaks and valleys, lengths by Eq 7, headings by Eq 9 over the gait cycle.

    Lengths are fitted on survey walks where there are any. With the system as source, its step
    events tell length and heading.

    Parameters
    ----------
    source : {"imu", "system"}
        IMU samples as in [1]_, or the step events of the phone's system.
    system_heading : {"step", "stream"}
        Heading of the step event, or the latest of the system's headings.
    amplitude_m_s2 : float
        delta_a. [m/s2]
    interval_s : float
        delta_dt. [s]
    compass_weight : float
        W of Eq 9; assumed. [-]
    turning_deg : float
        Angle over which a step turns; assumed. [degree]
    offset_deg : float or None
        From the compass's frame into the map's, counter-clockwise; none for that of the survey, or
        without one of the venue's georeference. [degree]
    start_m : float
        Standard deviation of the start in x and y: the first error of [1]_ is 2.0. [m]

    Raises
    ------
    UsageError
        If a parameter is out of its range.
    """

    source: StepSource = "imu"
    system_heading: SystemHeading = "step"
    amplitude_m_s2: float = 1.0
    interval_s: float = 0.14
    compass_weight: float = 0.02
    turning_deg: float = 15.0
    offset_deg: float | None = None
    start_m: float = 2.0
    steps: StepReading | None = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        refuse_other("source", self.source, ("imu", "system"))
        refuse_other("system_heading", self.system_heading, ("step", "stream"))
        refuse_outside(
            amplitude_m_s2=(self.amplitude_m_s2, 0.0, 100.0),
            interval_s=(self.interval_s, 0.0, 10.0),
            compass_weight=(self.compass_weight, 0.0, 1.0),
            turning_deg=(self.turning_deg, 0.1, 180.0),
            offset_deg=(self.offset_deg or 0.0, -360.0, 360.0),
            start_m=(self.start_m, 0.0, 1e4),
        )

    @property
    def needs(self) -> frozenset[Need]:
        """The start, and where the steps come from."""
        return frozenset({Need.START, step_need(self.source)})

    def learned_steps(self, venue: Venue, surveys: Sequence[Recording]) -> StepReading:
        """How steps are read, with what a survey teaches of them."""
        how = StepReading(
            source=self.source,
            heading=self.system_heading,
            detector=MultiThreshold(amplitude_m_s2=self.amplitude_m_s2, interval_s=self.interval_s),
            compass_weight=self.compass_weight,
            turning_rad=math.radians(self.turning_deg),
        )
        known_rad = None if self.offset_deg is None else math.radians(self.offset_deg)
        return learned_steps(how, venue, surveys, known_rad)
