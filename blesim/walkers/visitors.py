"""Who comes to the store, when, and what they mean to do there: planned before anybody walks."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

from blesim.rng import Draws, normals_of
from blesim.units import to_us
from blesim.venue.graph import GraphPosition
from blesim.venue.venue import Venue
from blesim.walkers.arrivals import arrival_times_us, group_sizes
from blesim.walkers.assortment import SPOTS, Assortment
from blesim.walkers.shopping import basket_size, drawn_sections, times_us, with_detours
from blesim.walkers.trading_day import CarryingShares, RecordedRoute, Spread, TradingDay
from blesim.walkers.trip import Ground, Mover, Places, Plan, planned
from blesim.walkers.visiting_order import along_circuit, nearest_next

NO_SECTION = -1
NO_SWITCH = -1
_SLOWEST_M_S = 0.2
_TROLLEY = 5
_MOST_TASKS = 1000
Role = Literal["shopper", "staff"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Errand:
    """What a party means to do, stop by stop.

    Attributes
    ----------
    section : ndarray of int64, (n,)
        Rows of sections, `NO_SECTION` for a node.
    edge : ndarray of int64, (n,)
        Edge of each place.
    offset_m : ndarray of float64, (n,)
        Offset of each place. [m]
    stops : ndarray of bool, (n,)
        Whether they stop there.
    wait_us : ndarray of int64, (n,)
        How long, and below zero until when: the negative of that time. [us]
    """

    section: NDArray[np.int64]
    edge: NDArray[np.int64]
    offset_m: NDArray[np.float64]
    stops: NDArray[np.bool_]
    wait_us: NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Visitor:
    """Somebody who will come.

    Attributes
    ----------
    name, role, group : str
        The group is that of its first member; empty for somebody alone.
    comes_us : int
        When the visitor is at the door. [us]
    leave_by_us : int
        When the visitor breaks off and goes. [us]
    mover : Mover
        How the visitor moves.
    plan : Plan
        From the entrance to the end of the list.
    section, wait_us : ndarray of int64, (places,)
        Of each place of the plan; see `Errand`.
    service_us : int
        How long paying takes. [us]
    carrying : int
        How the phone is carried at first; a value of `columns.CARRYINGS`.
    switched : ndarray of int64, (places,)
        How it is carried from each place on; `NO_SWITCH` for as before.
    lanes : ndarray of uint64, (4,)
        Address of the draws of lanes.
    """

    name: str
    role: Role
    group: str
    comes_us: int
    leave_by_us: int
    mover: Mover
    plan: Plan
    section: NDArray[np.int64]
    wait_us: NDArray[np.int64]
    service_us: int
    carrying: int
    switched: NDArray[np.int64]
    lanes: NDArray[np.uint64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Planner:
    """Everything that planning visitors needs: the day, the store, and the seed."""

    day: TradingDay
    venue: Venue
    assortment: Assortment
    seed: int

    @classmethod
    def of(cls, venue: Venue, day: TradingDay, ground: Ground, seed: int) -> Self:
        """Planning for a day in a venue."""
        return cls(day=day, venue=venue, assortment=Assortment.of(venue, ground), seed=seed)

    @cached_property
    def entrance(self) -> GraphPosition:
        """Place of the entrance."""
        return self.assortment.ground.graph.at_node(self.day.entrance)

    @cached_property
    def _from_entrance_m(self) -> NDArray[np.float64]:
        return self.assortment.from_place_m(self.entrance)

    @cached_property
    def _weights(self) -> NDArray[np.float64]:
        return self.assortment.weights(self.day.basket.popularity, self.seed)

    @cached_property
    def _circuit(self) -> NDArray[np.int64]:
        return self.assortment.circuit(self.entrance)

    def visitors(self) -> Iterator[Visitor]:
        """Shoppers in order of arrival, shoppers whose routes are replayed, staff."""
        number = 0
        arrivals = arrival_times_us(self.day, self.seed)
        sizes = group_sizes(self.day, len(arrivals), self.seed)
        for row, (comes_us, size) in enumerate(zip(arrivals.tolist(), sizes.tolist(), strict=True)):
            names = [f"shopper-{number + member + 1:04d}" for member in range(size)]
            number += size
            yield from self._party(names, comes_us, self._errand(row, names[0]))
        for route in self.day.routes:
            comes_us = to_us(route.points[0].time_s)
            yield from self._party([f"replayed-{route.shopper}"], comes_us, self._replayed(route))
        for row in range(self.day.staff.number):
            yield self._employee(row)

    def _errand(self, row: int, leader: str) -> Errand:
        """What the party that comes as number `row` wants."""
        wanted = self._wanted(row, leader)
        stops = np.ones(len(wanted), np.bool_)
        if self.day.order == "nearest-next":
            wanted = nearest_next(wanted, self._from_entrance_m, self.assortment.between_m)
        elif self.day.order == "circuit":
            wanted, stops = along_circuit(wanted, self._circuit, self.assortment.gates)
        whims = Draws(seed=self.seed, purpose="detour", walker=leader).uniforms(
            np.arange(len(wanted))
        )
        wanted, stops = with_detours(
            wanted, stops, self.assortment.neighbours, self.day.detours, whims
        )
        return self._at_sections(wanted, stops, self.day.dwell, leader)

    def _wanted(self, row: int, leader: str) -> NDArray[np.int64]:
        if self.day.lists:
            dealt = self.day.lists[row % len(self.day.lists)]
            rows = dict.fromkeys(self.assortment.row[name] for name in dealt.sections)
            return np.array(list(rows), np.int64)
        normal = float(self._once(leader, "normal")[0])
        size = basket_size(self.day.basket, normal, len(self.assortment.sections))
        return drawn_sections(size, self._weights, self.seed, leader)

    def _once(self, name: str, kind: Literal["uniform", "normal"]) -> NDArray[np.float64]:
        """Four numbers that a person draws once."""
        draws = Draws(seed=self.seed, purpose="shopper", walker=name).uniforms(np.zeros(1, int))[0]
        return normals_of(draws) if kind == "normal" else draws

    def _at_sections(
        self, sections: NDArray[np.int64], stops: NDArray[np.bool_], time: Spread, leader: str
    ) -> Errand:
        draws = Draws(seed=self.seed, purpose="stop", walker=leader).uniforms(
            np.arange(len(sections))
        )
        spot = np.minimum((draws[:, 1] * SPOTS).astype(np.int64), SPOTS - 1)
        return Errand(
            section=sections,
            edge=self.assortment.edge[sections, spot],
            offset_m=self.assortment.offset_m[sections, spot],
            stops=stops,
            wait_us=np.where(stops, times_us(time, draws[:, 0]), 0),
        )

    def _replayed(self, route: RecordedRoute) -> Errand:
        graph, row = self.assortment.ground.graph, self.assortment.row
        sections = [row.get(point.place, NO_SECTION) for point in route.points]
        places = [
            graph.at_node(point.place)
            if section == NO_SECTION
            else GraphPosition(
                int(self.assortment.edge[section, SPOTS // 2]),
                float(self.assortment.offset_m[section, SPOTS // 2]),
            )
            for point, section in zip(route.points, sections, strict=True)
        ]
        return Errand(
            section=np.array(sections, np.int64),
            edge=np.array([place.edge for place in places], np.int64),
            offset_m=np.array([place.offset_m for place in places]),
            stops=np.ones(len(places), np.bool_),
            wait_us=-np.array([to_us(point.time_s) for point in route.points], np.int64),
        )

    def _party(self, names: list[str], comes_us: int, errand: Errand) -> Iterator[Visitor]:
        """Members of a party: one list, one pace, each at their own side."""
        day, pace = self.day, self.day.pace
        carried = [_chosen(day.carrying, float(self._once(name, "uniform")[2])) for name in names]
        wishes = [float(self._once(name, "normal")[1]) for name in names]
        rates = (pace.acceleration_m_s2, pace.trolley_acceleration_m_s2)
        mover = Mover(
            speed_m_s=_speed_m_s(pace.mean_m_s, pace.spread_m_s, min(wishes)),
            rate_m_s2=min(rates[carrying == _TROLLEY] for carrying in carried),
            turn_rate_rad_s=self._turn_rate_rad_s,
        )
        for name, carrying in zip(names, carried, strict=True):
            if name != names[0]:
                delay = self._once(f"{name} after the one before", "uniform")[0]
                comes_us += int((0.5 + delay) * 1e6)
            yield self._visitor(
                name=name,
                role="shopper",
                errand=errand,
                party=names,
                stay_us=(comes_us, day.open_us),
                mover=mover,
                carrying=carrying,
                shares=day.carrying,
            )

    def _employee(self, row: int) -> Visitor:
        staff, day = self.day.staff, self.day
        name = f"staff-{row + 1:02d}"
        shift_us = min(to_us(staff.shift_h * 3600.0), day.open_us)
        begins_us = 0 if row % 2 == 0 else day.open_us - shift_us
        uniforms, normals = self._once(name, "uniform"), self._once(name, "normal")
        tasks = min(int(2.0 * shift_us * 1e-6 / staff.restock.median_s) + 5, _MOST_TASKS)
        draws = Draws(seed=self.seed, purpose="task", walker=name).uniforms(np.arange(tasks))
        sections = (draws[:, 0] * len(self.assortment.sections)).astype(np.int64)
        errand = self._at_sections(sections, np.ones(tasks, np.bool_), staff.restock, name)
        mover = Mover(
            speed_m_s=_speed_m_s(staff.mean_m_s, staff.spread_m_s, float(normals[1])),
            rate_m_s2=day.pace.acceleration_m_s2,
            turn_rate_rad_s=self._turn_rate_rad_s,
        )
        return self._visitor(
            name=name,
            role="staff",
            errand=errand,
            party=[name],
            stay_us=(begins_us, begins_us + shift_us),
            mover=mover,
            carrying=_chosen(staff.carrying, float(uniforms[2])),
            shares=staff.carrying,
        )

    @property
    def _turn_rate_rad_s(self) -> float:
        return round(float(np.radians(self.day.pace.turn_rate_deg_s)), 9)

    def _visitor(
        self,
        *,
        name: str,
        role: Role,
        errand: Errand,
        party: list[str],
        stay_us: tuple[int, int],
        mover: Mover,
        carrying: int,
        shares: CarryingShares,
    ) -> Visitor:
        lanes = Draws(seed=self.seed, purpose="lane", walker=name).address()
        places = self._places(errand, party[0], name)
        service = self._once(name, "uniform")[3:4]
        return Visitor(
            name=name,
            role=role,
            group=party[0] if len(party) > 1 else "",
            comes_us=stay_us[0],
            leave_by_us=stay_us[1],
            mover=mover,
            plan=planned(self.assortment.ground, places, lanes, mover),
            section=np.concatenate([[NO_SECTION], errand.section]),
            wait_us=np.concatenate([[0], errand.wait_us]),
            service_us=int(times_us(self.day.tills.service, service)[0]),
            carrying=carrying,
            switched=self._switched(errand, name, carrying, shares),
            lanes=lanes,
        )

    def _places(self, errand: Errand, leader: str, name: str) -> Places:
        """Entrance and stops; members of a party stand side by side along the same shelf."""
        rows = np.arange(len(errand.section))
        leads = Draws(seed=self.seed, purpose="stop", walker=leader).uniforms(rows)
        own = Draws(seed=self.seed, purpose="standoff", walker=name).uniforms(rows)
        sections = np.maximum(errand.section, 0)
        edge, offset_m = errand.edge, errand.offset_m
        if name != leader:
            moved = np.minimum((own[:, 2] * SPOTS).astype(np.int64), SPOTS - 1)
            edge = self.assortment.edge[sections, moved]
            offset_m = self.assortment.offset_m[sections, moved]
        at_shelf = errand.section != NO_SECTION
        aside_m, facing_rad = self.assortment.standing(
            sections, np.zeros(len(sections), np.int64), leads[:, 2], own[:, 1]
        )
        aside_m[~at_shelf] = np.nan
        return Places(
            edge=np.concatenate([[self.entrance.edge], edge]),
            offset_m=np.concatenate([[self.entrance.offset_m], offset_m]),
            rests=np.concatenate([[True], errand.stops]),
            aside_m=np.concatenate([[[np.nan, np.nan]], aside_m]),
            facing_rad=np.concatenate([[np.nan], np.where(at_shelf, facing_rad, np.nan)]),
        )

    def _switched(
        self, errand: Errand, name: str, carrying: int, shares: CarryingShares
    ) -> NDArray[np.int64]:
        rows = np.arange(len(errand.section))
        draws = Draws(seed=self.seed, purpose="carrying", walker=name).uniforms(rows)
        switched = np.full(len(rows) + 1, NO_SWITCH)
        for row in np.flatnonzero(errand.stops & (draws[:, 0] < shares.switch_probability)):
            new = _chosen(shares, float(draws[row, 1]))
            # Only who has a trolley can put the phone into it.
            if new != _TROLLEY or carrying == _TROLLEY:
                switched[row + 1] = new
        return switched


def _speed_m_s(mean_m_s: float, spread_m_s: float, normal: float) -> float:
    speed_m_s = mean_m_s + spread_m_s * min(max(normal, -3.0), 3.0)
    return round(max(speed_m_s, _SLOWEST_M_S), 6)


def _chosen(shares: CarryingShares, uniform: float) -> int:
    """Value of `columns.CARRYINGS` that a U(0, 1) number stands for."""
    weights = shares.weights()
    left = uniform * sum(weights)
    for value, weight in enumerate(weights):
        left -= weight
        if left < 0.0 and weight > 0.0:
            return value
    return max(value for value, weight in enumerate(weights) if weight > 0.0)
