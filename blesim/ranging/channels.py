"""Slots of the advertising channels in arrays: 0 all together or not told, 1 to 3 each alone."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from blesim.columns import CHANNEL_NOT_TOLD
from blesim.venue.beacons import CHANNELS

SLOTS = 1 + len(CHANNELS)


def channel_slot(channel: NDArray[np.integer[Any]]) -> NDArray[np.int64]:
    """Slot of each channel, same shape: 0 where not told, 1, 2, 3 for channels 37, 38, 39."""
    told = channel != CHANNEL_NOT_TOLD
    return np.where(told, channel.astype(np.int64) - CHANNELS[0] + 1, 0)
