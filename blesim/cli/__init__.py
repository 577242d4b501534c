"""The commands; each is a file here that imports what is heavy only when it runs."""

import sys
from typing import Annotated, Any

import typer

from blesim.cli.console import answer, prepare_streams, report_fault, report_lost_output
from blesim.cli.estimate import estimate
from blesim.cli.estimators import estimators
from blesim.cli.fidelity import fidelity
from blesim.cli.import_ import import_
from blesim.cli.inspect import inspect
from blesim.cli.rerun import rerun
from blesim.cli.schema import schema
from blesim.cli.score import score
from blesim.cli.simulate import simulate
from blesim.cli.validate import validate
from blesim.stopping import Stopped, listen, listen_no_more

app = typer.Typer(
    pretty_exceptions_enable=False,
    add_completion=False,
)
_COMMANDS = (simulate, estimate, score, inspect, validate, estimators, schema, fidelity, rerun)
for command in _COMMANDS:
    app.command()(command)
app.command(name="import")(import_)


def _tell_version(asked: bool) -> None:
    if asked:
        from blesim import __version__

        answer(f"blesim {__version__}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool,
        typer.Option("--version", help="Print the version.", callback=_tell_version, is_eager=True),
    ] = False,
) -> None:
    """A Bluetooth-beacon store in software: simulate, record, position and score."""


_CUT_OFF = 130
# The fault of a wrong call; versions of Typer differ in where it is, not in what is made of it.
_CallFault: type[Any] = typer.BadParameter.__base__  # type: ignore[assignment]  # every class has one


def main() -> None:
    """Run a command; a fault that blesim knows ends in one line and its exit code."""
    prepare_streams()
    listen()
    sys.exit(_exit_code())


def _exit_code() -> int:
    from blesim.errors import BlesimError

    try:
        code = app(sys.argv[1:] or ["--help"], prog_name="blesim", standalone_mode=False)
        sys.stdout.flush()
        return int(code or 0)
    except _CallFault as fault:
        report_fault(_one_line(fault))
        return int(fault.exit_code)
    except BlesimError as fault:
        report_fault(str(fault))
        return fault.exit_code
    except OSError as fault:
        if fault.filename is not None:
            raise
        report_lost_output(fault)
        return 1
    except Stopped:
        listen_no_more()
        report_fault("stopped; every output is either whole or as it was before")
        return _CUT_OFF


def _one_line(fault: Any) -> str:
    words = " ".join(fault.format_message().split()).rstrip(".")
    command = fault.ctx.command_path if fault.ctx is not None else "blesim"
    return f"{words}; see '{command} --help'"
