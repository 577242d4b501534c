from xml.etree import ElementTree

import pytest
from matplotlib.figure import Figure

from blesim.errors import UsageError
from blesim.report.figure_file import save


def drawn(name):
    figure = Figure()
    axes = figure.subplots()
    axes.plot([1, 2], [3, 5], label=name)
    axes.set_title(name, parse_math=False)
    return figure


@pytest.mark.parametrize("ending", ["PNG", "Svg", "pDf"])
def test_the_case_of_the_ending_does_not_matter_and_the_bytes_repeat(tmp_path, ending):
    paths = [tmp_path / f"{name}.{ending}" for name in "ab"]
    for path in paths:
        save(drawn("run"), path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert sorted(tmp_path.iterdir()) == paths


def test_a_letter_that_the_font_lacks_is_no_fault(tmp_path):
    save(drawn("店"), tmp_path / "a.svg")
    ElementTree.parse(tmp_path / "a.svg")


def test_an_unknown_ending_is_refused(tmp_path):
    with pytest.raises(UsageError, match=r"a\.xyz: a figure cannot be written as 'xyz'"):
        save(drawn("run"), tmp_path / "a.xyz")
    assert list(tmp_path.iterdir()) == []
