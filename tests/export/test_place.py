"""Folders that are written beside: whole or not at all, by one process at a time."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from casadi_hands.errors import DesignError
from casadi_hands.export import folder as folder_module
from casadi_hands.export import place
from casadi_hands.export.design import Design
from casadi_hands.export.folder import save_design
from casadi_hands.export.place import beside, owned, replace_folder
from tests.export.example import example_design


def filled(text: str, names: tuple[str, ...] = ("task.yaml", "result.json")) -> Callable[[Path], None]:
    """Writes files with a text."""

    def write(made: Path) -> None:
        for name in names:
            (made / name).parent.mkdir(exist_ok=True)
            (made / name).write_text(text)

    return write


def contents(folder: Path) -> dict[str, str]:
    return {each.name: each.read_text() for each in folder.iterdir() if each.is_file()}


def full_disk(*_: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@contextmanager
def owner(folder: Path) -> Iterator[subprocess.Popen[str]]:
    """Another process that owns a folder."""
    code = (
        "import sys, time; from pathlib import Path; from casadi_hands.export.place import owned\n"
        "with owned(Path(sys.argv[1])): print('owned', flush=True); time.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", code, str(folder)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        assert process.stdout.readline() == "owned\n"
        yield process
        process.kill()


def test_a_reader_finds_the_old_files_until_the_new_ones_are_all_there(tmp_path: Path) -> None:
    out = tmp_path / "new" / "out"
    replace_folder(out, filled("old", ("task.yaml", "scene.xml", "result.json")))
    seen = []

    def write(made: Path) -> None:
        filled("new")(made)
        seen.append(contents(out))

    replace_folder(out, write)
    assert seen == [{"task.yaml": "old", "scene.xml": "old", "result.json": "old"}]
    assert contents(out) == {"task.yaml": "new", "result.json": "new"}
    assert list(out.parent.iterdir()) == [out]


@pytest.mark.parametrize("exchanges", [True, False])
def test_what_is_not_a_design_s_stays(exchanges: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if not exchanges:
        monkeypatch.setattr(place, "exchange", full_disk)
    (tmp_path / "out/alternatives/seed1").mkdir(parents=True)
    (tmp_path / "out/alternatives/seed1/result.json").write_text("seed")
    (tmp_path / "out/notes.txt").write_text("mine")
    (tmp_path / "out").chmod(0o750)
    for text in ("first", "second"):
        replace_folder(tmp_path / "out", filled(text))
        assert contents(tmp_path / "out") == {"task.yaml": text, "result.json": text, "notes.txt": "mine"}
        assert (tmp_path / "out/alternatives/seed1/result.json").read_text() == "seed"
    assert (tmp_path / "out").stat().st_mode & 0o777 == 0o750
    assert list(tmp_path.iterdir()) == [tmp_path / "out"]


@pytest.mark.parametrize("exchanges", [True, False])
def test_meshes_go_with_their_design_and_others_stay(
    exchanges: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not exchanges:
        monkeypatch.setattr(place, "exchange", full_disk)
    out = tmp_path / "out"
    replace_folder(out, filled("first", ("meshes/object0.obj", "meshes/object1.obj", "result.json")))
    (out / "meshes/mine.obj").write_text("mine")
    replace_folder(out, filled("second", ("meshes/object0.obj", "result.json")))
    assert contents(out / "meshes") == {"object0.obj": "second", "mine.obj": "mine"}
    replace_folder(out, filled("third"))
    assert contents(out / "meshes") == {"mine.obj": "mine"}
    assert list(tmp_path.iterdir()) == [out]


def test_a_full_disk_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    example_design().save(tmp_path / "out")
    before = {each.name: each.read_bytes() for each in (tmp_path / "out").iterdir()}
    monkeypatch.setattr(folder_module, "write_page", full_disk)
    with pytest.raises(DesignError, match=r"cannot write the design here: No space left on device"):
        replace(example_design(), reason="another").save(tmp_path / "out")
    with pytest.raises(DesignError, match="No space left"):
        example_design().save(tmp_path / "new")
    assert {each.name: each.read_bytes() for each in (tmp_path / "out").iterdir()} == before
    assert list(tmp_path.iterdir()) == [tmp_path / "out"]


def test_a_name_that_no_folder_can_have_is_refused_in_a_short_message(tmp_path: Path) -> None:
    with pytest.raises(DesignError, match="cannot write the design here: File name too long") as found:
        example_design().save(tmp_path / ("n" * 300))
    assert len(str(found.value)) < 250
    longest = tmp_path / ("n" * 255)
    replace_folder(longest, filled("new"))
    replace_folder(longest, filled("newer"))
    assert contents(longest)["result.json"] == "newer"
    assert list(tmp_path.iterdir()) == [longest]


@pytest.mark.parametrize("denied", ["out", "parent"])
def test_folders_that_are_read_only(denied: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One that is itself is refused; in one whose parent is, all is done within."""
    out = tmp_path / "out"
    replace_folder(out, filled("old"))
    locked = out if denied == "out" else tmp_path
    real = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != locked and real(path, mode))
    if denied == "out":
        with pytest.raises(DesignError, match=r"cannot write the design here: Permission denied"):
            save_design(example_design(), out)
        assert contents(out)["result.json"] == "old"
    else:
        assert beside(out) == out / ".solve"
        replace_folder(out, filled("new"))
        assert contents(out) == {"task.yaml": "new", "result.json": "new"}
        assert not (out / ".solve").exists()


def test_two_processes_do_not_write_one_folder_and_a_dead_one_is_no_matter(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with owner(out) as process:
        with pytest.raises(DesignError, match=f"another solve \\(process {process.pid}\\) is writing here"):
            example_design().save(out)
        process.send_signal(signal.SIGKILL)
        process.wait()
    example_design().save(out)
    assert Design.load(out).hand == example_design().hand
    assert list(tmp_path.iterdir()) == [out]


@pytest.mark.parametrize("exchanged", [True, False])
def test_what_a_process_that_was_killed_was_writing_is_cleared_away(exchanged: bool, tmp_path: Path) -> None:
    """Before it changed places with the old one, or after, when what is not a design's is still in the old one."""
    out = tmp_path / "out"
    replace_folder(out, filled("complete"))
    left = beside(out) / "next-0"
    left.mkdir(parents=True)
    filled("left", ("task.yaml", "scene.xml"))(left)
    if exchanged:
        (left / "notes.txt").write_text("mine")
    with owned(out):
        pass
    assert contents(out) == {"task.yaml": "complete", "result.json": "complete"} | (
        {"notes.txt": "mine"} if exchanged else {}
    )
    assert list(tmp_path.iterdir()) == [out]


def test_a_reader_takes_a_folder_that_was_replaced_meanwhile_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, read = tmp_path / "out", folder_module.load_motion
    example_design().save(out)
    again = replace(example_design(), reason="again")

    def late(*given: Any) -> Any:
        monkeypatch.setattr(folder_module, "load_motion", read)
        again.save(out)
        return read(*given)

    monkeypatch.setattr(folder_module, "load_motion", late)
    assert Design.load(out).reason == "again"
