import os
import subprocess
import sys
import time

import pytest

from blesim.errors import BlesimError, DataError, UsageError
from blesim.workers import shared, workers

PARENT = """
import sys, time
sys.path.insert(0, {folder!r})
import test_workers
from blesim.workers import workers
if __name__ == "__main__":
    with workers(1, test_workers.prepare, ()) as crew:
        for pid in crew.results(test_workers.tell_and_sleep, [0, 0, 0, 60]):
            print(pid, flush=True)
"""


def double(number):
    return 2 * number


def refuse(number):
    raise DataError(f"piece {number}")


def die(_number):
    os._exit(9)


def tell_and_sleep(seconds):
    time.sleep(seconds)
    return os.getpid()


def divide_or_sleep(seconds):
    return 1 // seconds if not seconds else time.sleep(seconds)


def prepare():
    pass


def test_results_come_in_order_and_pieces_are_not_taken_too_early():
    taken = []

    def pieces():
        for number in range(12):
            taken.append(number)
            yield number

    with workers(2, prepare, ()) as crew:
        found = []
        for result in crew.results(double, pieces()):
            found.append(result)
            assert len(taken) - len(found) <= 4
    assert found == [2 * number for number in range(12)]


def test_a_fault_in_a_worker_is_told_as_it_is():
    with pytest.raises(DataError, match="piece 3"), workers(1, prepare, ()) as crew:
        list(crew.results(refuse, [3]))


def test_a_dead_worker_is_one_line():
    with pytest.raises(BlesimError, match="a worker process died"), workers(1, prepare, ()) as crew:
        list(crew.results(die, [1, 2, 3]))


def test_who_stops_early_waits_for_nobody():
    start_s = time.monotonic()
    with pytest.raises(ZeroDivisionError), workers(1, prepare, ()) as crew:
        next(crew.results(divide_or_sleep, [0, 0, 60]))
    assert time.monotonic() - start_s < 30


def alive(pid):
    """Whether a process runs; one that waits to be counted does not."""
    try:
        with open(f"/proc/{pid}/stat", encoding="utf-8") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.skipif(not os.path.exists("/proc/self/stat"), reason="no /proc to look into")
def test_workers_die_with_their_parent(tmp_path):
    script = tmp_path / "parent.py"
    script.write_text(PARENT.format(folder=os.path.dirname(__file__)), encoding="utf-8")
    parent = subprocess.Popen(
        [sys.executable, script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    worker = int(parent.stdout.readline())
    assert alive(worker)
    parent.kill()
    parent.communicate()
    until_s = time.monotonic() + 10
    while alive(worker) and time.monotonic() < until_s:
        time.sleep(0.05)
    assert not alive(worker)


def counted(first):
    """A function that also tells how often it was called in its process."""
    calls = [0]

    def tell(number):
        calls[0] += 1
        return first + number, calls[0]

    return tell


def test_shared_work_comes_in_order_from_any_number_of_processes():
    alone = list(shared(counted, (10,), range(5), 1))
    assert [result for result, _ in alone] == [10, 11, 12, 13, 14]
    # Made once in the process, not once a piece.
    assert [calls for _, calls in alone] == [1, 2, 3, 4, 5]
    both = list(shared(counted, (10,), range(5), 2))
    assert [result for result, _ in both] == [10, 11, 12, 13, 14]
    assert max(calls for _, calls in both) >= 3


def test_shared_work_is_done_as_it_is_asked_for():
    done = []
    results = shared(lambda: done.append, (), range(5), 1)
    next(results)
    assert done == [0]
    results.close()
    assert list(shared(counted, (10,), [], 4)) == []


def test_shared_work_needs_a_process():
    with pytest.raises(UsageError, match="jobs 0: at least one process is needed"):
        next(shared(counted, (10,), range(5), 0))
