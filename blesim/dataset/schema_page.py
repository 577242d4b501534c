"""The schema of our files as a page of Markdown, made from `columns.py`."""

from collections.abc import Iterator, Sequence

from blesim import columns
from blesim.columns import Column, Stream
from blesim.dataset.layout import CHUNK_ROWS, CONVENTIONS, RECORDED, dimension, row_size
from blesim.recording import SCHEMA_VERSION

_INTRODUCTION = f"""\
# The recording file

Made by `blesim schema --recording > blesim/docs/recording.md`; do not edit by hand.

A recording is one HDF5 file (schema version {SCHEMA_VERSION},
{CONVENTIONS} contiguous ragged arrays) that plain h5py, xarray, netCDF4 and MATLAB open. Each
stream is one flat table for all walks: the rows of the first walk, then those of the second, and
so on; `/walks` holds one row a walk and says in `<stream>_row_size` how many rows of each stream
are its own; `/truth/beacon_events` belongs to all of them. Times ascend within a walk. A stream
that nobody recorded has no rows. Where a whole store was simulated, `/truth/people` holds one row
for everybody who was there, in the same way, and `/truth/crowd` their trajectories.

```python
rssi = xarray.open_dataset("a.h5", group="rssi", decode_timedelta=False)
```

Every column says `long_name`, `units` (text apart), `valid_range` and, for an enumeration,
`flag_values` and `flag_meanings`. Columns of numbers are stored in chunks of up to {CHUNK_ROWS}
rows, shuffled, gzip-compressed and checksummed; texts carry a `text_sha256`. There is no wall-clock
time anywhere: the same content gives the same bytes.

Root attributes: `Conventions`, `schema_version`, `content` ("recording" or "tracks"), `title`,
`source`, `license`, `references`, `scenario` (verbatim; empty if real), `packages`,
`text_sha256` of the texts from `title` on, `scenario_sha256`, and `seed`, if it was simulated.

`/venue/built` and `/venue/surveyed` are GeoJSON texts (RFC 7946, IMDF feature types, local
metres). `/venue/nodes` and `/venue/edges` are there if the venue has an aisle graph. What is under
`/truth`, and the venue as built, is for scoring only.
"""
_TRACKS = """\
# The tracks file

What estimators made of a recording, under the same rules. Root attributes: `Conventions`,
`schema_version`, `content`, `title`, `recording_sha256` (of the recording's file), `packages`,
`text_sha256`.
"""


def schema_page() -> str:
    """Markdown of every group and column of recordings and tracks."""
    recording = (
        *columns.STATIC,
        *RECORDED,
        *columns.HISTORY,
        columns.PEOPLE,
        columns.CROWD,
    )
    parts = [_INTRODUCTION, *map(_section, recording), _TRACKS]
    parts += map(_section, (columns.RUNS, columns.TRACK))
    return "\n".join(parts)


def _section(stream: Stream) -> str:
    counted = columns.COUNTED.get(stream.group, ())
    rows = [*stream.columns, *map(row_size, counted)]
    head = [
        f"## `{stream.group}`",
        "",
        f"A row is {stream.row}. Dimension `{dimension(stream)}`.",
        "",
        "| column | type | units | valid | meaning |",
        "| --- | --- | --- | --- | --- |",
    ]
    return "\n".join([*head, *_rows(rows)]) + "\n"


def _rows(listed: Sequence[Column]) -> Iterator[str]:
    for column in listed:
        kind = "UTF-8 text" if column.is_text else column.dtype
        cells = (f"`{column.name}`", kind, column.units, _valid(column), column.long_name)
        yield f"| {' | '.join(cells)} |"


def _valid(column: Column) -> str:
    """Legal values of a column in words."""
    if column.flags:
        return ", ".join(f"{value} {name}" for name, value in column.flags)
    if column.valid_range is None:
        return ""
    low, high = (f"{limit:.12g}" for limit in column.valid_range)
    return f"{low} to {high}{' or NaN' if column.missing else ''}"
