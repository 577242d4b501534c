"""Processes that share work, a few pieces ahead of who takes the results, and that leave no orphan.

Every worker holds the end of a line to its parent. When the line is cut, because the parent says
so or because it is dead, the worker ends, whatever it is doing.
"""

import os
import pickle
import signal
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from threading import Thread
from typing import Any, TypeVar

from blesim.errors import BlesimError, InvariantError, UsageError

T = TypeVar("T")
R = TypeVar("R")

# Pieces a worker may be ahead; more would pile up in memory.
_AHEAD = 2
_STOPPING = (signal.SIGINT, signal.SIGTERM)


@dataclass(frozen=True, slots=True, kw_only=True)
class Crew:
    """Workers that are ready."""

    pool: ProcessPoolExecutor
    jobs: int

    def results(self, function: Callable[[T], R], pieces: Iterable[T]) -> Iterator[R]:
        """Results of a function, in the order of the pieces.

        Raises
        ------
        BlesimError
            If a worker dies.
        """
        waiting: deque[Future[R]] = deque()
        try:
            for piece in pieces:
                with _undisturbed():
                    waiting.append(self.pool.submit(function, piece))
                if len(waiting) > _AHEAD * self.jobs:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        except BrokenProcessPool as fault:
            raise BlesimError(
                "a worker process died, perhaps for want of memory; use fewer jobs"
            ) from fault


def shared(
    make: Callable[..., Callable[[T], R]],
    arguments: tuple[Any, ...],
    pieces: Sequence[T],
    jobs: int,
) -> Generator[R, None, None]:
    """Results of pieces in their order, the same for any number of processes.

    Who does not take them all closes the generator, which ends its processes.

    Parameters
    ----------
    make : callable
        Called once in each process that works: makes the function that does a piece.
    arguments : tuple
        Its arguments.
    pieces : sequence
        What is to be done.
    jobs : int
        How many processes; with one, or with one piece, this one.

    Raises
    ------
    UsageError
        If `jobs` is less than 1.
    BlesimError
        If one of several processes dies.
    """
    if jobs < 1:
        raise UsageError(f"jobs {jobs}: at least one process is needed")
    if jobs == 1 or len(pieces) < 2:
        if len(pieces):
            yield from map(make(*arguments), pieces)
        return
    with workers(min(jobs, len(pieces)), _take_up, (make, arguments)) as crew:
        yield from crew.results(_do, pieces)


_work: Callable[[Any], Any] | None = None


def _take_up(make: Callable[..., Callable[[T], R]], arguments: tuple[Any, ...]) -> None:
    global _work
    _work = make(*arguments)


def _do(piece: Any) -> Any:
    if _work is None:
        raise InvariantError("a worker was given a piece before it knew its work")
    return _work(piece)


@contextmanager
def workers(jobs: int, prepare: Callable[..., None], arguments: tuple[Any, ...]) -> Iterator[Crew]:
    """Worker processes, ended at once when the block does not end well.

    Parameters
    ----------
    jobs : int
        How many.
    prepare : callable
        Called in each before its first piece of work.
    arguments : tuple
        Its arguments.
    """
    # A fresh interpreter in each worker: a forked one would inherit threads and open files.
    context = get_context("spawn")
    theirs, ours = context.Pipe(duplex=False)
    with theirs, ours:
        # Packed, so that a worker holds the line before it loads what it needs for its work.
        packed = pickle.dumps((prepare, arguments))
        pool = ProcessPoolExecutor(jobs, context, initializer=_begin, initargs=(theirs, packed))
        try:
            yield Crew(pool=pool, jobs=jobs)
        except BaseException:
            ours.close()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
        pool.shutdown()


def _begin(line: Connection, packed: bytes) -> None:
    """Make a worker end with its parent alone: an interrupt from the keyboard reaches both."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _STOPPING)
    Thread(target=_end_when_cut, args=(line,), daemon=True).start()
    prepare, arguments = pickle.loads(packed)  # noqa: S301  # from the parent
    prepare(*arguments)


def _end_when_cut(line: Connection) -> None:
    with suppress(EOFError, OSError):
        line.recv()
    os._exit(1)


@contextmanager
def _undisturbed() -> Iterator[None]:
    """A block in which a worker may be born; what would stop it half way waits until the end."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _STOPPING)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
