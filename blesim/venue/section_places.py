"""Where the product sections lie on the aisle graph: from a place to its section, and back."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from blesim.errors import VenueError
from blesim.venue.graph import SAME_PLACE_M, AisleGraph, GraphPosition, read_only
from blesim.venue.sections import Section

NO_SECTION = -1
# Between two edges laid one behind the other, so that the end of one is not the start of the next.
_GAP_M = 1.0


@dataclass(frozen=True, kw_only=True, eq=False)
class SectionPlaces:
    """Stretches of edges of each section, n of them; one that spans two edges has two.

    A section reaches over the shortest way from its start to its end along its own aisle, whatever
    the one-way signs say. Where two sections share a stretch, one on each side of the aisle, both
    have it: edge and offset do not tell the sides apart.

    Attributes
    ----------
    graph : AisleGraph
        On whose edges they lie.
    count : int
        Number of sections.
    section : ndarray of int64, (n,)
        Row of the section that each stretch belongs to, ascending.
    edge : ndarray of int64, (n,)
        Row of its edge.
    start_m, end_m : ndarray of float64, (n,)
        Where it begins and ends, counted from the first node of the edge; start before end. [m]
    """

    graph: AisleGraph
    count: int
    section: NDArray[np.int64]
    edge: NDArray[np.int64]
    start_m: NDArray[np.float64]
    end_m: NDArray[np.float64]

    @classmethod
    def of(cls, graph: AisleGraph, sections: Sequence[Section]) -> Self:
        """Places of sections that lie on the aisles of a graph.

        Parameters
        ----------
        graph : AisleGraph
            Which has an edge of each section's aisle on its level.
        sections : sequence of Section
            In the order of the venue.

        Raises
        ------
        VenueError
            If an aisle is in pieces, and a section reaches from one to another.
        """
        branches = {name: _Branch.of(graph, name) for name in {each.branch for each in sections}}
        stretches = np.array(
            [
                (row, *stretch)
                for row, section in enumerate(sections)
                for stretch in branches[section.branch].stretches(section)
            ],
            np.float64,
        ).reshape(-1, 4)
        return cls(
            graph=graph,
            count=len(sections),
            section=read_only(stretches[:, 0].astype(np.int64)),
            edge=read_only(stretches[:, 1].astype(np.int64)),
            start_m=read_only(stretches[:, 2].copy()),
            end_m=read_only(stretches[:, 3].copy()),
        )

    def at(self, edge: ArrayLike, offset_m: ArrayLike) -> NDArray[np.int64]:
        """Section at each of m places: the first of the venue's where several share the place.

        A place where one section ends and the next begins belongs to the one that lies ahead, as
        seen from the first node of the edge.

        Parameters
        ----------
        edge : array_like of int, (m,)
            Rows of edges; -1 where a place is on none.
        offset_m : array_like of float, (m,)
            Distances from their first nodes. [m]

        Returns
        -------
        ndarray of int64, (m,)
            Rows of sections; -1 where there is none.
        """
        row = np.asarray(edge, np.int64)
        on_edge = row >= 0
        found = self.piece_section[
            self.piece_at(np.where(on_edge, row, 0), np.where(on_edge, offset_m, 0.0))
        ]
        return np.where(on_edge, found, NO_SECTION)

    @cached_property
    def length_m(self) -> NDArray[np.float64]:
        """Length of each section, (sections,). [m]."""
        lengths = np.bincount(self.section, self.end_m - self.start_m, minlength=self.count)
        return read_only(lengths.astype(np.float64))

    @cached_property
    def _before_m(self) -> NDArray[np.float64]:
        """Where each edge begins when all are laid one behind the other, (edges,). [m]."""
        return np.concatenate([[0.0], np.cumsum(self.graph.length_m[:-1] + _GAP_M)])

    @cached_property
    def piece_start_m(self) -> NDArray[np.float64]:
        """Where each of p pieces begins, all edges laid one behind the other, (p,). [m].

        All edges are cut wherever a section begins or ends; what lies between is a piece.
        """
        before_m = self._before_m[self.edge]
        # The end of an edge cuts nothing: its last piece reaches over the gap behind it.
        inside = self.end_m < self.graph.length_m[self.edge] - SAME_PLACE_M
        ends_m = (before_m + self.end_m)[inside]
        cuts = np.sort(np.concatenate([self._before_m, before_m + self.start_m, ends_m]))
        distinct = np.diff(cuts, prepend=-np.inf) > SAME_PLACE_M
        return read_only(cuts[distinct])

    def piece_at(self, edge: ArrayLike, offset_m: ArrayLike) -> NDArray[np.int64]:
        """Piece at each of m places on edges, (m,), as rows of `piece_start_m`."""
        return self._piece_from(self.laid_m(edge, offset_m))

    def laid_m(self, edge: ArrayLike, offset_m: ArrayLike) -> NDArray[np.float64]:
        """Places (m,) with all edges laid one behind the other; each on its own edge. [m]."""
        row = np.asarray(edge, np.int64)
        on_edge_m = np.clip(np.asarray(offset_m, np.float64), 0.0, self.graph.length_m[row])
        laid_m: NDArray[np.float64] = self._before_m[row] + on_edge_m
        return laid_m

    def _piece_from(self, laid_m: NDArray[Any]) -> NDArray[np.int64]:
        # Cuts closer than this to another were taken for the same place.
        rows = np.searchsorted(self.piece_start_m, laid_m + SAME_PLACE_M, side="right") - 1
        return rows.astype(np.int64)

    @cached_property
    def memberships(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Pairs of piece and section that has it, two arrays (pairs,), ordered by section."""
        first = self._piece_from(self._before_m[self.edge] + self.start_m)
        after = self._piece_from(self._before_m[self.edge] + self.end_m - 2 * SAME_PLACE_M) + 1
        spans = after - first
        step = np.arange(spans.sum()) - np.repeat(np.cumsum(spans) - spans, spans)
        return read_only(np.repeat(first, spans) + step), read_only(np.repeat(self.section, spans))

    @cached_property
    def piece_section(self) -> NDArray[np.int64]:
        """First section that has each piece, (p,); -1 where none has."""
        found = np.full(len(self.piece_start_m), self.count, np.int64)
        np.minimum.at(found, *self.memberships)
        return read_only(np.where(found < self.count, found, NO_SECTION))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Branch:
    """One aisle by itself, walked either way; `rows` are its edges in the whole graph."""

    name: str
    graph: AisleGraph
    rows: tuple[int, ...]

    @classmethod
    def of(cls, graph: AisleGraph, name: str) -> Self:
        rows = tuple(row for row, edge in enumerate(graph.edges) if edge.branch == name)
        if not rows:
            raise VenueError(f"no edge of the aisle graph belongs to aisle '{name}'")
        edges = tuple(replace(graph.edges[row], one_way=False) for row in rows)
        ends = {end for edge in edges for end in (edge.first, edge.second)}
        nodes = tuple(node for node in graph.nodes if node.id in ends)
        return cls(name=name, graph=AisleGraph(nodes=nodes, edges=edges), rows=rows)

    def stretches(self, section: Section) -> Iterator[tuple[int, float, float]]:
        """Edge, start and end [m] of each stretch of a section."""
        x_m, y_m = zip(section.start_m, section.end_m, strict=True)
        edges, offsets_m, _ = self.graph.nearest(x_m, y_m, [section.level] * 2)
        start, end = map(GraphPosition, edges.tolist(), offsets_m.tolist())
        try:
            legs = self.graph.route(start, end)
        except VenueError as fault:
            raise VenueError(
                f"section '{section.id}' reaches from one piece of aisle '{self.name}' to another:"
                f" {fault}"
            ) from fault
        for leg in legs:
            yield self.rows[leg.edge], min(leg.start_m, leg.end_m), max(leg.start_m, leg.end_m)
