"""What blesim raises, and the exit code each kind of fault has on the command line."""


class BlesimError(Exception):
    """Any fault that blesim explains in one line; the message says what, where and what to do."""

    exit_code = 1


class DataError(BlesimError):
    """A file or a recording that cannot be used: missing, truncated, not ours, or inconsistent."""


class InvariantError(BlesimError):
    """A finished run that broke one of its own laws: a fault of blesim, not of its user."""


class UsageError(BlesimError):
    """A call that cannot be carried out: an unknown name, a wrong parameter, a missing seed."""

    exit_code = 2


class ScenarioError(UsageError):
    """A scenario or map that is wrong; the message has one ``file:line: path: reason`` a fault."""


class VenueError(UsageError):
    """A venue whose parts contradict each other: a beacon inside a shelf, an aisle to nowhere."""


class ConformanceError(BlesimError):
    """An estimator that breaks a rule of the contract; the message begins with the rule."""
