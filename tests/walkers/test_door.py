import numpy as np
import simpy

from blesim.walkers.door import Door


class Unsearched(list):
    """Who is inside, in a list that must not be looked through."""

    def remove(self, _):
        raise AssertionError("everybody inside is looked through for the one who leaves")


def story(kind):
    """Who came in when, and how many were inside then."""
    env = simpy.Environment()
    door, log = kind(env, 3), []
    stays = np.random.default_rng(1).integers(1, 9, 40).tolist()

    def visit(number):
        place = door.request()
        if not place.triggered and number % 7 == 0:
            # Who gives up outside gives nothing back.
            place.cancel()
            door.release(place)
            return
        yield place
        log.append((env.now, number, door.count))
        yield env.timeout(stays[number])
        door.release(place)

    def arrive():
        for number in range(40):
            yield env.timeout(1)
            env.process(visit(number))

    env.process(arrive())
    env.run()
    assert door.count == 0
    return log


def test_places_are_given_out_in_order_as_by_any_resource():
    log = story(Door)
    assert log == story(simpy.Resource)
    numbers = [number for _, number, _ in log]
    assert numbers == sorted(numbers)
    assert 30 < len(numbers) < 40
    assert max(inside for *_, inside in log) == 3


def test_nobody_is_looked_for_among_all_inside():
    env = simpy.Environment()
    door = Door(env, 10)
    door.users = Unsearched()
    places = [door.request() for _ in range(12)]
    for row in (4, 0, 9, 11, 2):
        door.release(places[row])
        env.run()
    # The eleventh came in for the first who left, the twelfth for the second.
    assert set(door.users) == {places[row] for row in (1, 3, 5, 6, 7, 8, 10)}
