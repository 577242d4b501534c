"""What estimators refuse: settings out of their range, a missing start, a walk before `fit`."""

from collections.abc import Sequence

from blesim.errors import UsageError
from blesim.estimators.base import StartInfo


def required(start: StartInfo | None, who: str) -> StartInfo:
    """The start, or a `UsageError` that asks for it."""
    if start is None:
        raise UsageError(f"{who} needs to know where the walk begins; give a start")
    return start


def not_fitted(who: str) -> UsageError:
    """Error of an estimator that was started before `fit`."""
    return UsageError(f"{who} does not know the venue yet; call fit first")


def refuse_other(name: str, value: str, known: Sequence[str]) -> None:
    """Raise `UsageError` for a word that is none of those known."""
    if value not in known:
        raise UsageError(f"{name} '{value}': use one of {', '.join(known)}")


def refuse_outside(**settings: tuple[float, float, float]) -> None:
    """Raise `UsageError` for the first setting whose value is not within its low and high."""
    for name, (value, low, high) in settings.items():
        if not low <= value <= high:
            raise UsageError(f"{name} {value:g}: give {low:g} to {high:g}")
