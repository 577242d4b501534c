import pytest

from blesim import errors


@pytest.mark.parametrize(
    ("kind", "code"),
    [
        (errors.DataError, 1),
        (errors.InvariantError, 1),
        (errors.UsageError, 2),
        (errors.ScenarioError, 2),
        (errors.VenueError, 2),
    ],
)
def test_exit_codes(kind: type[errors.BlesimError], code: int) -> None:
    assert kind("x").exit_code == code
    assert issubclass(kind, errors.BlesimError)
