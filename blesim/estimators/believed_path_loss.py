"""The path loss that an estimator believes in: fitted on a survey, or as the beacons announce."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from blesim.errors import UsageError
from blesim.ranging.curves import CurvesBy
from blesim.ranging.path_loss_fit import PathLossFit, fit_path_loss
from blesim.ranging.proximity import announced_power_dbm
from blesim.ranging.survey_readings import survey_readings
from blesim.recording import Recording
from blesim.venue.venue import Venue


@dataclass(frozen=True, slots=True, kw_only=True)
class PathLossBelief:
    """How the curve of each beacon is come by.

    Attributes
    ----------
    by : {"all", "beacon"}
        With a survey: one curve for all beacons, or one for each.
    exponent : float
        Without a survey: path loss exponent, beside the power that each beacon announces for one
        metre. [-]
    spread_db : float
        Without a survey: standard deviation of readings about the curve. [dB]
    phone_height_m : float
        Of the phone above the floor, on the survey and after. [m]

    Raises
    ------
    UsageError
        If a value is out of its range.
    """

    by: CurvesBy
    exponent: float
    spread_db: float
    phone_height_m: float

    def __post_init__(self) -> None:
        if self.by not in ("all", "beacon"):
            raise UsageError(f"curves '{self.by}': use all or beacon")
        if not 0.3 <= self.exponent <= 8:
            raise UsageError(f"exponent {self.exponent:g}: give 0.3 to 8")
        if not 0.1 <= self.spread_db <= 50:
            raise UsageError(f"spread_db {self.spread_db:g}: give 0.1 to 50 dB")
        if not 0 <= self.phone_height_m <= 10:
            raise UsageError(f"phone_height_m {self.phone_height_m:g}: give 0 to 10 m")

    def curves(self, venue: Venue, surveys: Sequence[Recording]) -> PathLossFit:
        """Curve of each beacon of a venue, each field (beacons,).

        Raises
        ------
        DataError
            If there is a survey whose readings make no curve.
        """
        power_dbm = announced_power_dbm(venue)
        if not surveys or not len(power_dbm):
            return PathLossFit(
                level_dbm=power_dbm,
                exponent=np.full_like(power_dbm, self.exponent),
                spread_db=np.full_like(power_dbm, self.spread_db),
            )
        survey = survey_readings(surveys)
        fitted = fit_path_loss(survey, survey.distance_m(venue, self.phone_height_m), by=self.by)
        rows = np.arange(len(power_dbm))
        own = fitted.of(rows, np.zeros_like(rows))
        # A survey without any spread would make a reading a certainty.
        spread_db: NDArray[np.float64] = np.maximum(own.spread_db, 0.5)
        return PathLossFit(level_dbm=own.level_dbm, exponent=own.exponent, spread_db=spread_db)
