import numpy as np
import pytest
import simpy

from blesim.venue.routes import Routes
from blesim.walkers.alarm import Alarm
from blesim.walkers.clearance import Clearance
from blesim.walkers.trading_day import Basket, Tills, TradingDay
from blesim.walkers.trip import FREE, Ground
from blesim.walkers.visit import NEVER_US, Course
from blesim.walkers.visitors import Planner, Visitor

DAY = TradingDay(
    opens="10:00",
    closes="11:00",
    shoppers=5.0,
    entrance="F/west",
    tills=Tills(nodes=("D/west", "E/west")),
    basket=Basket(mean=8, spread=2),
)


def test_an_alarm_goes_off_each_time_it_is_set():
    env = simpy.Environment()
    heard = []

    def sleeper(alarm, delays):
        for delay in delays:
            yield alarm.after(delay)
            heard.append((env.now, delay))

    env.process(sleeper(Alarm(env), [5, 0, 7]))
    env.process(sleeper(Alarm(env), [6, 3]))
    env.run()
    assert heard == [(5, 5), (5, 0), (6, 6), (9, 3), (12, 7)]


@pytest.fixture(scope="module")
def visitor(section) -> Visitor:
    ground = Ground(routes=Routes.of(section.graph), clearance=Clearance.of(section))
    return next(Planner.of(section, DAY, ground, 4).visitors())


def course_of(visitor: Visitor, **settings) -> Course:
    usual = {"first": 0, "end": len(visitor.plan.legs), "wait_us": visitor.wait_us}
    return Course.along(visitor.plan, **(usual | settings))


def test_a_leg_that_nobody_hinders_is_walked_as_planned(visitor):
    # The fast way and the careful way are two implementations of the same.
    course = course_of(visitor)
    for row, span_us in enumerate(course.spans_us):
        motion, careful_us, next_m_s, breaks = course.hindered(row, 0, None, 1.0, visitor.mover)
        assert careful_us == span_us
        assert list(motion) == visitor.plan.legs[row, FREE:].tolist()
        assert next_m_s is None
        assert not breaks


def test_who_is_slowed_takes_longer_and_tells_the_speed(visitor):
    course = course_of(visitor)
    row = int(np.argmax(course.spans_us))
    motion, span_us, _, _ = course.hindered(row, 0, None, 0.5, visitor.mover)
    assert motion[0] > visitor.plan.legs[row, FREE]
    assert span_us - motion[0] == course.spans_us[row] - int(visitor.plan.legs[row, FREE])
    assert motion[2] <= max(motion[1], 0.5 * visitor.mover.speed_m_s)


def test_who_must_leave_breaks_off_at_the_stop(visitor):
    course = course_of(visitor)
    stop = next(row for row, wait in enumerate(np.diff(course.spans_us)) if wait > 10_000_000) + 1
    walked_us = int(visitor.plan.legs[stop, FREE])
    leave_by_us = walked_us + 3_000_000
    hurried = course_of(visitor, leave_by_us=leave_by_us)
    _, span_us, _, breaks = hurried.hindered(stop, 0, None, 1.0, visitor.mover)
    assert breaks
    assert leave_by_us <= span_us < course.spans_us[stop]


def test_waiting_until_a_time_is_left_to_the_careful_way(visitor):
    until_us = np.where(visitor.wait_us > 0, -90_000_000, 0)
    course = course_of(visitor, wait_us=until_us)
    assert max(course.spans_us) >= NEVER_US
    row = int(np.argmax(course.spans_us))
    early, late = (
        course.hindered(row, now_us, None, 1.0, visitor.mover)[1] + now_us
        for now_us in (0, 200_000_000)
    )
    assert 90_000_000 <= early < 100_000_000
    assert 200_000_000 < late < 290_000_000
