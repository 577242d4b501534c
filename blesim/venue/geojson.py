"""A venue as GeoJSON (RFC 7946) text and back, with IMDF's feature types where it has them."""

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

from pydantic import ValidationError

from blesim.errors import VenueError
from blesim.settings import Settings, Text, shortened, unreadable
from blesim.venue.beacons import Beacon
from blesim.venue.floor_plan import FloorPlan, Level, Obstacle
from blesim.venue.geojson_features import FEATURES, Feature, Json, Part, reasons, told
from blesim.venue.geojson_written import features
from blesim.venue.graph import AisleGraph, Edge, Node
from blesim.venue.sections import Section
from blesim.venue.venue import Georeference, Venue

LOCAL_METRES = "local metres"
AnyPart = TypeVar("AnyPart", bound=Part)
# An edge's line and its nodes are written with the same numbers, but people edit maps.
_SAME_END_M = 0.001
# What the other parts of a venue call what the map calls otherwise.
_NAMES = {"fixture": "obstacle", "amenity": "beacon"}


class _About(Settings):
    """The member that says what the coordinates are: without it they would be degrees."""

    coordinates: Literal["local metres"]
    name: Text
    georeference: Georeference | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Parts:
    """The parts of a venue in the order of the map, and who each feature is for messages."""

    parts: list[Part]
    labels: dict[str, int]

    def of(self, kind: type[AnyPart]) -> tuple[AnyPart, ...]:
        return tuple(part for part in self.parts if isinstance(part, kind))


def to_geojson(venue: Venue) -> str:
    """Text of a map: one feature a line, the same for equal venues.

    Parameters
    ----------
    venue : Venue
        What to write down; coordinates are its local metres.

    Returns
    -------
    str
        A FeatureCollection whose foreign member ``blesim`` says what the coordinates are.
    """
    about: Json = {"coordinates": LOCAL_METRES, "name": venue.name}
    if venue.georeference is not None:
        about["georeference"] = venue.georeference.model_dump()
    lines = ",\n".join(f"    {_compact(feature)}" for feature in features(venue))
    return (
        '{\n  "type": "FeatureCollection",\n'
        f'  "blesim": {_compact(about)},\n  "features": [\n{lines}\n  ]\n}}\n'
    )


def from_geojson(text: str, where: str) -> Venue:
    """Venue that a map describes.

    Parameters
    ----------
    text : str
        A FeatureCollection as `to_geojson` writes it.
    where : str
        Name of the file, for messages.

    Raises
    ------
    VenueError
        With one line ``where: feature 12 (beacon 'D3'): reason`` for each fault of a feature, or
        one for the first contradiction between them. Features count from 1.
    """
    document = _parsed(text, where)
    found = document.get("features")
    if document.get("type") != "FeatureCollection" or not isinstance(found, list):
        raise VenueError(f"{where}: not a GeoJSON FeatureCollection with a list of features")
    about = _about(document, where)
    parts = _parts(found, where)
    _refuse_detached(found, parts.of(Node), where)
    try:
        return _venue(about, parts)
    except VenueError as fault:
        raise VenueError(f"{where}: {_located(str(fault), parts.labels)}") from fault


def _compact(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def _parsed(text: str, where: str) -> Json:
    try:
        document = json.loads(text, parse_constant=_refuse_constant, object_pairs_hook=_members)
    except json.JSONDecodeError as fault:
        raise VenueError(f"{where}:{fault.lineno}:{fault.colno}: not JSON: {fault.msg}") from fault
    except (ValueError, RecursionError) as fault:
        raise VenueError(f"{where}: not a map: {fault}") from fault
    if not isinstance(document, dict):
        raise VenueError(f"{where}: not a GeoJSON FeatureCollection")
    return document


def _members(pairs: list[tuple[str, Any]]) -> Json:
    """A JSON object; `ValueError` for what JSON allows but no map needs, in names or texts."""
    found: Json = {}
    for name, value in pairs:
        if name in found:
            raise ValueError(f"member {told(name)} is there twice after {told(found)}")
        for text in (name, value):
            reason = unreadable(text) if isinstance(text, str) else None
            if reason is not None:
                raise ValueError(f"{told(text)} {reason}")
        found[name] = value
    return found


def _refuse_constant(name: str) -> None:
    raise ValueError(f"{name} is not a number that JSON knows")


def _about(document: Json, where: str) -> _About:
    if not isinstance(document.get("blesim"), dict):
        member = _compact({"blesim": {"coordinates": LOCAL_METRES, "name": "..."}})
        raise VenueError(
            f"{where}: no member 'blesim', so the coordinates would be degrees; where they are"
            f" metres, add {member[1:-1]}"
        )
    try:
        return _About.model_validate(document["blesim"])
    except ValidationError as fault:
        lines = [f"{where}: member 'blesim': {reason}" for reason in reasons(fault)]
        raise VenueError("\n".join(lines)) from fault


def _parts(found: list[Any], where: str) -> _Parts:
    parts: list[Part] = []
    labels: dict[str, int] = {}
    faults: list[str] = []
    for number, feature in enumerate(found, start=1):
        try:
            parts.append(_part(feature))
            labels[_label(parts[-1])] = number
        except (VenueError, ValidationError) as fault:
            faults += [f"{where}: feature {number}{line}" for line in _lines(feature, fault)]
    if faults:
        raise VenueError("\n".join(faults))
    return _Parts(parts=parts, labels=labels)


def _lines(feature: Any, fault: VenueError | ValidationError) -> list[str]:
    """Who the feature seems to be in brackets, and each fault of it in words."""
    who = _guessed_label(feature)
    brackets = f" ({who})" if who else ""
    words = reasons(fault) if isinstance(fault, ValidationError) else [str(fault)]
    return [f"{brackets}: {reason.removeprefix(f'{who}: ')}" for reason in words]


def _part(feature: Any) -> Part:
    if not isinstance(feature, dict) or feature.get("type") != "Feature":
        raise VenueError("not a GeoJSON Feature")
    properties, geometry = feature.get("properties"), feature.get("geometry")
    if not isinstance(properties, dict) or not isinstance(geometry, dict):
        raise VenueError("a feature needs both properties and a geometry")
    kind = _kind(properties)
    if geometry.get("type") != kind.GEOMETRY:
        raise VenueError(f"needs a {kind.GEOMETRY}, not {told(geometry.get('type'))}")
    return kind.model_validate(properties).part(geometry.get("coordinates"))


def _kind(properties: Json) -> type[Feature]:
    name = properties.get("feature_type")
    if not isinstance(name, str) or name not in FEATURES:
        known = ", ".join(sorted(FEATURES))
        raise VenueError(f"feature_type {told(name)} is not known; use one of {known}")
    return FEATURES[name]


def _label(part: Part) -> str:
    """Words with which venue, floor plan and graph name a part in their messages."""
    match part:
        case Level():
            return f"level {part.level}"
        case Obstacle():
            return f"obstacle '{part.id}'"
        case Edge():
            return f"edge {part.first} - {part.second}"
        case Node() | Section() | Beacon():
            return f"{type(part).__name__.lower()} '{part.id}'"


def _guessed_label(feature: Any) -> str:
    """Label of a feature that may have faults; empty where it cannot be told."""
    properties = feature.get("properties") if isinstance(feature, dict) else None
    if not isinstance(properties, dict):
        return ""
    match properties:
        case {"feature_type": "edge", "first": first, "second": second}:
            return f"edge {shortened(str(first))} - {shortened(str(second))}"
        case {"feature_type": "level", "level": level}:
            return f"level {shortened(str(level))}"
        case {"feature_type": str(kind), "id": name}:
            return f"{_NAMES.get(kind, shortened(kind))} '{shortened(str(name))}'"
    return ""


def _refuse_detached(found: list[Any], nodes: tuple[Node, ...], where: str) -> None:
    """Raise if the line of an edge does not join its nodes: somebody moved one but not both."""
    by_id = {node.id: node for node in nodes}
    faults = [
        f"{where}: feature {number} ({_guessed_label(feature)}): its line misses node '{end}'"
        for number, feature in enumerate(found, start=1)
        if feature["properties"]["feature_type"] == "edge"
        for end, place in _ends(feature)
        if end in by_id and math.dist(place, (by_id[end].x_m, by_id[end].y_m)) > _SAME_END_M
    ]
    if faults:
        raise VenueError("\n".join(faults))


def _ends(feature: Json) -> Iterator[tuple[str, list[float]]]:
    properties = feature["properties"]
    names = (properties["first"], properties["second"])
    return zip(names, feature["geometry"]["coordinates"], strict=True)


def _venue(about: _About, parts: _Parts) -> Venue:
    nodes, edges = parts.of(Node), parts.of(Edge)
    return Venue(
        name=about.name,
        floor_plan=FloorPlan(levels=parts.of(Level), obstacles=parts.of(Obstacle)),
        beacons=parts.of(Beacon),
        graph=AisleGraph(nodes=nodes, edges=edges) if nodes or edges else None,
        sections=parts.of(Section),
        georeference=about.georeference,
    )


def _located(message: str, labels: dict[str, int]) -> str:
    """Message with the number of the feature it begins with, if it begins with one."""
    for label, number in labels.items():
        rest = message.removeprefix(label)
        if rest != message and rest[:1] in (" ", ":"):
            return f"feature {number} ({label}): {rest.lstrip(': ')}"
    return message
