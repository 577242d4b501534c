"""The library's fitted parameters: what `fit_library` found in campaign 2."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from blesim.radio.phone import Phone
from blesim.radio.profiles import PROFILES, library_phone
from blesim.radio.propagation import Propagation


@dataclass(frozen=True, slots=True, kw_only=True)
class PhoneFit:
    """What a phone of the data set adds: see `Receiver` and `Scanner`.

    Attributes
    ----------
    offset_db, sensitivity_dbm : float
        Of its receiver. [dB], [dBm]
    window_ms : float
        Effective listening time of a scan of one second. [ms]
    """

    offset_db: float
    sensitivity_dbm: float
    window_ms: float

    def phone(self) -> Phone:
        """The phone as a profile."""
        return library_phone(self.offset_db, self.sensitivity_dbm, self.window_ms)

    @classmethod
    def of(cls, phone: Phone) -> "PhoneFit":
        """What a profile says."""
        return cls(
            offset_db=phone.receiver.offset_db,
            sensitivity_dbm=phone.receiver.sensitivity_dbm,
            window_ms=phone.scanner.window_us / 1000.0,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class LibraryFit:
    """Parameters of the library.

    Attributes
    ----------
    path_loss_exponent, shadowing_db, body_loss_db, rice_factor_db : float
        [-], [dB], [dB], [dB]
    phones : mapping of str to PhoneFit
        Offsets are those to `LEVEL_DBM`.
    """

    path_loss_exponent: float
    shadowing_db: float
    body_loss_db: float
    rice_factor_db: float
    phones: Mapping[str, PhoneFit]

    def profiles(self) -> dict[str, Phone]:
        """Profiles of the phones."""
        return {name: fit.phone() for name, fit in self.phones.items()}

    def radio(self, base: Propagation) -> Propagation:
        """A preset with these parameters."""
        shadowing = base.shadowing.model_copy(update={"standard_deviation_db": self.shadowing_db})
        fading = base.fading.model_copy(update={"rice_factor_db": self.rice_factor_db})
        people = base.people.model_copy(update={"body_loss_db": self.body_loss_db})
        return base.model_copy(
            update={
                "path_loss_exponent": self.path_loss_exponent,
                "shadowing": shadowing,
                "people": people,
                "fading": fading,
            }
        )


# At one metre, of every beacon; what a phone reads beside it is its offset.
LEVEL_DBM = -59.0

LIBRARY = LibraryFit(
    path_loss_exponent=2.35,
    shadowing_db=4.8,
    body_loss_db=8.2,
    rice_factor_db=7.8,
    phones=MappingProxyType(
        {name: PhoneFit.of(PROFILES[f"uji-{name.lower()}"]) for name in ("A5", "BQ", "S6")}
    ),
)
