"""The presets against the recordings: fitted on one part, scored on another."""

import pytest

from blesim.fidelity.datasets import DATASETS
from blesim.fidelity.fit_hall import fit_hall
from blesim.fidelity.fit_library import fit_library
from blesim.fidelity.fit_rooms import (
    body_loss_db,
    channel_correlation_of,
    fit_room,
    spots,
    standing_of,
)
from blesim.fidelity.library_fit import LIBRARY
from blesim.fidelity.mitll_static import FITTED_PLACEMENTS, ROOMS, read_room
from blesim.fidelity.philotuxo import read_hall
from blesim.fidelity.scorecard import inside_count
from blesim.fidelity.uji_library import FITTED, read_library
from blesim.radio.environments import ENVIRONMENTS
from blesim.radio.fading import Fading
from blesim.venue.beacons import CHANNELS

SEED = 1


@pytest.mark.parametrize("name", DATASETS)
def test_nine_of_ten_statistics_are_inside(name, data_dir):
    scores = DATASETS[name](data_dir(name), None, SEED).scores
    assert len(scores) >= 12
    assert inside_count(scores) >= 0.9 * len(scores), [s.statistic for s in scores if not s.inside]


@pytest.mark.parametrize(
    ("name", "environment"), [("philotuxo", "hall"), ("mitll_static", "office")]
)
def test_white_gaussian_fading_does_not_look_like_the_world(name, environment, data_dir):
    white = ENVIRONMENTS[environment].model_copy(
        update={"fading": Fading(model="gaussian", standard_deviation_db=5.0)}
    )
    compare = DATASETS[name]
    right = inside_count(compare(data_dir(name), None, SEED).scores)
    wrong = compare(data_dir(name), white, SEED).scores
    assert inside_count(wrong) <= right - 4
    lost = {score.statistic.rpartition(": ")[2] for score in wrong if not score.inside}
    assert lost & {"variance explained by 3 levels", "step between packets"}


def test_the_hall_is_what_set_1_says(data_dir):
    preset = ENVIRONMENTS["hall"]
    points = read_hall(data_dir("philotuxo"), "set 1").point_links()
    fit = fit_hall(points, preset.fading.channel_correlation)
    assert preset.path_loss_exponent == pytest.approx(fit.path_loss_exponent, abs=0.01)
    assert preset.fading.rice_factor_db == pytest.approx(fit.rice_factor_db, abs=0.1)
    assert preset.shadowing.standard_deviation_db == pytest.approx(fit.shadowing_db, abs=0.1)
    assert preset.shadowing.decorrelation_m == pytest.approx(fit.decorrelation_m, abs=0.1)


def test_correlated_channels_could_not_differ_as_they_do(data_dir):
    points = read_hall(data_dir("philotuxo"), "set 1").point_links()
    assert fit_hall(points, 0.36).rice_factor_db == -20.0


@pytest.mark.parametrize("room", ROOMS)
def test_rooms_are_what_ear_and_back_pocket_say(room, data_dir):
    preset = ENVIRONMENTS[ROOMS[room][1]]
    cells = read_room(data_dir("mitll_static"), room, FITTED_PLACEMENTS)
    assert preset.people.body_loss_db == pytest.approx(body_loss_db(cells), abs=0.1)
    correlation = channel_correlation_of(cells)
    assert preset.fading.channel_correlation == pytest.approx(correlation, abs=0.01)
    # Multipath and sway trade off: the preset is as near as the best of the grid.
    real = standing_of([[cell.on(channel) for channel in CHANNELS] for cell in cells])
    best = fit_room(cells)
    people, fading = preset.people, preset.fading
    nearest = standing_of(list(spots(*best[1:4], correlation)))
    mine = standing_of(
        list(spots(fading.rice_factor_db, people.sway_m, people.sway_s, correlation))
    )
    assert real.distance(mine) <= real.distance(nearest) + 0.1


def test_the_library_is_what_campaign_2_says(data_dir):
    preset = ENVIRONMENTS["library"]
    assert LIBRARY.radio(preset) == preset
    fit = fit_library(read_library(data_dir("uji_library"), FITTED), preset, SEED)
    assert preset.path_loss_exponent == pytest.approx(fit.path_loss_exponent, abs=0.2)
    assert preset.shadowing.standard_deviation_db == pytest.approx(fit.shadowing_db, abs=0.4)
    assert preset.people.body_loss_db == pytest.approx(fit.body_loss_db, abs=0.4)
    assert preset.fading.rice_factor_db == pytest.approx(fit.rice_factor_db, abs=1.5)
    for name, phone in LIBRARY.phones.items():
        assert phone.offset_db == pytest.approx(fit.phones[name].offset_db, abs=1.5)
        assert phone.sensitivity_dbm == pytest.approx(fit.phones[name].sensitivity_dbm, abs=0.7)
