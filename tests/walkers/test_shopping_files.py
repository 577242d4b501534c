from pathlib import Path

import pytest

from blesim.errors import DataError
from blesim.walkers.shopping_files import read_lists, read_routes


def test_lists_are_read_in_order(tmp_path):
    path = tmp_path / "lists.csv"
    path.write_text("shopper,section\nann,A-02\nbob,B-01\nann,A-01\n")
    lists = read_lists(path)
    assert [each.shopper for each in lists] == ["ann", "bob"]
    assert lists[0].sections == ("A-02", "A-01")


def test_routes_are_read_in_order(tmp_path):
    path = tmp_path / "routes.csv"
    path.write_text("shopper,time_s,node\nann,10,A1\nann,60.5,A-02\n")
    (route,) = read_routes(path)
    assert [(point.place, point.time_s) for point in route.points] == [("A1", 10), ("A-02", 60.5)]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("who,what\n", r":1: the first line must be 'shopper,time_s,place\|node\|section'"),
        ("shopper,time_s,node\n", ":1: holds no row"),
        ("shopper,time_s,node\nann,1,A1\nann,2\n", ":3: 3 values are needed"),
        ("shopper,time_s,node\nann,soon,A1\n", ":2: time_s: 'soon' is not a number"),
        ("shopper,time_s,node\nann,-1,A1\n", ":2: time_s"),
        ("shopper,time_s,node\nann,nan,A1\n", ":2: time_s"),
        ("shopper,time_s,node\nann,5,A1\nann,4,A2\n", ":3: time_s goes backwards"),
    ],
)
def test_bad_routes_are_refused_with_file_and_line(tmp_path, text, reason):
    path = tmp_path / "routes.csv"
    path.write_text(text)
    with pytest.raises(DataError, match=f"routes.csv{reason}") as caught:
        read_routes(path)
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_told(tmp_path):
    with pytest.raises(DataError, match=r"none\.csv: cannot be read"):
        read_lists(tmp_path / "none.csv")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("shopper,section\na\x07b,A-01\n", r":2: shopper: holds the control character U\+0007"),
        ("shopper,section\nann,A-01\nann,A\x0001\n", r":3: section: .* U\+0000; take it out"),
        ('shopper,section\n"a\nb",A-01\n', r":3: shopper: .* U\+000A"),
        (f"shopper,section\n{'a' * 201},A-01\n", ":2: shopper: .* at most 200 characters"),
        (f"shopper,section\nann,{'a' * 201}\n", ":2: section: .* at most 200 characters"),
        ("shopper,section\n" + "ann,A-01\n" * 1001, ":1002: 'ann' has more than 1000 sections"),
        (f"shopper,section\nann,{'a' * 200_000}\n", ":2: field larger than"),
    ],
    ids=["control", "null", "line-end", "shopper", "section", "rows", "field"],
)
def test_bad_lists_are_refused_with_file_and_line(tmp_path, text, reason):
    path = tmp_path / "lists.csv"
    path.write_bytes(text.encode())
    with pytest.raises(DataError, match=f"lists.csv{reason}") as caught:
        read_lists(path)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize("number", ["1_0", "\u0661", "0x1", "1e", "inf", "nan", "1e999", "-1"])
def test_numbers_that_are_none_are_refused(tmp_path, number):
    path = tmp_path / "routes.csv"
    path.write_text(f"shopper,time_s,node\nann,{number},A1\n", encoding="utf-8")
    with pytest.raises(DataError, match=r"routes\.csv:2: time_s"):
        read_routes(path)


@pytest.mark.parametrize(("number", "value"), [("+1.5", 1.5), ("2.", 2.0), (".5E1", 5.0)])
def test_numbers_may_be_written_in_any_usual_way(tmp_path, number, value):
    path = tmp_path / "routes.csv"
    path.write_text(f"shopper,time_s,node\nann,{number},A1\n", encoding="utf-8")
    assert read_routes(path)[0].points[0].time_s == value


def test_a_route_of_too_many_points_is_refused(tmp_path):
    path = tmp_path / "routes.csv"
    path.write_text("shopper,time_s,node\n" + "ann,1,A1\n" * 10_001, encoding="utf-8")
    with pytest.raises(DataError, match=r":10002: 'ann' has more than 10000 points"):
        read_routes(path)


def test_what_is_no_file_or_never_ends_is_refused(tmp_path, monkeypatch):
    with pytest.raises(DataError, match="is not a file"):
        read_lists(tmp_path)
    endless = Path("/dev/zero")
    if endless.exists():
        with pytest.raises(DataError, match="is not a file"):
            read_lists(endless)
    path = tmp_path / "lists.csv"
    path.write_text("shopper,section\nann,A-01\n", encoding="utf-8")
    monkeypatch.setattr("blesim.walkers.shopping_files._LARGEST_BYTES", 10)
    with pytest.raises(DataError, match="is larger than"):
        read_lists(path)


def test_what_is_no_text_is_refused(tmp_path):
    path = tmp_path / "lists.csv"
    path.write_bytes(b"shopper,section\nann,\xff\n")
    with pytest.raises(DataError, match="not UTF-8 at byte 20"):
        read_lists(path)
