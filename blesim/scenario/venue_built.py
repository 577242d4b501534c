"""The venue of a scenario: as built, and as the installer wrote it down."""

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType

import numpy as np
import shapely
from shapely.ops import nearest_points

from blesim.errors import BlesimError, ScenarioError
from blesim.rng import Draws
from blesim.scenario.reading import ScenarioFile
from blesim.scenario.venue_source import LayoutName, VenueSource
from blesim.venue.beacons import Beacon
from blesim.venue.geojson import from_geojson
from blesim.venue.layouts import wholesale_section, wholesale_store
from blesim.venue.sites.campus_corridor import campus_corridor, campus_corridor_keys
from blesim.venue.sites.h_floor import h_floor
from blesim.venue.sites.office import office_dense, office_sparse
from blesim.venue.sites.two_pair_room import two_pair_room
from blesim.venue.venue import Venue

LAYOUTS: Mapping[LayoutName, Callable[[], Venue]] = MappingProxyType(
    {
        "wholesale-section": wholesale_section,
        "wholesale-store": wholesale_store,
        "room-two-pairs": two_pair_room,
        "campus-corridor": campus_corridor,
        "campus-corridor-15": partial(campus_corridor, 15),
        "campus-corridor-10": partial(campus_corridor, 10),
        "campus-corridor-keys": campus_corridor_keys,
        "office-dense": office_dense,
        "office-sparse": office_sparse,
        "h-floor": h_floor,
    }
)


def built_venue(file: ScenarioFile) -> Venue:
    """The venue as built.

    Raises
    ------
    ScenarioError
        If its map cannot be read.
    """
    source = file.scenario.venue
    if source.layout is not None:
        return LAYOUTS[source.layout]()
    map_path = file.path.parent / str(source.map)
    try:
        return from_geojson(map_path.read_text(encoding="utf-8-sig"), str(map_path))
    except OSError as error:
        reason = f"{map_path}: {error.strerror}"
    except UnicodeDecodeError as error:
        reason = f"{map_path}: not UTF-8 text at byte {error.start}"
    except BlesimError as error:
        reason = str(error)
    raise ScenarioError(
        "\n".join(file.fault(["venue", "map"], line) for line in reason.split("\n"))
    )


def surveyed_venue(built: Venue, source: VenueSource, seed: int) -> Venue:
    """The venue as the installer knows it: beacons where believed to be, gains unknown."""
    return built.with_beacons(
        tuple(_written_down(beacon, built, source.survey_error_m, seed) for beacon in built.beacons)
    )


def _written_down(beacon: Beacon, built: Venue, error_m: float, seed: int) -> Beacon:
    """The beacon as the installer knows it: without what only its hardware knows."""
    unknown = {"channel_gain_db": Beacon.model_fields["channel_gain_db"].default}
    place = _believed_place(beacon, built, error_m, seed) if error_m > 0 else {}
    return beacon.model_copy(update=unknown | place)


def _believed_place(beacon: Beacon, built: Venue, error_m: float, seed: int) -> dict[str, float]:
    """Where the installer believes the beacon to be: off, but never inside a shelf or wall."""
    free = built.floor_plan.walkable[beacon.level]
    if free.is_empty:
        return {}
    draws = Draws(seed=seed, purpose="survey error", beacon=beacon.id)
    east_m, north_m = error_m * draws.normals(np.zeros(1, int))[0, :2]
    believed = shapely.Point(beacon.x_m + east_m, beacon.y_m + north_m)
    nearest, _ = nearest_points(free, believed)
    return {"x_m": round(nearest.x, 6), "y_m": round(nearest.y, 6)}
