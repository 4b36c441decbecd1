"""Files from anybody: what is large, or no file, is refused before it is read, and in bounded time and memory."""

from __future__ import annotations

import io
import json
import os
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest

from casadi_hands.errors import DesignError, HandsError, printable
from casadi_hands.problem.si import build_model
from casadi_hands.problem.stored import LARGEST_ARRAYS, LARGEST_TEXT, most_samples, read_arrays, read_json, read_text
from casadi_hands.task import parse_task
from tests.export.example import TASK


def header(kind: str, shape: tuple[int, ...]) -> bytes:
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(file, {"descr": kind, "fortran_order": False, "shape": shape})
    return file.getvalue()


def archive(path: Path, packing: int = zipfile.ZIP_DEFLATED, **members: bytes) -> Path:
    with zipfile.ZipFile(path, "w", packing) as file:
        for name, content in members.items():
            file.writestr(f"{name}.npy", content)
    return path


def refused(path: Path, why: str) -> None:
    """The file is refused in a sentence, in a few times the memory of the largest that is not."""
    tracemalloc.start()
    try:
        with pytest.raises(DesignError, match=why) as caught:
            read_arrays(path, ("time",))
        assert tracemalloc.get_traced_memory()[1] < 3 * LARGEST_ARRAYS
    finally:
        tracemalloc.stop()
    assert "\n" not in str(caught.value)


def test_plain_arrays_are_read_as_numpy_reads_them(tmp_path: Path) -> None:
    given = {
        "a": np.arange(6.0).reshape(2, 3),
        "b": np.asfortranarray(np.arange(6).reshape(2, 3)),
        "c": np.array(["x", "long"]),
        "d": np.array([True, False]),
        "e": np.zeros((3, 0), ">f4"),
    }
    for save in (np.savez, np.savez_compressed):
        save(tmp_path / "a.npz", allow_pickle=False, **given)
        found = read_arrays(tmp_path / "a.npz", (*given, "none"))
        assert found.keys() == given.keys()
        for name, array in given.items():
            assert found[name].dtype == array.dtype
            np.testing.assert_array_equal(found[name], array)


def test_what_unpacks_to_more_than_any_motion_is_not_unpacked(tmp_path: Path) -> None:
    bomb = archive(tmp_path / "bomb.npz", time=header("<f8", (150_000_000,)) + bytes(200 << 20))
    assert bomb.stat().st_size < 1 << 20
    refused(bomb, r"unpacked it takes more than 32 MB")
    # The directory lies about how much it is, here and in the entry's own header.
    content = bomb.read_bytes().replace(
        (len(header("<f8", (150_000_000,))) + (200 << 20)).to_bytes(4, "little"), b"\0\1\0\0"
    )
    bomb.write_bytes(content)
    refused(bomb, r"not a NumPy archive|says that it has the shape")


def test_headers_are_held_against_what_is_there(tmp_path: Path) -> None:
    for kind, shape, why in (
        ("<f8", (10**12, 3), "says that it has the shape"),
        ("<f8", (-1, 3), "says that it has the shape"),
        ("<U0", (10**12,), "says that it has the shape"),
        ("<U100000000", (3,), "says that it has the shape"),
        ("|O", (8,), "holds object, not real numbers"),
        ("<c16", (4,), "holds complex128, not real numbers"),
        ("<M8[s]", (8,), "not real numbers"),
        ("|V8", (8,), "not real numbers"),
    ):
        refused(archive(tmp_path / "a.npz", time=header(kind, shape) + bytes(64)), why)
    refused(archive(tmp_path / "a.npz", time=b"\x93NUMPY\x03\x00" + bytes(64)), "version of NumPy's format")
    refused(archive(tmp_path / "a.npz", time=b""), "not a NumPy archive")


def test_words_can_be_printed_and_are_short(tmp_path: Path) -> None:
    for word, why in (("\x1b[2J", "control characters"), ("w" * 300, "more than 200 letters")):
        np.savez(tmp_path / "a.npz", time=np.array([word]))
        refused(tmp_path / "a.npz", why)


def test_archives_of_many_files_or_of_other_packing_are_refused(tmp_path: Path) -> None:
    refused(archive(tmp_path / "a.npz", **{f"a{i}": b"" for i in range(2000)}), "holds more files than any motion")
    for packing in (zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA):
        refused(archive(tmp_path / "a.npz", packing, time=header("<f8", (1,)) + bytes(8)), "packed in a way")
    good = archive(tmp_path / "a.npz", time=header("<f8", (1,)) + bytes(8)).read_bytes()
    for length in range(0, len(good), 7):
        (tmp_path / "a.npz").write_bytes(good[:length])
        refused(tmp_path / "a.npz", "not a NumPy archive")


def test_what_is_no_file_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "zeros").symlink_to("/dev/zero")
    (tmp_path / "large").touch()
    os.truncate(tmp_path / "large", 4 << 30)
    for name, why in (("pipe", "is no file"), ("zeros", "is no file"), (".", "is no file"), ("none", "missing")):
        with pytest.raises(DesignError, match=why):
            read_text(tmp_path / name)
    with pytest.raises(DesignError, match=f"larger than {LARGEST_TEXT >> 20} MB"):
        read_text(tmp_path / "large")
    (tmp_path / "latin").write_bytes("é".encode("latin-1"))
    with pytest.raises(DesignError, match=r"not text in UTF-8: .* at byte 0"):
        read_text(tmp_path / "latin")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("{", "cannot be read"),
        ("[" * 100_000, "recursion"),
        ('{"a": NaN}', "it holds NaN, not a finite number"),
        ('{"a": 1e999}', "it holds 1e999"),
        ('{"a": 1, "a": 2}', "it gives 'a' twice"),
        ('"\\ud800"', "surrogates not allowed"),
        ("9" * 5000, "cannot be read"),
    ],
)
def test_json_is_strict(text: str, why: str, tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(DesignError, match=why):
        read_json(tmp_path / "a.json")
    (tmp_path / "a.json").write_text('{"a": [1, 2.5, null, "é"]}', encoding="utf-8")
    assert read_json(tmp_path / "a.json") == {"a": [1, 2.5, None, "é"]}


def test_a_motion_may_have_a_few_times_the_samples_of_its_task() -> None:
    task = parse_task(TASK, "example.yaml")
    planned = len(build_model(task).schedule.samples)
    assert 8 * planned <= most_samples(task) <= 20 * planned


def test_messages_can_be_printed_and_end() -> None:
    assert printable("a\nb é") == "a\nb é"
    assert printable("\x1b[2J\0\u202e\x7f") == "\\x1b[2J\\x00\\u202e\\x7f"
    long = str(HandsError("begin " + 10**6 * "x"))
    assert long.startswith("begin xxx")
    assert len(long) < 2000
    error = DesignError(json.dumps("\x1b" * 9000))
    assert str(type(error)(*error.args)) == str(error)  # as when it comes from another process
