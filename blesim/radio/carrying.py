"""Ways of carrying a phone: how high it is, and what stands between it and a beacon.

Nobody has measured all of them side by side. Numbers without a source are assumed.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from blesim import columns
from blesim.settings import Settings
from blesim.tables import Carrying, IntArray


class WayOfCarrying(Settings):
    """A way of carrying a phone; as it stands, in the hand.

    Attributes
    ----------
    height_m : float or None
        Of the phone above the floor; without it, the height of the phone profile. [m]
    ahead_m : float
        How far it is carried ahead of where the walk says, in the direction of the heading. [m]
    side_deg : float
        At which side of the body it is: 0 ahead, 90 left, -90 right. The body is in the way of
        beacons on the other side. [deg]
    body_share : float
        Share of `People.body_loss_db` that counts. [-]
    loss_db : float
        On top, whatever the direction. [dB]
    sways : bool
        Whether it sways when its carrier stands; see `People`.
    """

    height_m: float | None = Field(default=None, ge=0, le=3)
    ahead_m: float = Field(default=0.0, ge=-2, le=2)
    side_deg: float = Field(default=0.0, ge=-180, le=180)
    body_share: float = Field(default=1.0, ge=0, le=5)
    loss_db: float = Field(default=0.0, ge=0, le=40)
    sways: bool = True


class Swinging(WayOfCarrying):
    """In the right hand of a swinging arm, beside the thigh: 0.75 m high; assumed."""

    height_m: float | None = Field(default=0.75, ge=0, le=3)
    side_deg: float = Field(default=-90.0, ge=-180, le=180)


class Pocket(WayOfCarrying):
    """In a front pocket of the trousers, at the hip: 0.9 m high; assumed.

    Links from pocket to pocket were measured 15 to 19 dB below those from hand to hand; one phone
    in a pocket has half of that. The body shadows from behind, as in the hand; assumed.
    """

    height_m: float | None = Field(default=0.9, ge=0, le=3)
    loss_db: float = Field(default=8.0, ge=0, le=40)


class Bag(WayOfCarrying):
    """In a bag on the right shoulder, among other things: 0.9 m high, 4 dB; assumed."""

    height_m: float | None = Field(default=0.9, ge=0, le=3)
    side_deg: float = Field(default=-90.0, ge=-180, le=180)
    loss_db: float = Field(default=4.0, ge=0, le=40)


class Trolley(WayOfCarrying):
    """In the child seat of a trolley: 1.0 m high, 0.5 m ahead of its carrier; assumed.

    The wire beside and below it costs 3 dB in all directions; assumed. Baskets of trolleys, one's
    own or another's, are left out as obstacles: their rims are about as high as the phone, so that
    they reach into links to beacons below it alone, and those on shelves hang higher.
    """

    height_m: float | None = Field(default=1.0, ge=0, le=3)
    ahead_m: float = Field(default=0.5, ge=-2, le=2)
    loss_db: float = Field(default=3.0, ge=0, le=40)
    sways: bool = False


class WaysOfCarrying(Settings):
    """What each way of carrying a phone does to its links; the names are `columns.CARRYINGS`.

    Attributes
    ----------
    hand, flat : WayOfCarrying
        Held in front of the body.
    swinging : Swinging
    pocket : Pocket
    bag : Bag
    trolley : Trolley
    """

    hand: WayOfCarrying = WayOfCarrying()
    flat: WayOfCarrying = WayOfCarrying()
    swinging: Swinging = Swinging()
    pocket: Pocket = Pocket()
    bag: Bag = Bag()
    trolley: Trolley = Trolley()

    def carried(self, timeline: Carrying | None, height_m: float) -> "Carried":
        """How a phone is carried along a walk.

        Parameters
        ----------
        timeline : Carrying or None
            From when on it is carried how; none, or one without rows, for in the hand throughout.
        height_m : float
            Of the phone where a way of carrying does not say. [m]
        """
        ways: list[WayOfCarrying] = [getattr(self, name) for name, _ in columns.CARRYINGS]
        side_rad = np.radians([way.side_deg for way in ways])
        return Carried(
            timeline=timeline if timeline is not None and len(timeline) else None,
            height_m=np.array([height_m if w.height_m is None else w.height_m for w in ways]),
            ahead_m=np.array([way.ahead_m for way in ways]),
            # Rounded, so that a quarter of a turn is one.
            side=np.round(np.stack([np.cos(side_rad), np.sin(side_rad)], axis=1), 12),
            body_share=np.array([way.body_share for way in ways]),
            loss_db=np.array([way.loss_db for way in ways]),
            sways=np.array([way.sways for way in ways]),
        )


class Carried(NamedTuple):
    """How a phone is carried along a walk, arrays over `columns.CARRYINGS`, (6,).

    ``side`` (6, 2) is the cosine and the sine of the side of the body.
    """

    timeline: Carrying | None
    height_m: NDArray[np.float64]
    ahead_m: NDArray[np.float64]
    side: NDArray[np.float64]
    body_share: NDArray[np.float64]
    loss_db: NDArray[np.float64]
    sways: NDArray[np.bool_]

    def ways_at(self, time_us: IntArray) -> NDArray[np.uint8]:
        """Ways of carrying at times, rows of `columns.CARRYINGS`, (n,)."""
        if self.timeline is None:
            return np.zeros(len(time_us), np.uint8)
        return self.timeline.at(time_us).astype(np.uint8)
