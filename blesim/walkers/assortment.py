"""The sections of a store as shoppers know them: where to stand, how far apart, how popular."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from blesim.errors import UsageError
from blesim.rng import Draws
from blesim.venue.graph import GraphPosition, read_only
from blesim.venue.sections import Section
from blesim.venue.venue import Venue
from blesim.walkers.clearance import EITHER, LEFT, NEITHER, shelf_sides
from blesim.walkers.trading_day import Popularity
from blesim.walkers.trip import Ground
from blesim.walkers.visiting_order import nearest_next

# Places along a section where somebody may stand.
SPOTS = 8
# People stand up to so much further from the shelf than they could; assumed.
_STANDOFF_M = 0.4


@dataclass(frozen=True, kw_only=True, eq=False)
class Assortment:
    """All sections of a venue.

    Attributes
    ----------
    ground : Ground
        Where they are.
    sections : tuple of Section
        In the order of the venue.
    edge : ndarray of int64, (sections, SPOTS)
        Edge of each place to stand.
    offset_m : ndarray of float64, (sections, SPOTS)
        Its offset. [m]
    left : ndarray of float64, (sections, 2)
        Unit vector to the left, seen along the section. [-]
    sides : ndarray of int64, (sections,)
        Where the shelf is; see `clearance.shelf_sides`.
    """

    ground: Ground
    sections: tuple[Section, ...]
    edge: NDArray[np.int64]
    offset_m: NDArray[np.float64]
    left: NDArray[np.float64]
    sides: NDArray[np.int64]

    @classmethod
    def of(cls, venue: Venue, ground: Ground) -> Self:
        """Sections of a venue.

        Raises
        ------
        UsageError
            If it has none.
        """
        if not venue.sections:
            raise UsageError(f"venue '{venue.name}' has no product section to shop at")
        start = np.array([section.start_m for section in venue.sections])
        along = np.array([section.end_m for section in venue.sections]) - start
        shares = (np.arange(SPOTS) + 0.5) / SPOTS
        xy_m = (start[:, None, :] + shares[None, :, None] * along[:, None, :]).reshape(-1, 2)
        levels = np.repeat([section.level for section in venue.sections], SPOTS)
        edge, offset_m, _ = ground.graph.nearest(xy_m[:, 0], xy_m[:, 1], levels)
        length_m = np.maximum(np.sqrt((along**2).sum(axis=1)), 1e-9)
        return cls(
            ground=ground,
            sections=venue.sections,
            edge=read_only(edge.reshape(-1, SPOTS)),
            offset_m=read_only(np.round(offset_m, 6).reshape(-1, SPOTS)),
            left=read_only(np.stack([-along[:, 1], along[:, 0]], axis=1) / length_m[:, None]),
            sides=read_only(shelf_sides(venue)),
        )

    @cached_property
    def row(self) -> Mapping[str, int]:
        """Row of each section by its id."""
        return {section.id: row for row, section in enumerate(self.sections)}

    @property
    def _middle(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        return self.edge[:, SPOTS // 2], self.offset_m[:, SPOTS // 2]

    @cached_property
    def between_m(self) -> NDArray[np.float64]:
        """Way from each section to each other, (sections, sections). [m]."""
        edge, offset_m = self._middle
        lengths = self.ground.routes.length_m(
            edge[:, None], offset_m[:, None], edge[None, :], offset_m[None, :]
        )
        return read_only(np.round(lengths, 6))

    def from_place_m(self, place: GraphPosition) -> NDArray[np.float64]:
        """Way from a place to each section, (sections,). [m]."""
        edge, offset_m = self._middle
        here, here_m = np.array(place.edge), np.array(place.offset_m)
        return np.round(self.ground.routes.length_m(here, here_m, edge, offset_m), 6)

    def to_place_m(self, place: GraphPosition) -> NDArray[np.float64]:
        """Way from each section to a place, (sections,). [m]."""
        edge, offset_m = self._middle
        there, there_m = np.array(place.edge), np.array(place.offset_m)
        return np.round(self.ground.routes.length_m(edge, offset_m, there, there_m), 6)

    def circuit(self, start: GraphPosition) -> NDArray[np.int64]:
        """All sections in the order of one walk past them, (sections,)."""
        everything = np.arange(len(self.sections))
        return nearest_next(everything, self.from_place_m(start), self.between_m)

    @cached_property
    def gates(self) -> NDArray[np.int64]:
        """Middle section of each aisle that has any, (aisles,)."""
        aisles: dict[str, list[int]] = {}
        for row, section in enumerate(self.sections):
            aisles.setdefault(section.branch, []).append(row)
        return np.array([rows[len(rows) // 2] for rows in aisles.values()], np.int64)

    @cached_property
    def neighbours(self) -> NDArray[np.int64]:
        """The sections nearest to each, nearest first, (sections, up to 8)."""
        apart_m = self.between_m.copy()
        np.fill_diagonal(apart_m, np.inf)
        most = min(8, len(self.sections) - 1)
        return np.argsort(apart_m, axis=1, kind="stable")[:, :most]

    def weights(self, popularity: Popularity, seed: int) -> NDArray[np.float64]:
        """How popular each section is, (sections,). [-]."""
        count = len(self.sections)
        if popularity.kind == "categories":
            named = popularity.weights
            return np.array([named.get(section.category, 1.0) for section in self.sections])
        if popularity.kind == "zipf":
            keys = Draws(seed=seed, purpose="popularity").uniforms(np.arange(count))[:, 0]
            rank = np.argsort(np.argsort(keys, kind="stable"), kind="stable") + 1
            return np.asarray(rank ** -float(popularity.exponent))
        return np.ones(count)

    def standing(
        self,
        section: NDArray[np.int64],
        spot: NDArray[np.int64],
        side_draw: NDArray[np.float64],
        standoff_draw: NDArray[np.float64],
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Displacement towards the shelf and heading to it, of people at sections.

        Parameters
        ----------
        section, spot : ndarray of int64, (n,)
            Where.
        side_draw, standoff_draw : ndarray of float64, (n,)
            U(0, 1): which side, where both have a shelf, and how close to it. [-]

        Returns
        -------
        aside_m : ndarray of float64, (n, 2)
            NaN where no shelf is known. [m]
        facing_rad : ndarray of float64, (n,)
            NaN where no shelf is known. [rad]
        """
        sides = self.sides[section]
        to_left = np.where(sides == EITHER, side_draw < 0.5, sides == LEFT)
        towards = np.where(to_left, 1.0, -1.0)[:, None] * self.left[section]
        room_m = self.ground.clearance.edge_m[self.edge[section, spot]]
        away_m = np.maximum(room_m - _STANDOFF_M * standoff_draw, 0.0)
        unknown = sides == NEITHER
        facing_rad = np.round(np.arctan2(towards[:, 1], towards[:, 0]), 9)
        aside_m = np.trunc(away_m[:, None] * towards * 1e6) / 1e6
        aside_m[unknown] = np.nan
        return aside_m, np.where(unknown, np.nan, facing_rad)
