"""The wish of the user or the system that a command end, and who asks whether there was one."""

import signal

_wished = False


class Stopped(BaseException):
    """The command is to end; no handler of faults may swallow it."""


def stop(_signal: int, _frame: object) -> None:
    """Raise `Stopped`; a handler for `signal.signal`."""
    global _wished
    _wished = True
    raise Stopped


def refuse_if_stopped() -> None:
    """Raise `Stopped` if somebody wished it: what a signal raises inside a C callback is lost."""
    if _wished:
        raise Stopped


def listen() -> None:
    """Let interrupt and termination raise `Stopped`."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, stop)


def listen_no_more() -> None:
    """Ignore them: the command is ending already."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
