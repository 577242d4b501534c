"""Shopping lists and recorded routes in CSV files."""

import csv
import re
from collections.abc import Iterator, Sequence
from io import StringIO
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from blesim.errors import DataError
from blesim.settings import Name, shortened
from blesim.walkers.trading_day import (
    MOST_POINTS,
    MOST_SECTIONS,
    RecordedRoute,
    RoutePoint,
    ShoppingList,
)

_LARGEST_BYTES = 50_000_000
# Python's own numbers may have underscores and digits of other scripts.
_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)(e[+-]?\d+)?", re.ASCII | re.IGNORECASE)
_NAME: TypeAdapter[str] = TypeAdapter(Name)


def read_lists(path: Path) -> tuple[ShoppingList, ...]:
    """Shopping lists of a CSV file with the columns ``shopper,section``, one row an item.

    Raises
    ------
    DataError
        With ``file:line: reason``, if the file cannot be read or a row is wrong.
    """
    found: dict[str, list[str]] = {}
    seen: set[str] = set()
    for where, (shopper, section) in _rows(path, ("shopper", "section")):
        if shopper not in found:
            _refuse_bad_name(where, "shopper", shopper)
        if section not in seen:
            _refuse_bad_name(where, "section", section)
            seen.add(section)
        sections = found.setdefault(shopper, [])
        if len(sections) >= MOST_SECTIONS:
            raise DataError(f"{where}: '{shopper}' has more than {MOST_SECTIONS} sections; cut it")
        sections.append(section)
    return tuple(
        ShoppingList(shopper=shopper, sections=tuple(sections))
        for shopper, sections in found.items()
    )


def read_routes(path: Path) -> tuple[RecordedRoute, ...]:
    """Recorded routes of a CSV file with the columns ``shopper,time_s,place``.

    The last column may be called ``node`` or ``section`` as well; times count from opening.

    Raises
    ------
    DataError
        With ``file:line: reason``, if the file cannot be read or a row is wrong.
    """
    found: dict[str, list[RoutePoint]] = {}
    header = ("shopper", "time_s", ("place", "node", "section"))
    for where, (shopper, time_s, place) in _rows(path, header):
        if shopper not in found:
            _refuse_bad_name(where, "shopper", shopper)
        point = _point(where, time_s, place)
        points = found.setdefault(shopper, [])
        if points and point.time_s < points[-1].time_s:
            raise DataError(f"{where}: time_s goes backwards for '{shopper}'; sort the rows")
        if len(points) >= MOST_POINTS:
            raise DataError(f"{where}: '{shopper}' has more than {MOST_POINTS} points; thin them")
        points.append(point)
    return tuple(RecordedRoute(shopper=who, points=tuple(way)) for who, way in found.items())


def _refuse_bad_name(where: str, column: str, name: str) -> None:
    try:
        _NAME.validate_python(name)
    except ValidationError as fault:
        raise DataError(f"{where}: {column}: {_reason(fault)}") from None


def _point(where: str, time_s: str, place: str) -> RoutePoint:
    if not _NUMBER.fullmatch(time_s):
        raise DataError(f"{where}: time_s: '{shortened(time_s)}' is not a number of seconds")
    try:
        return RoutePoint(place=place, time_s=float(time_s))
    except ValidationError as fault:
        column = fault.errors()[0]["loc"][0]
        raise DataError(f"{where}: {column}: {_reason(fault)}") from None


def _reason(fault: ValidationError) -> str:
    return fault.errors()[0]["msg"].removeprefix("Value error, ")


def _rows(
    path: Path, header: Sequence[str | tuple[str, ...]]
) -> Iterator[tuple[str, tuple[str, ...]]]:
    """``file:line`` and values of each row of a CSV file that must have this header."""
    named = [(name,) if isinstance(name, str) else name for name in header]
    reader = csv.reader(StringIO(_text(path), newline=""))
    try:
        first = [name.strip() for name in next(reader, [])]
        if not _fits(first, named):
            wanted = ",".join("|".join(choice) for choice in named)
            raise DataError(f"{path}:1: the first line must be '{wanted}'")
        count = 0
        for row in filter(None, reader):
            values = tuple(value.strip() for value in row)
            where = f"{path}:{reader.line_num}"
            if len(values) != len(named) or not all(values):
                raise DataError(f"{where}: {len(named)} values are needed: {','.join(first)}")
            count += 1
            yield where, values
    except csv.Error as fault:
        raise DataError(f"{path}:{reader.line_num}: {shortened(str(fault))}") from None
    if not count:
        raise DataError(f"{path}:1: holds no row; give at least one {','.join(first)}")


def _fits(first: Sequence[str], named: Sequence[tuple[str, ...]]) -> bool:
    return len(first) == len(named) and all(
        name in choice for name, choice in zip(first, named, strict=True)
    )


def _text(path: Path) -> str:
    """Text of a file that is not too large."""
    try:
        # A device or a pipe may never end.
        if path.exists() and not path.is_file():
            raise DataError(f"{path}: is not a file; give the name of a CSV file")
        with path.open("rb") as file:
            content = file.read(_LARGEST_BYTES + 1)
        if len(content) > _LARGEST_BYTES:
            raise DataError(f"{path}: is larger than {_LARGEST_BYTES // 10**6} MB; cut it")
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as fault:
        raise DataError(f"{path}: cannot be read: not UTF-8 at byte {fault.start}") from None
    except OSError as fault:
        raise DataError(f"{path}: cannot be read: {shortened(str(fault.strerror))}") from None
