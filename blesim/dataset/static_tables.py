"""The small tables of a recording, column by column: aisle graph, beacons, walks."""

from collections.abc import Sequence
from typing import Any

from blesim import columns
from blesim.columns import Stream
from blesim.recording import Person, Walk
from blesim.venue.beacons import Beacon
from blesim.venue.graph import AisleGraph
from blesim.venue.venue import Venue

Values = list[list[Any]]


def venue_tables(venue: Venue) -> list[tuple[Stream, Values]]:
    """Tables that repeat the surveyed map for programs that read no GeoJSON."""
    beacons = (columns.BEACONS, _beacons(venue.beacons))
    if venue.graph is None:
        return [beacons]
    return [
        (columns.NODES, _fields(columns.NODES, venue.graph.nodes)),
        (columns.EDGES, _edges(venue.graph)),
        beacons,
    ]


def walk_values(walks: Sequence[Walk]) -> Values:
    """Columns of ``/walks``; observations are not looked at."""
    return [[walk.name for walk in walks], *_fields(columns.WALKS, walks, first=1)]


def people_values(people: Sequence[Person]) -> Values:
    """Columns of ``/truth/people``."""
    return [
        [person.name for person in people],
        [int(person.role) for person in people],
        [person.group for person in people],
    ]


def _fields(stream: Stream, rows: Sequence[object], first: int = 0) -> Values:
    fields = [column.field for column in stream.columns[first:]]
    return [[getattr(row, field) for row in rows] for field in fields]


def _beacons(beacons: Sequence[Beacon]) -> Values:
    names, _, *numbers = _fields(columns.BEACONS, beacons)
    return [names, [str(beacon.uuid) for beacon in beacons], *numbers]


def _edges(graph: AisleGraph) -> Values:
    branches, one_way = zip(*[(edge.branch, edge.one_way) for edge in graph.edges], strict=True)
    return [*graph.ends.T.tolist(), list(branches), [int(flag) for flag in one_way]]
