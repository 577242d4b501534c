"""The floor plan of a figure: bounds, shelves and beacons in metres."""

from matplotlib.axes import Axes
from shapely import get_coordinates

from blesim.report.colours import COLOURS, FLOOR, SHELF
from blesim.report.printable import printable
from blesim.venue.floor_plan import Level
from blesim.venue.venue import Venue

# With more beacons than this their names would cover the plan.
_MOST_NAMES = 40


def draw_level(axes: Axes, venue: Venue, level: Level) -> None:
    """Draw the bounds and obstacles of one level, to scale."""
    axes.fill(*get_coordinates(level.bounds).T, facecolor=FLOOR, edgecolor="#999999", linewidth=0.8)
    for obstacle in venue.floor_plan.obstacles:
        if obstacle.level == level.level:
            axes.fill(*get_coordinates(obstacle.outline.exterior).T, facecolor=SHELF)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.spines[["top", "right"]].set_visible(False)


def draw_beacons(axes: Axes, venue: Venue) -> None:
    """Draw all beacons, with their names where they are few."""
    x_m, y_m, _ = venue.beacon_xyz_m.T
    axes.scatter(x_m, y_m, s=22, marker="^", color=COLOURS[2], zorder=4, linewidths=0)
    if len(venue.beacons) > _MOST_NAMES:
        return
    for beacon in venue.beacons:
        axes.annotate(
            printable(beacon.id),
            (beacon.x_m, beacon.y_m),
            xytext=(0, 4),
            textcoords="offset points",
            ha="center",
            fontsize=6.5,
            color="#444444",
            parse_math=False,
        )
