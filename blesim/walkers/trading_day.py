"""What a trading day is made of, as a user writes it down."""

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from blesim import columns
from blesim.settings import Name, Settings
from blesim.units import MICROSECONDS_PER_SECOND
from blesim.walkers.gait import Gait

Clock = Annotated[str, Field(pattern=r"^([01]\d|2[0-3]):[0-5]\d$|^24:00$")]
Share = Annotated[float, Field(ge=0, le=1)]
_DAY_S = 86400
MOST_SECTIONS = 1000
MOST_POINTS = 10_000


def clock_s(clock: Clock) -> int:
    """Seconds from midnight until a clock time such as ``"08:30"``. [s]."""
    hours, minutes = clock.split(":")
    return 3600 * int(hours) + 60 * int(minutes)


class ArrivalRate(Settings):
    """How many arrive from a clock time until the next, relative to the other times. [-]."""

    since: Clock
    weight: float = Field(ge=0, le=1000)


# A quiet opening, a peak before noon and a higher one after work; assumed.
_TWO_PEAKS = (
    ("00:00", 0.4),
    ("09:00", 0.8),
    ("10:00", 1.2),
    ("12:00", 1.0),
    ("14:00", 0.8),
    ("16:00", 1.3),
    ("18:00", 1.1),
    ("19:00", 0.6),
)


class Spread(Settings):
    """A log-normal time: half are shorter than the median.

    Attributes
    ----------
    median_s : float
        [s]
    spread : float
        Standard deviation of its logarithm. [-]
    """

    median_s: float = Field(default=20.0, gt=0, le=_DAY_S)
    spread: float = Field(default=0.6, ge=0, le=3)


class Tills(Settings):
    """Where people pay.

    Attributes
    ----------
    nodes : tuple of str
        Nodes of the aisle graph, one a till.
    servers : int
        How many are served at each at a time.
    service : Spread
        How long paying takes; assumed.
    """

    nodes: tuple[Name, ...] = Field(min_length=1, max_length=200)
    servers: int = Field(default=1, ge=1, le=100)
    service: Spread = Spread(median_s=60.0, spread=0.5)


class Popularity(Settings):
    """How often each section is on a list.

    Attributes
    ----------
    kind : str
        ``uniform``; ``categories``: by `weights`; ``zipf``: the k-th most popular section
        proportional to ``k ** -exponent``, the ranks being drawn.
    weights : dict of str to float
        Relative popularity of categories; 1 for those not named. [-]
    exponent : float
        [-]
    """

    kind: Literal["uniform", "categories", "zipf"] = "uniform"
    weights: dict[Name, Annotated[float, Field(ge=0, le=1000)]] = Field(default_factory=dict)
    exponent: float = Field(default=0.8, ge=0, le=4)


class Basket(Settings):
    """How many sections a shopper looks for, log-normal and at least one; assumed.

    Attributes
    ----------
    mean, spread : float
        Mean and standard deviation of the number of sections. [-]
    popularity : Popularity
        Which sections.
    """

    mean: float = Field(default=15.0, ge=1, le=500)
    spread: float = Field(default=8.0, ge=0, le=500)
    popularity: Popularity = Popularity()


class ShoppingList(Settings):
    """Sections that one shopper looks for, by id, in the order of the list."""

    shopper: Name
    sections: tuple[Name, ...] = Field(min_length=1, max_length=MOST_SECTIONS)


class RoutePoint(Settings):
    """A node or section of a recorded route, and when the shopper left it at the earliest. [s]."""

    place: Name
    time_s: float = Field(ge=0, le=_DAY_S)


class RecordedRoute(Settings):
    """Where a shopper was seen, in order of time since opening."""

    shopper: Name
    points: tuple[RoutePoint, ...] = Field(min_length=1, max_length=MOST_POINTS)

    @model_validator(mode="after")
    def _in_order(self) -> "RecordedRoute":
        if any(b.time_s < a.time_s for a, b in pairwise(self.points)):
            raise ValueError(f"route of '{self.shopper}': times go backwards; sort them")
        return self


class Detours(Settings):
    """Ways nobody planned; assumed.

    Attributes
    ----------
    probability : float
        That a shopper walks past some other section before the next of the list. [-]
    impulse_probability : float
        That a shopper stops at a neighbouring section too. [-]
    """

    probability: Share = 0.05
    impulse_probability: Share = 0.1


class Pace(Settings):
    """How fast people want to walk, and how fast they get there.

    Attributes
    ----------
    mean_m_s, spread_m_s : float
        Desired speed, normal, cut off at three standard deviations; 0.6 to 1.1 m/s in aisles,
        assumed. [m/s]
    acceleration_m_s2 : float
        Speeding up and slowing down; assumed. [m/s2]
    trolley_acceleration_m_s2 : float
        The same with a trolley; assumed. [m/s2]
    turn_rate_deg_s : float
        Turning on the spot; assumed. [degree/s]
    """

    mean_m_s: float = Field(default=0.85, ge=0.2, le=3)
    spread_m_s: float = Field(default=0.1, ge=0, le=0.5)
    acceleration_m_s2: float = Field(default=0.8, ge=0.1, le=10)
    trolley_acceleration_m_s2: float = Field(default=0.4, ge=0.1, le=10)
    turn_rate_deg_s: float = Field(default=150.0, ge=10, le=3600)


class CarryingShares(Settings):
    """How phones are carried, relative to each other, and how often that changes; assumed.

    Attributes
    ----------
    hand, flat, swinging, pocket, bag, trolley : float
        Relative numbers of phones. [-]
    switch_probability : float
        That a shopper carries the phone otherwise from a stop on. [-]
    """

    hand: float = Field(default=0.15, ge=0, le=1000)
    flat: float = Field(default=0.05, ge=0, le=1000)
    swinging: float = Field(default=0.1, ge=0, le=1000)
    pocket: float = Field(default=0.35, ge=0, le=1000)
    bag: float = Field(default=0.25, ge=0, le=1000)
    trolley: float = Field(default=0.1, ge=0, le=1000)
    switch_probability: Share = 0.05

    @model_validator(mode="after")
    def _somewhere(self) -> "CarryingShares":
        if not any(self.weights()):
            raise ValueError("every share is 0; give one way of carrying a share")
        return self

    def weights(self) -> list[float]:
        """Shares in the order of `columns.CARRYINGS`. [-]."""
        return [float(getattr(self, name)) for name, _ in columns.CARRYINGS]


class Staff(Settings):
    """Who restocks; every other starts at opening, the rest stays until closing. All assumed.

    Attributes
    ----------
    number : int
        How many over the day.
    shift_h : float
        How long each stays, within the opening hours. [h]
    restock : Spread
        How long a section takes.
    mean_m_s, spread_m_s : float
        Desired speed. [m/s]
    carrying : CarryingShares
        How their phones are carried.
    """

    number: int = Field(default=8, ge=0, le=1000)
    shift_h: float = Field(default=6.0, gt=0, le=24)
    restock: Spread = Spread(median_s=360.0, spread=0.5)
    mean_m_s: float = Field(default=1.1, ge=0.2, le=3)
    spread_m_s: float = Field(default=0.1, ge=0, le=0.5)
    carrying: CarryingShares = CarryingShares(
        hand=0.1, flat=0.0, swinging=0.1, pocket=0.8, bag=0.0, trolley=0.0
    )


class TradingDay(Settings):
    """A day in a store; time 0 of the simulation is its opening.

    Attributes
    ----------
    opens, closes : str
        Clock times.
    shoppers : float
        How many are expected in all.
    arrivals : tuple of ArrivalRate
        How they spread over the day; what comes before the first is like the first.
    group_shares : tuple of float
        Relative numbers of groups of one, two, three and so on; assumed. [-]
    entrance : str
        Node where people come in.
    exit : str or None
        Node where they leave; the entrance where not given.
    tills : Tills
        Where they pay.
    capacity : int
        How many shoppers the store holds; more wait outside.
    basket : Basket
        What they look for.
    lists : tuple of ShoppingList
        Dealt out in turn instead of drawn baskets.
    routes : tuple of RecordedRoute
        Replayed by further shoppers.
    order : str
        ``nearest-next``; ``list``; ``circuit``: once through every aisle.
    detours : Detours
        Ways nobody planned.
    dwell : Spread
        How long a shopper stands before a product; assumed.
    pace : Pace
        How they move.
    carrying : CarryingShares
        How their phones are carried.
    staff : Staff
        Who works there.
    gait : Gait
        How everybody steps.
    """

    opens: Clock = "08:00"
    closes: Clock = "20:00"
    shoppers: float = Field(default=2000.0, ge=0, le=200_000)
    arrivals: tuple[ArrivalRate, ...] = Field(
        default=tuple(ArrivalRate(since=since, weight=weight) for since, weight in _TWO_PEAKS),
        min_length=1,
    )
    group_shares: tuple[Annotated[float, Field(ge=0, le=1000)], ...] = Field(
        default=(0.75, 0.2, 0.03, 0.02), min_length=1, max_length=20
    )
    entrance: Name
    exit: Name | None = None
    tills: Tills
    capacity: int = Field(default=500, ge=1, le=200_000)
    basket: Basket = Basket()
    lists: tuple[ShoppingList, ...] = ()
    routes: tuple[RecordedRoute, ...] = ()
    order: Literal["nearest-next", "list", "circuit"] = "nearest-next"
    detours: Detours = Detours()
    dwell: Spread = Spread()
    pace: Pace = Pace()
    carrying: CarryingShares = CarryingShares()
    staff: Staff = Staff()
    gait: Gait = Gait()

    @property
    def way_out(self) -> str:
        """Node where people leave."""
        return self.exit or self.entrance

    @property
    def open_us(self) -> int:
        """How long the store is open. [us]."""
        return (clock_s(self.closes) - clock_s(self.opens)) * MICROSECONDS_PER_SECOND

    @model_validator(mode="after")
    def _hours(self) -> "TradingDay":
        if clock_s(self.closes) <= clock_s(self.opens):
            raise ValueError(f"closes '{self.closes}' is not after opens '{self.opens}'")
        return self

    @model_validator(mode="after")
    def _arrivals(self) -> "TradingDay":
        since = [clock_s(rate.since) for rate in self.arrivals]
        if any(b <= a for a, b in pairwise(since)):
            raise ValueError("arrivals: 'since' must grow from one rate to the next")
        if self.shoppers > 0 and not any(weight for _, weight in self.rates()):
            raise ValueError("arrivals: nobody would come while the store is open; raise a weight")
        return self

    @model_validator(mode="after")
    def _groups(self) -> "TradingDay":
        if not any(self.group_shares):
            raise ValueError("group_shares: every share is 0; give one size of group a share")
        return self

    def rates(self) -> list[tuple[int, float]]:
        """Seconds since opening and relative rate of each stretch of the day. [s], [-]."""
        opens, closes = clock_s(self.opens), clock_s(self.closes)
        inside = [r for r in self.arrivals if opens < clock_s(r.since) < closes]
        before = [r for r in self.arrivals if clock_s(r.since) <= opens]
        first = before[-1] if before else self.arrivals[0]
        return [(0, first.weight), *((clock_s(r.since) - opens, r.weight) for r in inside)]
