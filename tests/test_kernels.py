import numba
import pytest

from blesim.kernels import kernel


def half(number):
    return number / 2


def test_without_a_place_for_the_cache_it_compiles_all_the_same(monkeypatch):
    monkeypatch.setattr(numba.core.caching.CompileResultCacheImpl, "_locator_classes", [])
    assert kernel(half)(5) == 2.5


def test_another_fault_is_not_hidden(monkeypatch):
    def broken(**_options):
        raise RuntimeError("no compiler")

    monkeypatch.setattr(numba, "njit", broken)
    with pytest.raises(RuntimeError, match="no compiler"):
        kernel(half)
