"""Trials are kept, resumed, shared by processes, and end in files that agree."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from blesim.cli import app
from blesim.errors import DataError, UsageError
from blesim.report.rerun_page import as_dict, write_reruns
from blesim.reruns import registry, run
from blesim.reruns.base import Change, Curve, Expected, Key, Picture, Published, Trial
from blesim.reruns.trials_on_disk import Task, TrialStore

NEAR, FAR = (Key("table 1", row, "mean [m]") for row in ("near | first", "far"))
OURS = Key("table 1", "ours", "mean [m]")


class Experiment:
    paper = "tiny"
    title = "Two numbers & a picture"
    published = (Published(key=NEAR, value=1.0), Published(key=FAR, value=3.0))
    expected = (Expected(better=NEAR, worse=FAR, condition="same walk", strong=True),)
    more = 0.0

    def __init__(self):
        self.done = []

    def trial(self, seed, *, pictures=False):
        if not pictures:
            self.done.append(seed)
        line = Curve(label="error", x=np.arange(3.0), y=np.array([0.0, 0.5, 1.0]))
        drawn = Picture(
            name="cdf",
            title="Errors",
            x_label="error [m]",
            y_label="share [-]",
            kind="step",
            curves=(line,),
        )
        numbers = {NEAR: 1.0 + 0.1 * seed, FAR: 2.0 + 0.1 * seed + self.more, OURS: float("nan")}
        return Trial(numbers=numbers, pictures=(drawn,) if pictures else ())

    def overview(self, numbers):
        return (
            Picture(
                name="seeds",
                title="All seeds",
                x_label="seed [-]",
                y_label="error [m]",
                kind="line",
                curves=(Curve(label="", x=np.arange(len(numbers[NEAR])), y=numbers[NEAR]),),
            ),
        )


@pytest.fixture
def tiny(monkeypatch):
    experiment = Experiment()
    monkeypatch.setattr(run, "experiment_of", lambda _: experiment)
    return experiment


def store(tmp_path, version="1"):
    return TrialStore(folder=tmp_path, version=version)


def test_a_run_resumes_where_it_stopped(tiny, tmp_path):
    tasks = run.tasks_of(["tiny"], 3)
    assert tasks == [("tiny", 1, ""), ("tiny", 2, ""), ("tiny", 3, "")]
    first = run.trials(tasks, store(tmp_path))
    next(first)
    next(first)
    first.close()
    assert tiny.done == [1, 2]
    assert list(run.trials(tasks, store(tmp_path))) == tasks
    assert tiny.done == [1, 2, 3]


def test_trials_of_another_version_do_not_count(tiny, tmp_path):
    tasks = run.tasks_of(["tiny"], 1)
    list(run.trials(tasks, store(tmp_path)))
    list(run.trials(tasks, store(tmp_path, version="2")))
    assert tiny.done == [1, 1]
    with pytest.raises(DataError, match="1 trials of tiny are missing"):
        run.summarised("tiny", 1, store(tmp_path, version="3"))


@pytest.mark.usefixtures("tiny")
@pytest.mark.parametrize(
    "damage",
    [
        lambda _: "{",
        lambda _: json.dumps([]),
        lambda _: json.dumps(None),
        lambda told: json.dumps({**told, "numbers": None}),
        lambda told: json.dumps({**told, "numbers": [{"key": ["table 1"], "value": 1.0}]}),
        lambda told: json.dumps({**told, "numbers": [{"key": list(NEAR), "value": "x"}]}),
        lambda told: json.dumps({**told, "seed": 2}),
    ],
)
def test_a_damaged_trial_is_told(tmp_path, damage):
    tasks = run.tasks_of(["tiny"], 1)
    list(run.trials(tasks, store(tmp_path)))
    (path,) = tmp_path.rglob("*.json")
    path.write_text(damage(json.loads(path.read_text(encoding="utf-8"))), encoding="utf-8")
    with pytest.raises(DataError, match="delete it to do it again"):
        list(run.trials(tasks, store(tmp_path)))


def test_a_folder_that_takes_no_trials_is_told_before_the_work(tiny, tmp_path, monkeypatch):
    tasks = run.tasks_of(["tiny"], 1)
    (tmp_path / "trials").write_text("", encoding="utf-8")
    with pytest.raises(UsageError, match="tiny: cannot be made"):
        list(run.trials(tasks, store(tmp_path)))
    (tmp_path / "trials").unlink()
    monkeypatch.setattr("os.access", lambda *_: False)
    with pytest.raises(UsageError, match="cannot be written to; give another folder"):
        list(run.trials(tasks, store(tmp_path)))
    assert tiny.done == []


@pytest.mark.usefixtures("tiny")
def test_a_number_that_one_seed_lacks_is_told(tmp_path):
    list(run.trials(run.tasks_of(["tiny"], 2), store(tmp_path)))
    numbers = store(tmp_path).load(Task("tiny", 2))
    store(tmp_path).save(Task("tiny", 2), {**numbers, FAR: float("nan")})
    with pytest.raises(DataError, match="tiny, seed 2: no number for table 1 / far / mean"):
        run.summarised("tiny", 2, store(tmp_path))


@pytest.mark.usefixtures("tiny")
def test_numbers_survive_the_disk(tmp_path):
    list(run.trials(run.tasks_of(["tiny"], 1), store(tmp_path)))
    found = store(tmp_path).load(Task("tiny", 1))
    assert found[NEAR] == 1.1
    assert np.isnan(found[OURS])


@pytest.mark.usefixtures("tiny")
def test_the_files_hold_every_number_and_picture(tmp_path):
    list(run.trials(run.tasks_of(["tiny"], 3), store(tmp_path)))
    rerun = run.summarised("tiny", 3, store(tmp_path))
    write_reruns([rerun], tmp_path)
    told = json.loads((tmp_path / "reruns.json").read_text(encoding="utf-8"))
    assert told == as_dict([rerun])
    near, far, ours = told["figures"]
    assert (near["table"], near["row"], near["column"]) == NEAR
    assert near["simulated"] == pytest.approx(1.2)
    assert near["low"] < 1.2 < near["high"]
    assert near["ratio"] == pytest.approx(1.2)
    assert far["published"] == 3.0
    assert ours["simulated"] is None
    (ordering,) = told["orderings"]
    assert ordering["held"] is True
    assert ordering["published_difference"] == -2.0
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") == 2
    assert "Two numbers &amp; a picture" in page
    assert "src='http" not in page
    text = (tmp_path / "reruns.md").read_text(encoding="utf-8")
    assert "| table 1 | near / first | mean [m] | 1.2 |" in text
    assert (tmp_path / "tiny-cdf.png").is_file()


def test_a_number_that_no_trial_gives_is_told(tiny, tmp_path):
    missing = Published(key=Key("table 9", "x", "y"), value=1.0)
    tiny.published = (*Experiment.published, missing)
    list(run.trials(run.tasks_of(["tiny"], 1), store(tmp_path)))
    with pytest.raises(DataError, match="seed 1: no number for table 9 / x / y"):
        run.summarised("tiny", 1, store(tmp_path))


@pytest.mark.usefixtures("tiny")
def test_dask_workers_give_the_same_numbers(tmp_path):
    distributed = pytest.importorskip("distributed")
    cluster = distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
    )
    tasks = run.tasks_of(["tiny"], 2)
    with cluster:
        list(run.trials(tasks, store(tmp_path / "dask"), scheduler=cluster.scheduler_address))
    list(run.trials(tasks, store(tmp_path / "here")))
    for task in tasks:
        there, here = (store(tmp_path / name).load(task) for name in ("dask", "here"))
        assert there[NEAR] == here[NEAR]


def test_unknown_papers_are_refused_by_name():
    with pytest.raises(UsageError, match="there is no paper 'moon'; there is aisle-graph"):
        registry.experiment_of("moon")
    assert CliRunner().invoke(app, ["rerun", "aisle-graph", "--seeds", "0"]).exit_code == 2


def test_the_version_changes_with_the_sources():
    assert run.version_text() == run.version_text()
    assert "numpy" in run.version_text()


def changed_tiny():
    otherwise = Experiment()
    otherwise.more = 0.5
    return Change(name="Half a metre more", why="To see.", experiment=otherwise, shown=(NEAR, FAR))


@pytest.mark.usefixtures("tiny")
def test_what_a_change_does_is_told_seed_by_seed(tmp_path, monkeypatch):
    change = changed_tiny()
    monkeypatch.setattr(run, "changes_of", lambda _: (change,))
    monkeypatch.setattr(run, "change_of", lambda *_: change)
    tasks = run.tasks_of(["tiny"], 3, what_if=True)
    assert [task.change for task in tasks] == [""] * 3 + ["half-a-metre-more"] * 3
    list(run.trials(tasks, store(tmp_path)))
    rerun = run.summarised("tiny", 3, store(tmp_path), pictures=False, what_if=True)
    near, far = rerun.changed[0].figures
    assert near.difference == 0.0
    assert far.simulated == pytest.approx(2.7)
    # The seeds differ, by how much the change makes is the same in each.
    assert far.high > far.low
    assert far.difference_low == pytest.approx(0.5) == pytest.approx(far.difference_high)
    write_reruns([rerun], tmp_path)
    told = json.loads((tmp_path / "reruns.json").read_text(encoding="utf-8"))
    assert [each["change"] for each in told["changes"]] == ["Half a metre more"] * 2
    text = (tmp_path / "reruns.md").read_text(encoding="utf-8")
    assert "| Half a metre more | To see. | 1.2 (0 to 0) | 2.7 (0.5 to 0.5) |" in text
    assert "<td>Half a metre more</td>" in (tmp_path / "index.html").read_text(encoding="utf-8")


def test_a_change_is_found_by_its_short_name(monkeypatch):
    change = changed_tiny()
    monkeypatch.setattr(registry, "changes_of", lambda _: (change,))
    assert registry.change_of("tiny", "half-a-metre-more") is change
    with pytest.raises(UsageError, match="has no change 'moon'; it has half-a-metre-more"):
        registry.change_of("tiny", "moon")


@pytest.mark.parametrize("paper", registry.PAPERS)
def test_changes_have_names_of_their_own_and_show_numbers_that_there_are(paper):
    changes = registry.changes_of(paper)
    assert changes
    names = [change.short_name for change in changes]
    assert len(set(names)) == len(names)
    assert all(change.why.endswith(".") and change.shown for change in changes)
