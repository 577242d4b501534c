"""Estimators on the hall of philotuxo, and the tables of the docs; run this file to write them.

Every estimator that can do with readings, a survey and a venue without aisles runs on the four
tracks, fitted on the static points. Where the default settings ask for what the recording lacks,
the settings in `ALSO` are run.
"""

import re
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import pytest

import blesim
from blesim.dataset.exchange.philotuxo import read_philotuxo
from blesim.estimators.registry import GROUP, make_estimator
from blesim.estimators.run import fit, follow, missing_needs
from blesim.metrics.score import score, scored_walks
from blesim.recording import ALL_WALKS, Failure

PAGE = Path(blesim.__file__).parent / "docs" / "estimators.md"
SEED = 1
# The hall tells no channels; these do without.
ALSO = ("channel-ekf:separate=false",)
# Reference errors: medians of quick, untuned programs on the same tracks. [m]
NEAREST_M, CENTROID_M, LIKELIHOOD_M, FINGERPRINTS_M = 3.19, 2.55, 2.34, 1.92
BOUNDS_M = {
    "nearest-beacon": NEAREST_M,
    "weighted-centroid": CENTROID_M,
    "lateration": LIKELIHOOD_M,
    "pm-ekf": LIKELIHOOD_M,
    "nearest-fingerprints": FINGERPRINTS_M,
    "fp-ekf": FINGERPRINTS_M,
    "channel-ekf:separate=false": FINGERPRINTS_M,
}
HEADER = ("estimator", "median", "mean", "90 %", "readings without an estimate")
LACKING_HEADER = ("estimator", "needs")


def texts():
    """Estimators of blesim whose modules are there, and those of `ALSO`."""
    ours = {
        point.name
        for point in entry_points(group=GROUP)
        if point.module.startswith("blesim.") and find_spec(point.module)
    }
    return sorted([*ours, *(text for text in ALSO if text.partition(":")[0] in ours)])


def tried(folder):
    """Rows over all walks by estimator, and what those need that cannot run."""
    imported = read_philotuxo(folder)
    recording = imported.recording
    walks = scored_walks(recording)
    tracks, lacking = {}, {}
    for text in texts():
        label, estimator = make_estimator(text)
        needs = missing_needs(estimator.needs, recording, walks[0])
        if needs:
            lacking[label] = needs
            continue
        fitted = fit(estimator, recording)
        for walk in walks:
            tracks[label, walk.name] = (
                fitted
                if isinstance(fitted, Failure)
                else follow(fitted, recording.venue, walk, seed=SEED, label=label)
            )
    rows = score(recording, imported.truth, tracks)
    summaries = {row.estimator: row for row in rows if row.walk == ALL_WALKS}
    failures = {key: track.reason for key, track in tracks.items() if isinstance(track, Failure)}
    return SimpleNamespace(rows=summaries, lacking=lacking, failures=failures)


def table(header, rows):
    lines = [header, ("---",) * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def tables(hall):
    """Text of each table of the page, by its name."""
    errors = [(row.estimator, *_figures(row.summary)) for row in hall.rows.values()]
    lacking = [(label, ", ".join(needs)) for label, needs in hall.lacking.items()]
    return {"philotuxo": table(HEADER, errors), "lacking": table(LACKING_HEADER, lacking)}


def _figures(summary):
    if summary.median_m is None:
        return "-", "-", "-", "all"
    share = summary.unmatched / (summary.n + summary.unmatched)
    metres = (summary.median_m, summary.mean_m, summary.p90_m)
    return (*(f"{each:.2f}" for each in metres), f"{100 * share:.1f} %")


def between(name):
    return re.compile(rf"(?<=<!-- {name} -->\n\n).*?(?=\n\n<!-- end -->)", re.DOTALL)


@pytest.fixture(scope="module")
def hall(data_dir):
    return tried(data_dir("philotuxo"))


@pytest.mark.slow
def test_every_estimator_that_can_run_tracks_every_walk(hall):
    assert hall.failures == {}
    assert {"nearest-beacon", "pm-ekf", "fp-ekf", *ALSO} <= set(hall.rows)
    for row in hall.rows.values():
        assert row.summary.unmatched < 0.05 * row.summary.n, row.estimator


@pytest.mark.slow
@pytest.mark.parametrize(("label", "bound_m"), BOUNDS_M.items())
def test_the_median_error_is_no_worse_than_the_reference(hall, label, bound_m):
    if label not in texts():
        pytest.skip(f"{label} is not there")
    assert hall.rows[label].summary.median_m <= bound_m


@pytest.mark.slow
@pytest.mark.parametrize("name", ["philotuxo", "lacking"])
def test_the_page_holds_what_a_fresh_run_gives(hall, name):
    found = between(name).search(PAGE.read_text(encoding="utf-8"))
    assert found is not None
    assert found[0] == tables(hall)[name]


if __name__ == "__main__":
    text = PAGE.read_text(encoding="utf-8")
    data = Path(blesim.__file__).resolve().parents[2] / "shared" / "data"
    for name, fresh in tables(tried(data / "philotuxo")).items():
        text = between(name).sub(fresh, text)
    PAGE.write_text(text, encoding="utf-8")
