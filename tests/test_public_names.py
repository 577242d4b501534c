import blesim


def test_public_names_are_sorted_and_load():
    assert blesim.__all__ == sorted(blesim.__all__)
    for name in blesim.__all__:
        assert getattr(blesim, name).__name__ == name


def test_an_unknown_name_is_an_attribute_error():
    assert not hasattr(blesim, "Simulator")
