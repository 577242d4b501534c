"""Other formats, into recordings; each importer by the name it has on the command line."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from blesim.dataset.exchange.imported import Imported
from blesim.dataset.exchange.philotuxo import read_philotuxo
from blesim.dataset.exchange.uji_library import read_uji_library

IMPORTERS: Mapping[str, Callable[[Path], Imported]] = MappingProxyType(
    {"philotuxo": read_philotuxo, "uji_library": read_uji_library}
)
