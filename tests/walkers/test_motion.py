import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from blesim.walkers.motion import (
    FREE_SPEED_M_S,
    SLOWEST,
    crowd_factor,
    crowd_factors,
    free_motion,
    limits_m_s,
    stretch_walked,
)


@pytest.mark.parametrize(
    ("density_per_m2", "speed_m_s"),
    # v = 1.34 (1 - exp(-1.913 (1/rho - 1/5.4))), worked out by hand.
    [(0.5, 1.298), (1.0, 1.058), (2.0, 0.606), (3.0, 0.331)],
)
def test_speed_among_others_is_that_of_weidmann(density_per_m2, speed_m_s):
    assert float(FREE_SPEED_M_S * crowd_factor(density_per_m2)) == pytest.approx(
        speed_m_s, abs=0.0015
    )


def test_flow_is_largest_where_weidmann_says():
    # 1.225 persons a second and metre at 1.75 persons/m2, Weidmann 1993.
    density = np.linspace(0.2, 5.0, 481)
    flow = FREE_SPEED_M_S * crowd_factor(density) * density
    free = crowd_factor(density) > SLOWEST
    assert density[np.argmax(np.where(free, flow, 0))] == pytest.approx(1.75, abs=0.05)
    assert np.max(np.where(free, flow, 0)) == pytest.approx(1.225, abs=0.005)


def test_a_jam_slows_but_never_stops():
    assert crowd_factor([0.0, 5.4, 50.0]).tolist() == [1.0, SLOWEST, SLOWEST]
    factors = crowd_factors(np.array([4.0, 30.0]))
    assert [each[0] for each in factors] == [1.0, 1.0]
    assert [each[-1] for each in factors] == [SLOWEST, SLOWEST]
    assert all(np.all(np.diff(each) <= 0) for each in factors)


speeds = st.floats(0.05, 3.0)
# To have any meaning the rest of a test needs a start that can brake in time.
lengths = st.floats(0.001, 60.0)
rates = st.floats(0.1, 5.0)


def way_m(start, held, end, duration_s, rate):
    """Length of the trapezoid, integrated in another way than it was made."""
    up_s, down_s = abs(held - start) / rate, abs(held - end) / rate
    times = np.array([0.0, up_s, duration_s - down_s, duration_s])
    return np.trapezoid([start, held, held, end], times), times


@given(share=st.floats(0, 1), wish=speeds, limit=st.floats(0, 3.0), length=lengths, rate=rates)
def test_a_stretch_is_walked_to_its_end(share, wish, limit, length, rate):
    start = share * min(np.sqrt(limit**2 + 2 * rate * length), 3.0)
    duration_s, held, end = stretch_walked(start, wish, limit, length, rate)
    walked_m, times = way_m(start, held, end, duration_s, rate)
    assert walked_m == pytest.approx(length, rel=1e-6, abs=1e-7)
    assert np.all(np.diff(times) >= -1e-6)
    assert end <= limit + 1e-6
    assert held <= max(start, wish) + 1e-9


@given(start=st.floats(0, 1.5), end=st.floats(0, 1.5), wish=speeds, length=lengths, rate=rates)
def test_backwards_in_time_a_stretch_takes_as_long(start, end, wish, length, rate):
    # Only where both ends can be had exactly.
    if wish < max(start, end) or abs(start**2 - end**2) > 2 * rate * length:
        return
    there = stretch_walked(start, wish, end, length, rate)
    back = stretch_walked(end, wish, start, length, rate)
    if there[2] == end and back[2] == start:
        assert there[0] == pytest.approx(back[0], rel=1e-9)


def test_braking_takes_its_distance():
    # v^2 / 2a = 1 / 1.6 m.
    limits = limits_m_s(np.array([5.0, 0.625]), np.array([np.inf, 0.0]), 0.8)
    assert limits.tolist() == pytest.approx([1.0, 0.0])
    assert stretch_walked(1.0, 1.0, 0.0, 0.625, 0.8) == pytest.approx((1.25, 1.0, 0.0))


def test_too_short_a_stretch_has_a_peak():
    # From rest to rest over 1 m at 1 m/s2: peak 1 m/s after 1 s.
    assert stretch_walked(0.0, 3.0, 0.0, 1.0, 1.0) == pytest.approx((2.0, 1.0, 0.0))


def test_who_comes_into_a_crowd_slows_down_first():
    duration_s, held, end = stretch_walked(1.0, 0.5, 9.0, 10.0, 0.75)
    # 0.5 m in 2/3 s, then 9.5 m at 0.5 m/s.
    assert (duration_s, held, end) == pytest.approx((2 / 3 + 19.0, 0.5, 0.5))


def test_motion_with_nobody_in_the_way_is_the_same_stretch_after_stretch():
    length = np.array([4.0, 3.0, 1.0, 6.0])
    rests = np.array([False, False, True, True])
    limits = limits_m_s(length, np.where(rests, 0.0, np.inf), 0.5)
    out = np.empty((4, 4))
    free_motion(length, limits, rests, 0.9, 0.5, out)
    speed = 0.0
    for row in range(4):
        duration_s, held, end = stretch_walked(speed, 0.9, limits[row], length[row], 0.5)
        assert out[row].tolist() == [np.floor(duration_s * 1e6 + 0.5), speed, held, end]
        speed = 0.0 if rests[row] else end
