"""Statistics of what gyroscope and magnetometer tell of a walk, a number a piece."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from blesim.fidelity.comparison import Panel, distribution
from blesim.fidelity.felt import RATE_HZ, Numbers, Piece
from blesim.fidelity.gait_statistics import order_share
from blesim.fidelity.scorecard import Statistic


def motion_statistics(label: str, pieces: Sequence[Piece]) -> Iterator[Statistic]:
    """Angular rates and the magnetic field along the way.

    Parameters
    ----------
    label : str
        Way of carrying; begins the names.
    pieces : sequence of Piece
        Real or simulated, of all nine axes.
    """
    measures: tuple[tuple[str, str, Callable[[Piece], float]], ...] = (
        ("angular rate about the phone's width", "rad/s", partial(rate_rad_s, axis=0)),
        ("angular rate about the phone's length", "rad/s", partial(rate_rad_s, axis=1)),
        ("angular rate about the screen's normal", "rad/s", partial(rate_rad_s, axis=2)),
        ("turning at the stride frequency, share", "1", partial(turning_share, order=0.5)),
        ("turning at the step frequency, share", "1", partial(turning_share, order=1.0)),
        ("|B|, deviation along the way", "uT", field_deviation_ut),
        ("|B|, change over 1 s", "uT", partial(field_change_ut, over_s=1.0)),
        ("|B|, change over 5 s", "uT", partial(field_change_ut, over_s=5.0)),
        ("|B|, change from sample to sample", "uT", partial(field_change_ut, over_s=0.02)),
    )
    for name, unit, measure in measures:
        yield Statistic(
            name=f"{label}: {name}", unit=unit, values=np.array([measure(p) for p in pieces])
        )


def rate_rad_s(piece: Piece, axis: int) -> float:
    """Root mean square angular rate about an axis of the phone. [rad/s]."""
    return float(np.sqrt(np.mean(piece.felt.angular_rate_rad_s[:, axis] ** 2)))


def turning_share(piece: Piece, order: float) -> float:
    """Share of the angular rates' power at a multiple of the step frequency. [-]."""
    return order_share(piece, piece.felt.angular_rate_rad_s, order)


def field_deviation_ut(piece: Piece) -> float:
    """Standard deviation of the magnetic flux density along the way. [uT]."""
    return float(np.std(_field_ut(piece)))


def field_change_ut(piece: Piece, over_s: float) -> float:
    """Root mean square change of the magnetic flux density over some time. [uT]."""
    field_ut = _field_ut(piece)
    apart = round(over_s * RATE_HZ)
    return float(np.sqrt(np.mean((field_ut[apart:] - field_ut[:-apart]) ** 2)))


def _field_ut(piece: Piece) -> Numbers:
    return np.asarray(np.linalg.norm(piece.felt.magnetic_field_ut, axis=1))


def field_panel(label: str, real: Sequence[Piece], simulated: Sequence[Piece]) -> Panel:
    """Panel of the magnetic flux density about the mean of its piece."""
    sides = real, simulated
    return distribution(
        f"{label}: magnetic field along the way",
        "|B| less its mean [uT]",
        *(np.concatenate([_field_ut(p) - _field_ut(p).mean() for p in side]) for side in sides),
    )
