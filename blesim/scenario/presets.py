"""What a scenario takes from a named preset and changes in places: phones and the radio."""

from typing import Annotated, ClassVar

from blesim.imu.barometer import Barometer
from blesim.imu.fused_heading import HEADING_SENSORS, HeadingSensor
from blesim.imu.profiles import IMU_PROFILES
from blesim.imu.sensors import ImuSettings
from blesim.imu.step_events import STEP_SENSORS, StepSensor
from blesim.radio.environments import ENVIRONMENTS
from blesim.radio.phone import Phone
from blesim.radio.profiles import PROFILES
from blesim.radio.propagation import Propagation
from blesim.scenario.over_preset import KnownIn, OverPreset, Presets


class StepReader(OverPreset, StepSensor):
    """How the phone's system tells steps.

    Attributes
    ----------
    system : str or None
        A name of `blesim.imu.step_events.STEP_SENSORS`: what is not given is taken from there,
        field by field. Without one every step is told at once.
    """

    KEY: ClassVar[str] = "system"
    PRESETS: ClassVar[Presets] = STEP_SENSORS
    system: Annotated[str | None, KnownIn(STEP_SENSORS)] = None


class HeadingReader(OverPreset, HeadingSensor):
    """How the phone's system tells headings.

    Attributes
    ----------
    system : str or None
        A name of `blesim.imu.fused_heading.HEADING_SENSORS`: what is not given is taken from there,
        field by field.
    """

    KEY: ClassVar[str] = "system"
    PRESETS: ClassVar[Presets] = HEADING_SENSORS
    system: Annotated[str | None, KnownIn(HEADING_SENSORS)] = None


class Sensors(OverPreset, ImuSettings):
    """The phone's inertial and magnetic sensors.

    Attributes
    ----------
    chips : str or None
        A name of `blesim.imu.profiles.IMU_PROFILES`: what is not given is taken from there, field
        by field.
    """

    KEY: ClassVar[str] = "chips"
    PRESETS: ClassVar[Presets] = IMU_PROFILES
    chips: Annotated[str | None, KnownIn(IMU_PROFILES)] = None


class PhoneProfile(OverPreset, Phone):
    """A phone: its radio and its sensors.

    Attributes
    ----------
    profile : str or None
        A name of `blesim.radio.profiles.PROFILES`: what is not given is taken from there, field by
        field.
    step_sensor : StepReader
        How well its system reads steps.
    heading_sensor : HeadingReader
        How its system tells headings; how wrong they are, the step sensor says.
    imu : Sensors
        Its inertial and magnetic sensors.
    barometer : Barometer
        Its barometer, and the weather.
    """

    KEY: ClassVar[str] = "profile"
    PRESETS: ClassVar[Presets] = PROFILES
    profile: Annotated[str | None, KnownIn(PROFILES)] = None
    step_sensor: StepReader = StepReader()
    heading_sensor: HeadingReader = HeadingReader()
    imu: Sensors = Sensors()
    barometer: Barometer = Barometer()


class Radio(OverPreset, Propagation):
    """How signals travel in the venue.

    Attributes
    ----------
    environment : str or None
        A name of `blesim.radio.environments.ENVIRONMENTS`: what is not given is taken from there,
        field by field.
    """

    KEY: ClassVar[str] = "environment"
    PRESETS: ClassVar[Presets] = ENVIRONMENTS
    environment: Annotated[str | None, KnownIn(ENVIRONMENTS)] = None
