"""The library's parameters, and those of its three phones, from campaign 2.

Missing packets hide the weak side of everything, so that no number can be read off a regression.
Each is therefore set such that the simulated campaign, which misses the same packets, shows what
the real one shows: path loss exponent, spread and level of the received, and how often phones hear.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from blesim.fidelity.library_fit import LEVEL_DBM, LIBRARY, LibraryFit, PhoneFit
from blesim.fidelity.library_statistics import (
    PHONES,
    STRONG_DBM,
    WEAK_DBM,
    Library,
    Links,
    links_of_phone,
    over_scans_db,
)
from blesim.fidelity.uji_library import library_twin
from blesim.radio.propagation import Propagation

# A whole scan.
_LONGEST_WINDOW_MS = 1000.0
# What a dB of sensitivity changes in the share of weak packets heard, inverted. [dB]
_EDGE_SLOPE_DB = 12.0
# Decibels of Rice factor that take a decibel off the deviation over scans.
_RICE_SLOPE = 3.0
_ROUNDS = 20
_DAMPING = 0.7


def fit_library(real: Library, base: Propagation, seed: int) -> LibraryFit:
    """Path loss, shadowing and phones of the library.

    Parameters
    ----------
    real : Library
        Campaign 2.
    base : Propagation
        What is not fitted: sway and the reach of the shadowing.
    seed : int
        Of the simulations.
    """
    target = _seen(real)
    fit = LIBRARY
    later = []
    for number in range(_ROUNDS):
        twin = library_twin(real, fit.profiles(), LEVEL_DBM, fit.radio(base), seed + number)
        fit = _nearer(fit, target, _seen(twin))
        later.append(fit)
    return _mean(later[_ROUNDS // 2 :])


class _Seen(NamedTuple):
    """A campaign: the links of each phone, and how much a link varies over scans. [dB]."""

    links: Mapping[str, Links]
    over_scans_db: float


def _seen(library: Library) -> _Seen:
    points = library.points()
    links = {
        phone: links_of_phone(library, [point for point in points if point.phone == phone])
        for phone in PHONES
    }
    return _Seen(links, float(np.median(np.concatenate([over_scans_db(p) for p in points]))))


def _nearer(fit: LibraryFit, real: _Seen, twin: _Seen) -> LibraryFit:
    """The fit moved towards what the twin still lacks."""
    wanted, got = _path(real.links), _path(twin.links)
    steadier_db = _RICE_SLOPE * (twin.over_scans_db - real.over_scans_db)
    return LibraryFit(
        path_loss_exponent=fit.path_loss_exponent + _DAMPING * (wanted[0] - got[0]),
        shadowing_db=max(0.5, fit.shadowing_db + _DAMPING * (wanted[1] - got[1])),
        body_loss_db=max(0.0, fit.body_loss_db + _DAMPING * (wanted[2] - got[2])),
        rice_factor_db=fit.rice_factor_db + _DAMPING * steadier_db,
        phones={
            name: _nearer_phone(fit.phones[name], real.links[name], twin.links[name])
            for name in PHONES
        },
    )


def _path(links: Mapping[str, Links]) -> tuple[float, float, float]:
    """Exponent, spread and body loss, median over phones and beacons. [-], [dB], [dB]."""
    beacons = range(next(iter(links.values())).level_dbm.shape[1])
    fits = [mine.fit(row, obstacles=True) for mine in links.values() for row in beacons]
    return (
        float(np.nanmedian([fit.exponent for fit in fits])),
        float(np.nanmedian([fit.deviation_db for fit in fits])),
        float(np.nanmedian([fit.loss_db[2] for fit in fits])),
    )


def _nearer_phone(fit: PhoneFit, real: Links, twin: Links) -> PhoneFit:
    level_db = _level_dbm(real) - _level_dbm(twin)
    strong = _heard(real, STRONG_DBM, 0.0) / _heard(twin, STRONG_DBM, 0.0)
    # Both the weakest levels and how often weak ones are heard tell the sensitivity.
    edge_db = _weakest_dbm(real) - _weakest_dbm(twin)
    rarer = _heard(twin, -130.0, WEAK_DBM) - _heard(real, -130.0, WEAK_DBM)
    edge_db += _EDGE_SLOPE_DB * rarer if np.isfinite(rarer) else edge_db
    return replace(
        fit,
        offset_db=fit.offset_db + _DAMPING * level_db,
        sensitivity_dbm=fit.sensitivity_dbm + _DAMPING * edge_db / 2.0,
        window_ms=float(np.clip(fit.window_ms * strong**_DAMPING, 20.0, _LONGEST_WINDOW_MS)),
    )


def _level_dbm(links: Links) -> float:
    """Median level of links within 8 m, which are strong enough to arrive. [dBm]."""
    return float(np.nanmedian(links.level_dbm[links.distance_m < 8.0]))


def _weakest_dbm(links: Links) -> float:
    """Level that only 5 % of the links that are heard stay below. [dBm]."""
    return float(np.nanquantile(links.level_dbm, 0.05))


def _heard(links: Links, low_dbm: float, high_dbm: float) -> float:
    """Share of scans that heard a beacon of a level between the two; NaN for too few. [-]."""
    between = (links.level_dbm >= low_dbm) & (links.level_dbm < high_dbm)
    return float(links.detected[between].mean()) if between.sum() > 20 else np.nan


def _mean(fits: list[LibraryFit]) -> LibraryFit:
    """The mean of fits that differ by the chance of their simulations."""
    phones = {
        name: PhoneFit(
            offset_db=float(np.mean([fit.phones[name].offset_db for fit in fits])),
            sensitivity_dbm=float(np.mean([fit.phones[name].sensitivity_dbm for fit in fits])),
            window_ms=float(np.mean([fit.phones[name].window_ms for fit in fits])),
        )
        for name in PHONES
    }
    return LibraryFit(
        path_loss_exponent=float(np.mean([fit.path_loss_exponent for fit in fits])),
        shadowing_db=float(np.mean([fit.shadowing_db for fit in fits])),
        body_loss_db=float(np.mean([fit.body_loss_db for fit in fits])),
        rice_factor_db=float(np.mean([fit.rice_factor_db for fit in fits])),
        phones=phones,
    )
