"""What every importer returns."""

from dataclasses import dataclass

from blesim.recording import Recording, Truth


@dataclass(frozen=True, slots=True, kw_only=True)
class Imported:
    """Somebody else's recording as one of ours.

    Attributes
    ----------
    recording : Recording
        What was observed.
    truth : Truth
        What is known of what really happened.
    report : tuple of str
        What was left out on the way, one line each; the recording's references say it as well.
    """

    recording: Recording
    truth: Truth
    report: tuple[str, ...]
