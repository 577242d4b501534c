import pytest
from pydantic import ValidationError

from blesim.venue.materials import MATERIALS, Material


@pytest.mark.parametrize("name", MATERIALS)
def test_every_number_has_its_source(name: str) -> None:
    material = MATERIALS[name]
    assert material.source
    assert 0.0 < material.crossing_db < 60.0
    assert name == name.lower().replace(" ", "-")


def test_losses_are_never_gains() -> None:
    for values in ({"crossing_db": -1.0}, {"crossing_db": 1.0, "metre_db": -0.1}):
        with pytest.raises(ValidationError, match="greater than or equal to 0"):
            Material(source="x", **values)


def test_the_table_is_read_only() -> None:
    with pytest.raises(TypeError):
        MATERIALS["air"] = MATERIALS["bookcase"]  # type: ignore[index]
