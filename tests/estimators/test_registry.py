from dataclasses import dataclass, field
from importlib.metadata import EntryPoint
from typing import Annotated, ClassVar, Literal

import pytest
from pydantic import Field

from blesim.errors import UsageError
from blesim.estimators import registry
from blesim.estimators.base import Need
from blesim.estimators.nearest_beacon import NearestBeacon
from blesim.estimators.registry import (
    GROUP,
    describe,
    estimator_names,
    load_estimator,
    make_estimator,
)


@dataclass(frozen=True, kw_only=True)
class Full:
    """A system with all kinds of settings.

    And more lines of documentation.
    """

    particles: Annotated[int, Field(ge=1)] = 500
    motion: Literal["walk", "drift"] = "walk"
    smooth: bool = True
    exponent: float | None = None
    learned: object = field(default=None, init=False)
    needs: ClassVar[frozenset[Need]] = frozenset({Need.SURVEY, Need.GRAPH})

    def fit(self, venue, surveys): ...
    def start(self, start, rng): ...


@dataclass
class Thawed:
    pass


@dataclass(frozen=True)
class Startless:
    needs: ClassVar[frozenset[Need]] = frozenset()

    def fit(self, venue, surveys): ...


@dataclass(frozen=True)
class Demanding(Full):
    grid: str

    def __init__(self, grid): ...


@pytest.fixture
def installed(monkeypatch):
    """Let this module's classes stand as if packages had brought them."""
    offers = [
        ("full", f"{__name__}:Full"),
        ("thawed", f"{__name__}:Thawed"),
        ("startless", f"{__name__}:Startless"),
        ("demanding", f"{__name__}:Demanding"),
        ("gone", "no_such_module_anywhere:Gone"),
        ("seen-twice", f"{__name__}:Full"),
        ("seen-twice", f"{__name__}:Full"),
        ("disputed", f"{__name__}:Full"),
        ("disputed", "another.package:Full"),
    ]
    points = [EntryPoint(name=name, value=value, group=GROUP) for name, value in offers]

    def entry_points(*, group, name=None):
        assert group == GROUP
        return [point for point in points if name in (None, point.name)]

    monkeypatch.setattr(registry, "entry_points", entry_points)


def test_ours_is_declared_like_anybodys():
    assert "nearest-beacon" in estimator_names()
    assert load_estimator("nearest-beacon") is NearestBeacon


def test_a_name_alone_gives_the_defaults():
    assert make_estimator("nearest-beacon") == ("nearest-beacon", NearestBeacon())


@pytest.mark.usefixtures("installed")
def test_values_are_read_by_the_type_of_their_parameter():
    label, estimator = make_estimator("full:particles=7, smooth=no, motion=drift, exponent=2")
    assert label == "full:particles=7,smooth=no,motion=drift,exponent=2"
    assert estimator == Full(particles=7, smooth=False, motion="drift", exponent=2.0)
    assert make_estimator("full:exponent=none")[1] == Full()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("nearest-becon", "no estimator 'nearest-becon' .did you mean nearest-beacon.*; known are"),
        ("", "no estimator ''"),
        ("nearest-beacon:windows=3", "did you mean window_s.*it has signal, window_s, rate"),
        ("nearest-beacon:places=3", "no parameter 'places'"),
        ("nearest-beacon:signal=loud", "signal=loud: .*'highest' or 'averaged'"),
        ("nearest-beacon:window_s=long", "window_s=long: .*valid number"),
        ("nearest-beacon:window_s=nan", "window_s=nan: .*finite"),
        ("nearest-beacon:window_s=-1", "window_s -1: give 1e-6 to"),
        ("nearest-beacon:window_s", "'window_s' is not of the form key=value"),
        ("nearest-beacon:rate=1,rate=1", "'rate' is given twice"),
    ],
)
def test_a_wrong_call_is_explained_in_one_line(text, says):
    with pytest.raises(UsageError, match=says) as caught:
        make_estimator(text)
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 2


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("full:particles=0", "particles=0: .*greater than or equal to 1"),
        ("full:particles=1.5", "particles=1.5"),
        ("thawed", "not a frozen dataclass"),
        ("startless", "has no 'start'"),
        ("gone", "cannot be imported: ModuleNotFoundError: .*no_such_module_anywhere"),
        ("disputed", "offered by another.package:Full and by .*Full; uninstall one"),
    ],
)
@pytest.mark.usefixtures("installed")
def test_faults_of_strangers_are_explained_in_one_line(text, says):
    with pytest.raises(UsageError, match=says) as caught:
        make_estimator(text)
    assert "\n" not in str(caught.value)


@pytest.mark.usefixtures("installed")
def test_a_package_seen_twice_is_one_offer():
    assert load_estimator("seen-twice").__name__ == "Full"


@pytest.mark.usefixtures("installed")
def test_a_description_tells_needs_and_parameters():
    told = describe("full")
    assert told.fault is None
    assert told.summary == "A system with all kinds of settings."
    assert told.needs == ("graph", "survey")
    assert [(p.name, p.type, p.default) for p in told.parameters] == [
        ("particles", "int", "500"),
        ("motion", "'walk' | 'drift'", "'walk'"),
        ("smooth", "bool", "True"),
        ("exponent", "float | None", "None"),
    ]


@pytest.mark.usefixtures("installed")
def test_a_broken_one_does_not_spoil_the_listing():
    faults = {name: describe(name).fault for name in estimator_names()}
    assert faults["full"] is None
    assert "no_such_module_anywhere" in faults["gone"]
    assert "default settings" in faults["demanding"]


def test_only_an_unknown_name_has_no_description():
    with pytest.raises(UsageError, match="no estimator 'nobody'"):
        describe("nobody")
