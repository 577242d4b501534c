"""The attributes at the root of a file: what it is, what made it, what it was made from."""

import hashlib
from collections.abc import Mapping
from importlib.metadata import version

import h5py
import numpy as np

from blesim.dataset.layout import CONVENTIONS, SEAL, checked_text, digest
from blesim.errors import DataError
from blesim.recording import SCHEMA_VERSION, Provenance

SCENARIO_SEAL = "scenario_sha256"
_TEXTS = ("title", "source", "license", "references", "scenario", "packages")


def packages() -> str:
    """Versions of what decides about the bytes of a file."""
    names = ("blesim", "h5py", "numpy")
    found = [f"{name} {version(name)}" for name in names]
    return ", ".join([*found, f"hdf5 {h5py.version.hdf5_version}"])


def write_root(file: h5py.File, content: str, texts: Mapping[str, str]) -> None:
    """Conventions, version and kind of content, then texts with one seal for all of them."""
    file.attrs["Conventions"] = CONVENTIONS
    file.attrs["schema_version"] = SCHEMA_VERSION
    file.attrs["content"] = content
    for name, text in texts.items():
        file.attrs[name] = checked_text(text)
    file.attrs[SEAL] = digest(texts.values())


def read_root(file: h5py.File, names: tuple[str, ...]) -> dict[str, str]:
    """The texts that `write_root` wrote, by name.

    Raises
    ------
    DataError
        If one is missing or they do not match their seal.
    """
    texts = {name: file.attrs.get(name) for name in names}
    for name, text in texts.items():
        if not isinstance(text, str):
            raise DataError(f"root attribute '{name}' is missing; make the file again")
    if digest(texts.values()) != file.attrs.get(SEAL):
        raise DataError(f"the root attributes do not match their {SEAL}; make the file again")
    return texts


def write_provenance(file: h5py.File, content: str, provenance: Provenance) -> None:
    """Root attributes of a recording; without a seed where nothing was simulated."""
    texts = {name: getattr(provenance, name) for name in _TEXTS[:-1]}
    write_root(file, content, texts | {"packages": packages()})
    file.attrs[SCENARIO_SEAL] = scenario_sha256(provenance.scenario)
    if provenance.seed is not None:
        file.attrs["seed"] = np.uint64(provenance.seed)


def read_provenance(file: h5py.File) -> Provenance:
    """Provenance of a recording.

    Raises
    ------
    DataError
        If it is incomplete, or was changed after it was written.
    """
    texts = read_root(file, _TEXTS)
    if file.attrs.get(SCENARIO_SEAL) != scenario_sha256(texts["scenario"]):
        raise DataError(f"the scenario does not match {SCENARIO_SEAL}; make the file again")
    del texts["packages"]
    seed = file.attrs.get("seed")
    return Provenance(**texts, seed=None if seed is None else int(seed))


def scenario_sha256(scenario: str) -> str:
    """SHA-256 of a scenario's text as a file holds it, without the NUL of a seal."""
    return hashlib.sha256(scenario.encode()).hexdigest()
