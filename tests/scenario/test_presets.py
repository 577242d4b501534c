import pytest

from blesim.radio.environments import ENVIRONMENTS
from blesim.radio.phone import Phone, Receiver, Scanner
from blesim.radio.profiles import PROFILES
from blesim.radio.propagation import Propagation
from blesim.scenario.over_preset import over_preset
from blesim.scenario.presets import PhoneProfile, Radio
from blesim.scenario.reading import read_scenario


def phone_of(path) -> PhoneProfile:
    return read_scenario(path).scenario.phones["phone"]


@pytest.mark.parametrize("name", PROFILES)
def test_a_profile_alone_is_that_profile(written, name):
    phone = phone_of(written(f"phones: {{phone: {{profile: {name}}}}}\n"))
    assert Phone(**{field: getattr(phone, field) for field in Phone.model_fields}) == PROFILES[name]


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_an_environment_alone_is_that_environment(written, name):
    radio = read_scenario(written(f"radio: {{environment: {name}}}\n")).scenario.radio
    fields = {field: getattr(radio, field) for field in Propagation.model_fields}
    assert Propagation(**fields) == ENVIRONMENTS[name]


def test_what_is_given_replaces_single_fields_nested_ones_too(written):
    phone = phone_of(
        written(
            "phones:\n  phone:\n    profile: uji-a5\n    height_m: 1.3\n"
            "    receiver: {offset_db: 3, channel_gain_db: [1, 0, -1]}\n"
        )
    )
    usual = PROFILES["uji-a5"]
    assert phone.height_m == 1.3
    assert phone.receiver == usual.receiver.model_copy(
        update={"offset_db": 3.0, "channel_gain_db": (1.0, 0.0, -1.0)}
    )
    assert phone.scanner == usual.scanner


def test_an_environment_with_another_exponent(written):
    text = (
        "radio: {environment: office, path_loss_exponent: 1.8, shadowing: {decorrelation_m: 5}}\n"
    )
    radio, office = read_scenario(written(text)).scenario.radio, ENVIRONMENTS["office"]
    assert radio.path_loss_exponent == 1.8
    assert radio.shadowing == office.shadowing.model_copy(update={"decorrelation_m": 5.0})
    assert radio.people == office.people


def test_a_scan_timing_given_one_way_replaces_the_profiles_other_way():
    numbers = PhoneProfile(profile="moto-g3", scanner={"interval_ms": 100, "window_ms": 50})  # type: ignore[arg-type]
    assert numbers.scanner == Scanner(interval_ms=100, window_ms=50)
    mode = PhoneProfile(profile="slow-phone", scanner={"mode": "android-2023-balanced"})  # type: ignore[arg-type]
    assert mode.scanner == Scanner(mode="android-2023-balanced")
    kept = PhoneProfile(profile="slow-phone", scanner={"window_ms": 300})  # type: ignore[arg-type]
    assert kept.scanner == Scanner(interval_ms=2000, window_ms=300)


def test_a_whole_part_from_python_replaces_the_profiles():
    phone = PhoneProfile(profile="moto-g3", receiver=Receiver(noise_db=1.0))
    assert phone.receiver == Receiver(noise_db=1.0)


def test_any_presets_can_be_laid_under():
    presets = {"quiet": Propagation(path_loss_exponent=3.0, traffic_loss=0.25)}
    merged = over_preset({"environment": "quiet", "traffic_loss": 0.5}, "environment", presets)
    assert merged == {"environment": "quiet", "path_loss_exponent": 3.0, "traffic_loss": 0.5}
    assert over_preset("quiet", "environment", presets) == "quiet"


def test_changed_parameters_keep_the_presets(written):
    file = read_scenario(
        written(
            "radio: {environment: office}\n"
            "phones: {phone: {profile: moto-g3, scanner: {interval_ms: 90}}}\n"
        )
    )
    same = file.with_parameters(seed=3)
    assert same.scenario.phones == file.scenario.phones
    assert same.scenario.radio == file.scenario.radio
    other = file.with_parameters(radio=Propagation(path_loss_exponent=3.0))
    assert other.scenario.radio == Radio(path_loss_exponent=3.0)


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        (
            "phones:\n  phone:\n    height_m: 1.0\n    profile: nokia-3310\n",
            "scenario.yaml:5: phones.phone.profile: unknown; use one of nrf52-sniffer, moto-g3,",
        ),
        (
            "phones: {phone: {profile: 7}}\n",
            "scenario.yaml:2: phones.phone.profile: Input should be a valid string",
        ),
        (
            "radio:\n  path_loss_exponent: 2.0\n  environment: cathedral\n",
            "scenario.yaml:4: radio.environment: unknown; use one of hall, office",
        ),
        (
            "phones:\n  phone:\n    profile: moto-g3\n    receiver: {offset: 3}\n",
            "scenario.yaml:5: phones.phone.receiver.offset: unknown key",
        ),
    ],
)
def test_an_unknown_preset_is_told_with_its_line_and_the_known_ones(
    written, faults, more, expected
):
    (line,) = faults(written(more))
    assert line.startswith(expected)
