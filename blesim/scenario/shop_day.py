"""A trading day as a scenario tells it, with lists and routes from files beside it."""

from blesim.settings import Text
from blesim.walkers.trading_day import TradingDay


class ShopDay(TradingDay):
    """A day in a store, `blesim.walkers.trading_day.TradingDay`, and files for it.

    Attributes
    ----------
    lists_file : str or None
        CSV file, relative to the scenario, with shopping lists: ``shopper,section``.
    routes_file : str or None
        CSV file, relative to the scenario, with recorded routes: ``shopper,time_s,place``.
    """

    lists_file: Text | None = None
    routes_file: Text | None = None
