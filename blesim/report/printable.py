"""Names that others chose, fit to be shown."""

import unicodedata

# Control characters, surrogates, and what ends a line or a paragraph.
_UNSHOWN = ("Cc", "Cs", "Zl", "Zp")


def printable(text: str) -> str:
    """One line of text in which nothing steers a terminal or spoils a picture: it is spelt out."""
    return "".join(
        repr(letter)[1:-1] if unicodedata.category(letter) in _UNSHOWN else letter
        for letter in text
    )
