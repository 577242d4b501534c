"""Figures into files: whole or not at all, and the same bytes for the same figure."""

import warnings
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.backend_bases import FigureCanvasBase
from matplotlib.figure import Figure

from blesim.errors import UsageError
from blesim.whole_file import write_whole


def refuse_unknown_format(path: Path) -> None:
    """Raise `UsageError` if a name ends in no format that can be drawn."""
    if _kind(path) not in FigureCanvasBase.get_supported_filetypes():
        raise UsageError(
            f"{path}: a figure cannot be written as '{_kind(path)}'; use .png, .svg or .pdf"
        )


def save(figure: Figure, path: Path) -> None:
    """Write a figure, whole or not at all; the same figure gives the same bytes.

    Raises
    ------
    UsageError
        If the name ends in no format that can be drawn, or nothing can be written there.
    DataError
        If the disk is full or fails.
    """
    refuse_unknown_format(path)
    kind, drawn = _kind(path), BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "blesim"}), warnings.catch_warnings():
        # A letter that the font lacks is drawn as a box; nobody needs to be told of each.
        warnings.filterwarnings("ignore", message=r"Glyph .* missing from")
        figure.savefig(drawn, format=kind, dpi=120, metadata=_no_date(kind))
    write_whole(path, drawn.getvalue())


def _kind(path: Path) -> str:
    return path.suffix.removeprefix(".").lower()


def _no_date(kind: str) -> dict[str, Any]:
    dated = {"svg": "Date", "pdf": "CreationDate"}
    return {dated[kind]: None} if kind in dated else {}
