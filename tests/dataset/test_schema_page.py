"""The schema page in the package is the one that `columns.py` makes."""

from importlib.resources import files

from blesim import columns
from blesim.dataset.schema_page import schema_page


def test_the_page_in_the_package_is_up_to_date() -> None:
    page = files("blesim").joinpath("docs/recording.md").read_text(encoding="utf-8")
    assert page == schema_page(), "run: blesim schema --recording > blesim/docs/recording.md"


def test_every_column_is_on_the_page() -> None:
    page = schema_page()
    recorded = (*columns.OBSERVATIONS, *columns.TRUTH, *columns.HISTORY)
    streams = (*columns.STATIC, *recorded, columns.TRACK, columns.RUNS)
    for stream in streams:
        _, section = page.split(f"## `{stream.group}`\n")
        section = section.split("\n## ")[0]
        for column in stream.columns:
            assert f"| `{column.name}` |" in section
            assert column.long_name in section
