"""The commands; each is a file here that imports what is heavy only when it runs."""

import os
import signal
import sys

import typer

from blesim.cli.console import report_fault
from blesim.cli.estimate import estimate
from blesim.cli.estimators import estimators
from blesim.cli.import_ import import_
from blesim.cli.inspect import inspect
from blesim.cli.schema import schema
from blesim.cli.score import score
from blesim.cli.simulate import simulate
from blesim.cli.validate import validate

app = typer.Typer(
    help="A Bluetooth-beacon store in software: simulate, record, position and score.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
)
for command in (simulate, estimate, score, inspect, validate, estimators, schema):
    app.command()(command)
app.command(name="import")(import_)

_CUT_OFF = 130


class _Stopped(BaseException):
    """The user or the system wants the command to end; no handler of faults may swallow it."""


def _stop(_signal: int, _frame: object) -> None:
    raise _Stopped


def main() -> None:
    """Run a command; a fault that blesim knows ends in one line and its exit code."""
    from blesim.errors import BlesimError

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _stop)
    try:
        app()
    except BlesimError as fault:
        report_fault(str(fault))
        sys.exit(fault.exit_code)
    except BrokenPipeError:
        # The reader of our output has gone; nothing is left to say to it.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except _Stopped:
        report_fault("stopped; no output was changed")
        sys.exit(_CUT_OFF)
