import numpy as np
import pytest
from pydantic import ValidationError

from blesim.imu.compass import COMPASSES, CompassErrors
from blesim.units import azimuth_to_heading, heading_to_azimuth, wrap_angle

# Raw column of table 3 of the map-heading paper: azimuth and mean magnitude of its error.
TABLE_3 = ((90, 17.92), (180, 5.84), (270, 16.17), (305, 10.99))


def error_deg(compass, azimuth_deg, deviates):
    heading = azimuth_to_heading(np.radians(np.full(len(deviates), float(azimuth_deg))))
    measured = heading_to_azimuth(compass.measured_heading_rad(heading, deviates))
    return np.degrees(wrap_angle(measured - np.radians(azimuth_deg)))


@pytest.mark.parametrize(("azimuth_deg", "mean_deg"), TABLE_3)
def test_the_preset_is_off_as_far_as_table_3_says(azimuth_deg, mean_deg):
    deviates = np.random.Generator(np.random.Philox(1)).normal(size=20_000)
    error = error_deg(COMPASSES["map-heading"], azimuth_deg, deviates)
    # Noise of 4 degrees, 20 000 times: good to 0.03; coefficients are rounded to 0.01.
    assert np.abs(error).mean() == pytest.approx(mean_deg, abs=0.12)


def test_measured_and_deviation_give_the_truth():
    compass = COMPASSES["map-heading"].model_copy(update={"noise_deg": 0.0})
    true = np.linspace(-np.pi, np.pi, 73)
    measured = heading_to_azimuth(
        compass.measured_heading_rad(azimuth_to_heading(true), np.zeros(73))
    )
    back = measured + compass.deviation_rad(measured)
    assert wrap_angle(back - true) == pytest.approx(np.zeros(73), abs=1e-12)


def test_a_constant_turns_every_heading_alike():
    compass = CompassErrors(a_deg=10.0)
    headings = np.array([0.0, 1.0, 2.0])
    turned = compass.measured_heading_rad(headings, np.zeros(3)) - headings
    # 10 degrees must be added to the azimuth, so it reads 10 too little: more heading.
    assert np.degrees(turned) == pytest.approx([10.0] * 3)


def test_a_compass_that_reads_the_same_in_two_directions_is_refused():
    with pytest.raises(ValidationError, match="two directions may read the same"):
        CompassErrors(d_deg=20.0, e_deg=15.0)
