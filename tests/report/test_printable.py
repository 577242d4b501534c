import pytest

from blesim.report.printable import printable


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("Prüfstand 店 a\u00a0b", "Prüfstand 店 a\u00a0b"),
        ("a\nb\tc", r"a\nb\tc"),
        ("\x1b[31mred", r"\x1b[31mred"),
        ("\x9b31m", r"\x9b31m"),
        ("a\u2028b", r"a\u2028b"),
        ("\udce9", r"\udce9"),
        ("back\\slash", "back\\slash"),
    ],
)
def test_nothing_steers_a_terminal(text, shown):
    assert printable(text) == shown
