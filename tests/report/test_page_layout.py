from itertools import pairwise

import pytest

from blesim.report.page_layout import page_of

SHAPES = {
    "store": [(67.1, 90.0)],
    "tall": [(10.0, 200.0)],
    "wide": [(300.0, 8.0)],
    "square": [(5.0, 5.0)],
    "two levels": [(60.0, 20.0), (30.0, 40.0)],
}


@pytest.mark.parametrize("with_chart", [True, False])
@pytest.mark.parametrize("sizes_m", SHAPES.values(), ids=SHAPES)
def test_all_parts_are_on_the_page_to_one_scale_and_apart(sizes_m, with_chart):
    page = page_of(sizes_m, with_chart=with_chart)
    scales = [box.width / size[0] for box, size in zip(page.plans, sizes_m, strict=True)]
    assert scales == pytest.approx([scales[0]] * len(scales))
    scales = [box.height / size[1] for box, size in zip(page.plans, sizes_m, strict=True)]
    assert scales == pytest.approx([scales[0]] * len(scales))
    boxes = [*page.plans, page.bar, *([page.chart] if page.chart else [])]
    for box in boxes:
        assert box.left >= 0.6
        assert box.bottom >= 0.5
        assert box.left + box.width <= page.width - 0.2
        assert box.bottom + box.height <= page.height - 0.5
    for one, other in pairwise(boxes):
        beside = other.left >= one.left + one.width + 0.1
        above = other.bottom >= one.bottom + one.height + 0.5
        assert beside or above


def test_the_chart_is_above_what_is_wide_and_beside_what_is_narrow():
    wide, tall = (page_of([size], with_chart=True) for size in ((100.0, 20.0), (20.0, 100.0)))
    assert wide.chart.bottom > wide.plans[0].bottom + wide.plans[0].height
    assert tall.chart.left > tall.plans[0].left + tall.plans[0].width
