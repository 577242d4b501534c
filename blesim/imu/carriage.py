"""How each way of carrying shows in the signal: attitude, waveform of a step, sway, tremor.

``measured`` numbers come from recordings: hand, swinging, pocket and bag from oxford_steps (in
hand, arm swinging, front pocket, purse), flat from ilc20, whose phones lay level; of both, the
walks set apart for fitting. Everything else is ``assumed``.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from blesim import columns

# Harmonics of the stride that a waveform is made of: 2 is the step frequency.
HARMONICS = (1, 2, 3, 4, 6, 8)
ANGULAR_HARMONICS = (1, 2)
_STEP = HARMONICS.index(2)

Vector = tuple[float, float, float]
# Amplitude, and phase at the step in degrees.
Wave = tuple[float, float]
NONE: Wave = (0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Carriage:
    """One way of carrying.

    Attributes
    ----------
    up : tuple of three float
        Upward direction in the phone's frame at rest: x to the right edge, y to the top, z out of
        the screen. [-]
    forward : tuple of three float
        Axis of the phone that points ahead, as far as it is level. [-]
    hold_deg : float
        Spread of the attitude, about each axis, from one taking up of the phone to the next. [deg]
    wander_deg : tuple of three float
        Spread of the slow roll, pitch and yaw while it is held. [deg]
    height_m : float
        Of the phone over the floor. [m]
    constant : float
        Weinberg's K: steps of length L have a peak-to-peak acceleration of ``(L / K)^4``.
        [m^(3/4) s^(1/2)]
    most_m_s2 : float
        Peak-to-peak acceleration that is never exceeded, however long the steps. [m/s2]
    peak_variation : float
        Coefficient of variation of a walker's peaks at a steady pace. [-]
    up_waves, forward_waves, left_waves : tuple of Wave
        Acceleration at each of `HARMONICS`; the vertical is scaled to a peak-to-peak of one, the
        others are relative to its step frequency. [-], [deg]
    roll_waves, pitch_waves, yaw_waves : tuple of Wave
        Angle at each of `ANGULAR_HARMONICS`, for usual steps. [deg], [deg]
    alternation : float
        By how much of a step every other peak comes early, the others late. Like the first and
        third harmonic of the accelerations it fades for runners, whose feet fall alike; assumed.
        [-]
    lever_m : float
        How far below the joint it swings about with the pitch of the stride. [m]
    tremor_m_s2 : float
        Spread of the acceleration along each axis at rest. [m/s2]
    roughness : float
        Share of the peak-to-peak acceleration that is irregular, along each axis. [-]
    vibration_s : float
        Vibration for each unit of speed. [1/s]
    """

    up: Vector
    forward: Vector = (0.0, 1.0, 0.0)
    hold_deg: float = 4.0
    wander_deg: Vector = (2.5, 2.5, 3.0)
    height_m: float
    constant: float = 0.4
    most_m_s2: float = 25.0
    peak_variation: float = 0.2
    up_waves: tuple[Wave, ...] = (NONE,) * 6
    forward_waves: tuple[Wave, ...] = (NONE,) * 6
    left_waves: tuple[Wave, ...] = (NONE,) * 6
    roll_waves: tuple[Wave, ...] = (NONE,) * 2
    pitch_waves: tuple[Wave, ...] = (NONE,) * 2
    yaw_waves: tuple[Wave, ...] = (NONE,) * 2
    alternation: float = 0.0
    lever_m: float = 0.0
    tremor_m_s2: float = 0.075
    roughness: float = 0.02
    vibration_s: float = 0.0


# The first harmonic of the left axis belongs to the stride: weight shifts from foot to foot.
# most_m_s2: a runner's ground reaction peaks at 2.5 times the weight and is none in flight, which
# makes 2.5 g at the pelvis (A. Patoz et al., Sensors 22:384, 2022, doi:10.3390/s22030784; 9 to
# 13 km/h). A pocket gets more of the impact, assumed.
CARRIAGES: Mapping[str, Carriage] = MappingProxyType(
    {
        # Measured: attitude, wander, waveform, shares of the harmonics; 4.7 m/s2 at 1 m/s, 6.8 at
        # 1.85 Hz. Standing, |a| spreads by 0.08 m/s2, a white accelerometer's noise included.
        "hand": Carriage(
            up=(0.03, 0.40, 0.91),
            height_m=1.2,
            constant=0.43,
            peak_variation=0.18,
            roughness=0.05,
            up_waves=((0.06, -173.0), (1.0, 0.0), NONE, (0.2, -45.0), (0.2, -56.0), (0.15, -88.0)),
            forward_waves=((0.1, 0.0), (0.3, 60.0), NONE, (0.12, 0.0), (0.1, 0.0), NONE),
            left_waves=((0.4, 90.0), NONE, (0.15, 0.0), NONE, NONE, NONE),
            roll_waves=((0.8, 90.0), (0.6, 30.0)),
            pitch_waves=((0.3, 0.0), (2.0, 30.0)),
            yaw_waves=((1.8, 20.0), (0.4, 0.0)),
        ),
        # Measured: 11.8 m/s2 at 1.25 m/s (12.8 and 13.0 in two sets), waveform, gyroscope 0.88,
        # 0.22 and 0.46 rad/s about the phone's axes; standing, 0.11 to 0.20 m/s2 in the six half
        # seconds there are, of which the stillest.
        "flat": Carriage(
            up=(0.0, 0.0, 1.0),
            height_m=1.15,
            constant=0.372,
            peak_variation=0.3,
            tremor_m_s2=0.11,
            up_waves=((0.03, -155.0), (1.0, 0.0), (0.05, 158.0), (0.39, 3.0), (0.15, 6.0), NONE),
            forward_waves=(NONE, (0.12, 60.0), NONE, (0.06, 0.0), NONE, NONE),
            left_waves=((0.12, 90.0), (0.05, 0.0), NONE, NONE, NONE, NONE),
            roll_waves=((1.2, 90.0), (1.5, 30.0)),
            pitch_waves=((0.5, 0.0), (5.5, 40.0)),
            yaw_waves=((2.1, 20.0), (0.6, 0.0)),
        ),
        # Measured: attitude, waveform, 6.1 m/s2 at 1.87 Hz. Arm of 0.6 m, swing of 14 degrees from
        # the share of the stride (0.37 over all axes).
        "swinging": Carriage(
            up=(-0.83, -0.54, 0.13),
            forward=(0.0, 1.0, -0.5),
            height_m=0.75,
            constant=0.41,
            most_m_s2=25.0,
            peak_variation=0.12,
            up_waves=((0.32, -158.0), (1.0, 0.0), NONE, (0.15, -70.0), (0.12, 49.0), NONE),
            forward_waves=((0.4, 90.0), (0.3, 60.0), NONE, (0.15, 0.0), (0.1, 0.0), NONE),
            left_waves=((0.8, 90.0), NONE, (0.15, 0.0), NONE, NONE, NONE),
            roll_waves=((2.0, 90.0), (1.0, 0.0)),
            pitch_waves=((14.0, 0.0), (2.0, 0.0)),
            yaw_waves=((5.0, 45.0), (1.0, 0.0)),
            lever_m=0.6,
        ),
        # Measured: attitude, wander, 20 m/s2 at 1.84 Hz, peaks that come early and late in turn
        # (the mean intervals differ by a third), the share of the step frequency: the heel's blow
        # is in the harmonics. The thigh swings by 20 degrees: D. A. Winter, "Biomechanics and motor
        # control of human movement", hip angle at natural cadence.
        "pocket": Carriage(
            up=(0.13, 0.97, -0.1),
            forward=(0.0, 0.0, 1.0),
            hold_deg=8.0,
            wander_deg=(0.8, 0.8, 2.0),
            height_m=0.85,
            constant=0.325,
            most_m_s2=45.0,
            peak_variation=0.17,
            up_waves=((0.08, 0.0), (1.0, 0.0), (0.35, 0.0), (0.45, 0.0), (0.5, 0.0), (0.8, 0.0)),
            forward_waves=(
                (0.25, 90.0),
                (0.05, 40.0),
                (0.3, 0.0),
                (0.4, 0.0),
                (0.6, 0.0),
                (0.6, 0.0),
            ),
            left_waves=((0.3, 90.0), (0.2, 0.0), (0.3, 0.0), (0.2, 0.0), (0.3, 0.0), (0.3, 0.0)),
            roll_waves=((4.0, 90.0), (2.0, 0.0)),
            pitch_waves=((20.0, 20.0), (3.0, 0.0)),
            yaw_waves=((6.0, 0.0), (2.0, 0.0)),
            alternation=0.1,
            lever_m=0.15,
            tremor_m_s2=0.03,
            roughness=0.095,
        ),
        # Measured: attitude, waveform, 10.9 m/s2 at 1.93 Hz. A bag turns about slowly.
        "bag": Carriage(
            up=(-0.11, 0.30, 0.94),
            hold_deg=15.0,
            wander_deg=(8.0, 8.0, 8.0),
            height_m=0.95,
            constant=0.42,
            most_m_s2=35.0,
            peak_variation=0.25,
            up_waves=((0.05, -153.0), (1.0, 0.0), (0.08, 155.0), (0.12, 127.0), (0.1, 0.0), NONE),
            forward_waves=((0.05, 0.0), (0.5, 60.0), (0.3, 0.0), (0.35, 0.0), (0.1, 0.0), NONE),
            left_waves=((0.05, 90.0), (0.4, 0.0), (0.3, 0.0), NONE, NONE, NONE),
            roll_waves=((3.0, 90.0), (2.0, 0.0)),
            pitch_waves=((2.0, 0.0), (3.0, 30.0)),
            yaw_waves=((3.0, 0.0), (1.5, 0.0)),
            tremor_m_s2=0.02,
            roughness=0.12,
        ),
        # Assumed throughout: lies in the child seat; wheels on a tiled floor.
        "trolley": Carriage(
            up=(0.0, 0.26, 0.97),
            hold_deg=8.0,
            wander_deg=(0.3, 0.3, 0.5),
            height_m=1.0,
            tremor_m_s2=0.005,
            roughness=0.0,
            vibration_s=0.9,
        ),
    }
)
# Assumed: how long a hand takes from one way of carrying to the next.
SWITCH_S = 1.0
_CODES = dict(columns.CARRYINGS)
ORDERED = tuple(CARRIAGES[name] for name in sorted(CARRIAGES, key=_CODES.__getitem__))


def _pairs(waves: tuple[Wave, ...]) -> NDArray[np.float64]:
    """Cosine and sine amplitude of waves, (m, 2)."""
    amplitude, degrees = np.array(waves).T
    angle = np.radians(degrees)
    return np.stack([amplitude * np.cos(angle), -amplitude * np.sin(angle)], axis=1)


def _span(pairs: NDArray[np.float64]) -> float:
    """Peak-to-peak of a waveform over a stride."""
    phase = np.linspace(0.0, 2.0 * np.pi, 721)[:, None] * np.array(HARMONICS)
    return float(np.ptp(np.cos(phase) @ pairs[:, 0] + np.sin(phase) @ pairs[:, 1]))


def _linear(carriage: Carriage) -> NDArray[np.float64]:
    """Forward, left and upward waveform, the last with a peak-to-peak of one, (3, 6, 2)."""
    waves = (carriage.forward_waves, carriage.left_waves, carriage.up_waves)
    pairs = np.stack([_pairs(wave) for wave in waves])
    scaled: NDArray[np.float64] = np.round(pairs / max(_span(pairs[2]), 1.0), 9)
    return scaled


def _angular(carriage: Carriage) -> NDArray[np.float64]:
    """Roll, pitch and yaw waveform, (3, 2, 2). [rad]."""
    waves = (carriage.roll_waves, carriage.pitch_waves, carriage.yaw_waves)
    angles: NDArray[np.float64] = np.radians(np.stack([_pairs(wave) for wave in waves]))
    return np.asarray(np.round(angles, 9), dtype=np.float64)


# By the codes of `columns.CARRYINGS`; rounded, so that every machine has the same numbers.
LINEAR = np.stack([_linear(carriage) for carriage in ORDERED])
ANGULAR = np.stack([_angular(carriage) for carriage in ORDERED])
# Columns of a mode: constant relative to that of a phone held flat, to the fourth power, and so on.
GAIN, MOST, VARIATION, ALTERNATION, LEVER, TREMOR, ROUGHNESS, VIBRATION, HEIGHT = range(9)
WANDER = 9
FLAT_CONSTANT = CARRIAGES["flat"].constant
MODES = np.round(
    np.array(
        [
            (
                (FLAT_CONSTANT / c.constant) ** 4 if any(a for a, _ in c.up_waves) else 0.0,
                c.most_m_s2,
                c.peak_variation,
                c.alternation,
                c.lever_m,
                c.tremor_m_s2,
                c.roughness,
                c.vibration_s,
                c.height_m,
                *np.radians(c.wander_deg),
            )
            for c in ORDERED
        ]
    ),
    9,
)


def attitude(carriage: Carriage) -> NDArray[np.float64]:
    """Rotation from the phone's frame to the walker's (ahead, left, up), (3, 3). [-]."""
    up = np.array(carriage.up) / np.linalg.norm(carriage.up)
    ahead = np.array(carriage.forward) - up * (up @ np.array(carriage.forward))
    ahead /= np.linalg.norm(ahead)
    return np.stack([ahead, np.cross(up, ahead), up])


# By the codes of `columns.CARRYINGS`, (6, 3, 3).
ATTITUDES = np.stack([attitude(carriage) for carriage in ORDERED])
