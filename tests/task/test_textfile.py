"""Files that are anything but task files: each is one message, at once."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from casadi_hands.errors import TaskError
from casadi_hands.task import load_task
from casadi_hands.task.textfile import LARGEST, read
from tests.task.test_bounds import HEAD


def message(path: Path | str) -> str:
    with pytest.raises(TaskError) as caught:
        load_task(path)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value).encode()) < 2000
    return str(caught.value)


def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    assert message(tmp_path / "pipe").endswith("pipe: is a pipe; give the path of a task file")


def test_an_endless_device() -> None:
    assert message("/dev/zero") == "/dev/zero: is a device; give the path of a task file"


def test_a_socket(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX) as server:
        server.bind("door")
        assert message("door").startswith("door: cannot be read: ")


def test_a_file_of_a_terabyte_is_not_read(tmp_path: Path) -> None:
    with (tmp_path / "large.yaml").open("wb") as file:
        file.truncate(10**12)
    assert "given a file of more than 1,000,000 bytes" in message(tmp_path / "large.yaml")


def test_the_largest_file_is_read(tmp_path: Path) -> None:
    (tmp_path / "large.yaml").write_text(HEAD + "#" * (LARGEST - len(HEAD)))
    assert load_task(tmp_path / "large.yaml").name == "large"


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-32"])
def test_other_encodings(encoding: str, tmp_path: Path) -> None:
    (tmp_path / "wide.yaml").write_text(HEAD, encoding=encoding)
    assert "in UTF-16 or UTF-32; a task file" in message(tmp_path / "wide.yaml")


@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_lines_end_in_any_way(newline: str, tmp_path: Path) -> None:
    file = tmp_path / "lines.yaml"
    file.write_bytes(b"\xef\xbb\xbf" + HEAD.replace("\n", newline).encode())
    assert read(file) == HEAD
    file.write_bytes(HEAD.replace("0.3]", "far]").replace("\n", newline).encode())
    assert "lines.yaml:2: palm.position[2]: given 'far'" in message(file)


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("x" * 300, "cannot be read: File name too long"),
        ("a/" * 3000, "cannot be read: File name too long"),
        ("a\0b", "a\\x00b: cannot be read: embedded null byte"),
        ("\x1b[31m.yaml", "\\x1b[31m.yaml: no such file"),
        ("", "is a directory"),
    ],
)
def test_odd_names(path: str, expected: str) -> None:
    assert expected in message(path)


def test_a_name_is_made_of_any_files(tmp_path: Path) -> None:
    file = tmp_path / os.fsdecode(b"a\x1b[31m\xff.yaml")
    file.write_text(HEAD)
    assert load_task(file).name == "a_[31m_"


@contextmanager
def without_privileges() -> Iterator[None]:
    """As a user from whom files can be kept: where root runs the tests, as nobody for as long."""
    root = os.geteuid() == 0
    if root:
        os.seteuid(65534)
    try:
        yield
    finally:
        if root:
            os.seteuid(0)


def test_no_permission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # By a name in the working folder: the folders above it may be kept from others, too.
    tmp_path.chmod(0o755)
    monkeypatch.chdir(tmp_path)
    for name, mode in (("open.yaml", 0o644), ("locked.yaml", 0)):
        Path(name).write_text(HEAD)
        Path(name).chmod(mode)
    load_task("open.yaml")  # modules that it imports may be kept from others, too
    with without_privileges():
        assert load_task("open.yaml").name == "open"
        assert message("locked.yaml").startswith("locked.yaml: cannot be read: Permission denied")


def test_links_in_a_circle(tmp_path: Path) -> None:
    (tmp_path / "round").symlink_to("round")
    assert "cannot be read: Too many levels of symbolic links" in message(tmp_path / "round")
