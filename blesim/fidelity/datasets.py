"""The data sets that have a twin, each by the name it has on the command line."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from blesim.errors import UsageError
from blesim.fidelity.comparison import Comparison
from blesim.fidelity.ilc20 import compare_mall
from blesim.fidelity.mitll_static import compare_rooms
from blesim.fidelity.oxford_steps import compare_walks
from blesim.fidelity.philotuxo import compare_hall
from blesim.fidelity.uji_library import compare_library
from blesim.radio.propagation import Propagation

Compare = Callable[[Path, Propagation | None, int], Comparison]


def _felt(name: str, compare: Callable[[Path, int], Comparison]) -> Compare:
    """The comparison of a data set that no radio has a share in."""

    def refusing(path: Path, radio: Propagation | None, seed: int) -> Comparison:
        if radio is not None:
            raise UsageError(f"{name} compares no radio; leave the scenario out")
        return compare(path, seed)

    return refusing


DATASETS: Mapping[str, Compare] = MappingProxyType(
    {
        "philotuxo": compare_hall,
        "mitll_static": compare_rooms,
        "uji_library": compare_library,
        "oxford_steps": _felt("oxford_steps", compare_walks),
        "ilc20": _felt("ilc20", compare_mall),
    }
)
