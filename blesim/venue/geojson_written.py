"""The parts of a venue as GeoJSON features; `geojson_features` is the way back."""

from collections.abc import Iterator
from typing import Any

import shapely

from blesim.venue.beacons import Beacon
from blesim.venue.floor_plan import FLOOR_TO_CEILING_M, Level, Obstacle
from blesim.venue.geojson_features import FEATURES, Json
from blesim.venue.graph import AisleGraph, Edge, Node
from blesim.venue.sections import Section
from blesim.venue.venue import Venue

# Written down only where they are something else than usual.
_SELDOM = ("payload", "packet_spacing_us", "facing_deg", "front_to_back_db")


def features(venue: Venue) -> Iterator[Json]:
    """GeoJSON features of all parts of a venue, each kind in its own order."""
    yield from map(_level, venue.floor_plan.levels)
    yield from map(_fixture, venue.floor_plan.obstacles)
    if venue.graph is not None:
        yield from map(_node, venue.graph.nodes)
        yield from (_edge(edge, venue.graph) for edge in venue.graph.edges)
    yield from map(_section, venue.sections)
    yield from map(_beacon, venue.beacons)


def _feature(feature_type: str, coordinates: list[Any], **properties: Any) -> Json:
    return {
        "type": "Feature",
        "properties": {"feature_type": feature_type, **properties},
        "geometry": {"type": FEATURES[feature_type].GEOMETRY, "coordinates": coordinates},
    }


def _level(level: Level) -> Json:
    return _feature("level", _rings(level.bounds), level=level.level)


def _fixture(obstacle: Obstacle) -> Json:
    tall = obstacle.height_m == FLOOR_TO_CEILING_M
    return _feature(
        "fixture",
        _rings(obstacle.outline),
        id=obstacle.id,
        material=obstacle.material,
        level=obstacle.level,
        **({} if tall else {"height_m": float(obstacle.height_m)}),
    )


def _node(node: Node) -> Json:
    return _feature("node", [float(node.x_m), float(node.y_m)], id=node.id, level=node.level)


def _edge(edge: Edge, graph: AisleGraph) -> Json:
    ends = [graph.nodes[graph.node_row[end]] for end in (edge.first, edge.second)]
    return _feature(
        "edge",
        [[float(node.x_m), float(node.y_m)] for node in ends],
        first=edge.first,
        second=edge.second,
        branch=edge.branch,
        one_way=edge.one_way,
    )


def _section(section: Section) -> Json:
    ends = [[float(x_m), float(y_m)] for x_m, y_m in (section.start_m, section.end_m)]
    return _feature(
        "section",
        ends,
        id=section.id,
        category=section.category,
        branch=section.branch,
        level=section.level,
    )


def _beacon(beacon: Beacon) -> Json:
    place = [float(beacon.x_m), float(beacon.y_m), float(beacon.z_m)]
    own = beacon.model_dump(mode="json", exclude={"x_m", "y_m", "z_m"})
    usual = {name for name in _SELDOM if own[name] == Beacon.model_fields[name].default}
    told = {name: value for name, value in own.items() if name not in usual}
    return _feature("amenity", place, category="beacon", **told)


def _rings(polygon: shapely.Polygon) -> list[Any]:
    rings = [polygon.exterior, *polygon.interiors]
    return [shapely.get_coordinates(ring).tolist() for ring in rings]
