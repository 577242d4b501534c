import os
import subprocess
import sys
from pathlib import Path

import pytest

from blesim import stopping
from blesim.errors import DataError, UsageError
from blesim.stopping import Stopped
from blesim.whole_file import whole_file, write_whole


def test_it_appears_when_the_block_ends_well(tmp_path):
    target = tmp_path / "a"
    target.write_bytes(b"old")
    with whole_file(target) as file:
        file.write(b"new")
        assert target.read_bytes() == b"old"
    assert target.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [target]


def test_a_fault_leaves_what_was_there(tmp_path):
    target = tmp_path / "a"
    target.write_bytes(b"old")
    with pytest.raises(ZeroDivisionError), whole_file(target) as file:
        file.write(b"%d" % (1 // len(target.read_bytes()[3:])))
    assert target.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [target]


def test_a_link_stays_and_its_target_is_written(tmp_path):
    (tmp_path / "folder").mkdir()
    target, link = tmp_path / "folder" / "a", tmp_path / "link"
    link.symlink_to(target)
    write_whole(link, b"new")
    assert link.is_symlink()
    assert target.read_bytes() == b"new"


def test_what_is_no_file_is_refused_and_stays(tmp_path):
    pipe, loop = tmp_path / "pipe", tmp_path / "loop"
    os.mkfifo(pipe)
    loop.symlink_to(loop)
    for path in (pipe, loop, tmp_path, tmp_path / "nowhere" / "a", tmp_path / ("a" * 300)):
        with pytest.raises(UsageError) as caught:
            write_whole(path, b"new")
        assert str(caught.value).startswith(f"{path}: ")
        assert "\n" not in str(caught.value)
    assert pipe.is_fifo()
    assert sorted(tmp_path.iterdir()) == [loop, pipe]


def test_a_device_is_refused():
    with pytest.raises(UsageError, match="/dev/null: is no regular file"):
        write_whole(Path("/dev/null"), b"new")


def test_parts_of_dead_processes_go_and_others_stay(tmp_path):
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    stale = tmp_path / f".a.{dead.pid}.part"
    others = [tmp_path / f".b.{dead.pid}.part", tmp_path / f".a.{os.getppid()}.part"]
    others.append(tmp_path / ".a.b.part")
    for path in (stale, *others):
        path.touch()
    write_whole(tmp_path / "a", b"")
    assert sorted(tmp_path.iterdir()) == sorted([*others, tmp_path / "a"])


def test_a_disk_that_fails_is_a_fault_of_the_data(tmp_path, monkeypatch):
    def full(_handle):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(DataError, match=r"a: cannot be written: No space left on device$"):
        write_whole(tmp_path / "a", b"new")
    assert list(tmp_path.iterdir()) == []


def test_a_wish_to_stop_that_was_swallowed_is_heard_before_the_file_appears(tmp_path, monkeypatch):
    monkeypatch.setattr(stopping, "_wished", False)
    with pytest.raises(Stopped):
        stopping.stop(15, None)
    with pytest.raises(Stopped):
        write_whole(tmp_path / "a", b"new")
    assert list(tmp_path.iterdir()) == []
