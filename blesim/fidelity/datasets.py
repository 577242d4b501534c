"""The data sets that have a twin, each by the name it has on the command line."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from blesim.fidelity.comparison import Comparison
from blesim.fidelity.mitll_static import compare_rooms
from blesim.fidelity.philotuxo import compare_hall
from blesim.fidelity.uji_library import compare_library
from blesim.radio.propagation import Propagation

DATASETS: Mapping[str, Callable[[Path, Propagation | None, int], Comparison]] = MappingProxyType(
    {"philotuxo": compare_hall, "mitll_static": compare_rooms, "uji_library": compare_library}
)
