"""The plain way to what a phone feels: one sample after the other, matrices and differences.

It shares the drawn numbers and the tables of the carrying modes with the kernel, and nothing else:
attitudes are products of rotation matrices, angular rates come from the attitudes just before and
after, the lever's acceleration from three places, means over the window from many points.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import BSpline
from scipy.spatial.transform import Rotation

from blesim.imu.carriage import HARMONICS, ORDERED, SWITCH_S
from blesim.imu.feel import Signal
from blesim.imu.hold import ATTITUDE
from blesim.imu.quick_normals import three_normals
from blesim.tables import Carrying, StepTruth, Trajectory

G = 9.80665
WINDOW_S = 0.5
_H = 1e-4


def _waves(pairs, angle, odd=1.0):
    amplitude, degrees = np.array(pairs).T
    orders = np.array(HARMONICS)[: len(pairs)]
    amplitude = np.where(orders % 2 == 1, odd * amplitude, amplitude)
    return float(np.sum(amplitude * np.cos(orders * angle + np.radians(degrees))))


def _span(pairs):
    return np.ptp([_waves(pairs, angle) for angle in np.linspace(0, 2 * np.pi, 721)])


_SPANS = [max(_span(carriage.up_waves), 1.0) for carriage in ORDERED]


def _smooth(u):
    return u * u * (3 - 2 * u)


@dataclass
class PlainPhone:
    """The true signal of one walk, sample by sample."""

    signal: Signal
    trajectory: Trajectory
    steps: StepTruth
    carrying: Carrying
    tremor: np.ndarray

    def __post_init__(self):
        walk = self.trajectory
        self.time_s = (walk.time_us - walk.time_us[0]) * 1e-6
        self.heading = np.unwrap(walk.heading_rad)
        self.step_s = (self.steps.time_us - walk.time_us[0]) * 1e-6
        self.hold_s = (self.carrying.time_us - walk.time_us[0]) * 1e-6

    def _stretch(self, t):
        """Displacement of the stretch at a time, its duration and what has passed of it."""
        last = min(max(np.searchsorted(self.time_s, t, side="right") - 1, 0), len(self.time_s) - 2)
        walk = self.trajectory
        step = np.array([np.diff(axis[last : last + 2])[0] for axis in (walk.x_m, walk.y_m)])
        return last, step, self.time_s[last + 1] - self.time_s[last], t - self.time_s[last]

    def _velocity(self, t):
        """Along x and y; beyond the ends of the walk as at the ends."""
        row, step, span, passed = self._stretch(min(max(t, 0.0), self.time_s[-1]))
        speed, gain = self.trajectory.speed_m_s[row], self.trajectory.acceleration_m_s2[row]
        walked = speed * span + gain * span**2 / 2
        return step * (speed + gain * passed) / walked if walked > 0 else np.zeros(2)

    def _mean_over_window(self, t, value):
        """Mean of what changes linearly between knots."""
        ends = np.array([t - WINDOW_S / 2, t + WINDOW_S / 2])
        inside = self.time_s[(self.time_s > ends[0]) & (self.time_s < ends[1])]
        cuts = np.concatenate([ends[:1], inside, ends[1:]])
        pieces = pairwise(cuts)
        # Just inside each piece, since there are jumps at the knots.
        return (
            sum(
                (b - a) * (value(a + (b - a) * 1e-9) + value(b - (b - a) * 1e-9)) / 2
                for a, b in pieces
            )
            / WINDOW_S
        )

    def _body_heading(self, t):
        return self._mean_over_window(t, lambda at: np.interp(at, self.time_s, self.heading))

    def _body_speed(self, t):
        return self._mean_over_window(t, lambda at: np.hypot(*self._velocity(at)))

    def _body_acceleration(self, t):
        ends = (t + WINDOW_S / 2, t - WINDOW_S / 2)
        return (self._velocity(ends[0]) - self._velocity(ends[1])) / WINDOW_S

    def _gait(self, t):
        """Stride phase, fall, deviation and swing; None where nobody steps."""
        table = self.signal.steps
        last = np.searchsorted(self.step_s, t, side="right") - 1
        if 0 <= last < len(table) - 1 and self.step_s[last + 1] - self.step_s[last] <= 1.5:
            u = (t - self.step_s[last]) / (self.step_s[last + 1] - self.step_s[last])
            mixed = (1 - _smooth(u)) * table[last] + _smooth(u) * table[last + 1]
            return np.pi * (table[last, 7] + u), mixed[4], mixed[5], mixed[6]
        for row, sign, column in ((last, 1, 3), (last + 1, -1, 2)):
            if 0 <= row < len(table):
                u = sign * (t - self.step_s[row]) / table[row, column]
                if 0 <= u < 0.8:
                    left = 1 - _smooth(max(u - 0.5, 0) / 0.3)
                    angle = np.pi * (table[row, 7] + sign * u)
                    return angle, left * table[row, 4], table[row, 5], left * table[row, 6]
        return None

    def _hold(self, t):
        """Modes with their weights, share of the switch, and attitude of the hold."""
        row = np.searchsorted(self.hold_s, t, side="right") - 1
        attitudes = self.signal.holds[:, ATTITUDE : ATTITUDE + 9].reshape(-1, 3, 3)
        mode = self.carrying.carrying[row]
        if row == 0 or t >= self.hold_s[row] + SWITCH_S:
            return [(mode, 1.0)], attitudes[row], 0.0
        u = (t - self.hold_s[row]) / SWITCH_S
        s = 10 * u**3 - 15 * u**4 + 6 * u**5
        before = self.carrying.carrying[row - 1]
        turn = Rotation.from_matrix(attitudes[row - 1].T @ attitudes[row]).as_rotvec()
        held = attitudes[row - 1] @ Rotation.from_rotvec(s * turn).as_matrix()
        rise = ORDERED[mode].height_m - ORDERED[before].height_m
        return (
            [(mode, s), (before, 1 - s)],
            held,
            rise * (60 * u - 180 * u**2 + 120 * u**3) / SWITCH_S**2,
        )

    def _curve(self, values, place, first=0):
        """Cubic B-spline through a table of coefficients."""
        whole = int(np.floor(place))
        row = whole - first
        return BSpline(np.arange(-3.0, 5.0), values[row : row + 4], 3)(place - whole)

    def _angles(self, t):
        """Roll, pitch and yaw that gait and wander add to the heading."""
        gait, (modes, _, _) = self._gait(t), self._hold(t)
        wander = self._curve(self.signal.wander, t / 0.5)
        total = np.zeros(3)
        for mode, weight in modes:
            c = ORDERED[mode]
            total += weight * np.radians(c.wander_deg) * wander
            if gait is not None:
                waves = (c.roll_waves, c.pitch_waves, c.yaw_waves)
                swung = [np.radians(_waves(wave, gait[0])) for wave in waves]
                total += weight * gait[3] * np.array(swung)
        return total

    def attitude(self, t):
        """Rotation from the phone's frame to the map's."""
        roll, pitch, yaw = self._angles(t)
        heading = self._body_heading(t) + yaw
        return Rotation.from_euler("ZYX", [heading, pitch, roll]).as_matrix() @ self._hold(t)[1]

    def _arm(self, t, mode):
        """Place of the phone about the joint it swings from."""
        gait = self._gait(t)
        if gait is None:
            return np.zeros(3)
        c = ORDERED[mode]
        angle = gait[3] * np.radians(_waves(c.pitch_waves[:1], gait[0]))
        return -c.lever_m * np.array([np.sin(angle), 0.0, np.cos(angle)])

    def _walker_acceleration(self, t, modes):
        """Ahead, left and up, without gravity, but for the tremor."""
        total, shaken = np.zeros(3), 0.0
        gait = self._gait(t)
        for mode, weight in modes:
            c = ORDERED[mode]
            shaken += weight * (c.tremor_m_s2 + c.vibration_s * self._body_speed(t))
            if gait is None or not any(a for a, _ in c.up_waves):
                continue
            angle, fall, deviation, _ = gait
            fall *= (ORDERED[1].constant / c.constant) ** 4
            walks = 1 / (1 + (fall / c.most_m_s2) ** 4)
            fall *= walks**0.25
            fall *= max(1 + c.peak_variation * deviation, 0.2)
            shift = np.pi * c.alternation * walks
            early = angle + shift * np.cos(angle)
            shaken += weight * fall * c.roughness
            fall *= 1 - shift * np.sin(angle)
            waves = (c.forward_waves, c.left_waves, c.up_waves)
            total += (
                weight * fall / _SPANS[mode] * np.array([_waves(w, early, walks) for w in waves])
            )
            if c.lever_m:
                places = [self._arm(at, mode) for at in (t - _H, t, t + _H)]
                total += weight * (places[0] - 2 * places[1] + places[2]) / _H**2
        return total + shaken * self._curve(self.tremor, t / 0.04)

    def sample(self, t):
        """Specific force, angular rate and magnetic field in the phone's frame, (9,)."""
        modes, _, rise = self._hold(t)
        turn = self.attitude(t)
        heading = self._body_heading(t) + self._angles(t)[2]
        level = Rotation.from_euler("Z", heading).as_matrix()
        own = self._walker_acceleration(t, modes) + np.array([0.0, 0.0, rise])
        body = np.append(self._body_acceleration(t), 0.0)
        force = turn.T @ (body + level @ own + [0, 0, G])
        between = self.attitude(t - _H).T @ self.attitude(t + _H)
        rate = Rotation.from_matrix(between).as_rotvec() / (2 * _H)
        field = turn.T @ self._curve(self.signal.field, t / 0.25)
        return np.concatenate([force, rate, field])


def plain_phone(signal, trajectory, steps, carrying):
    """The plain phone of the same walk; the tremor's coefficients from the walk's beginning."""
    span_s = (trajectory.time_us[-1] - trajectory.time_us[0]) * 1e-6
    count = int(span_s / 0.04) + 6
    spread = np.sqrt(np.mean(np.square(BSpline.basis_element(np.arange(-3.0, 2.0))(_points()))) * 4)
    tremor = three_normals(signal.tremor, 0, count) / spread
    return PlainPhone(signal, trajectory, steps, carrying, tremor)


def _points():
    return np.linspace(-3.0, 1.0, 4001)[:-1]
