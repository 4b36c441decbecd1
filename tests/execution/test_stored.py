"""Values as bytes: they come back bit for bit, and nothing but data comes back."""

from __future__ import annotations

import io
import json
import math
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from casadi_hands.declared import Term, Weight
from casadi_hands.errors import SolveError
from casadi_hands.execution.journal import Journal
from casadi_hands.execution.stored import NotStoredError, pack, unpack
from casadi_hands.problem.si import build_model
from casadi_hands.task import load_task

PROBLEMS = sorted((Path(__file__).parents[2] / "problems").rglob("*.yaml"))


def forged(root: Any, nodes: Any, content: bytes = b"") -> bytes:
    file = io.BytesIO()
    np.savez(
        file,
        tree=np.frombuffer(json.dumps([root, nodes]).encode(), np.uint8),
        content=np.frombuffer(content, np.uint8),
    )
    return file.getvalue()


def test_values_come_back_as_they_were() -> None:
    shared = np.arange(6.0).reshape(2, 3)
    term = Term("slip", weights={"refine": Weight(2.0, "knot")})
    value = {"a": (1, True, None, "ü\n", -0.0, math.inf), "b": [shared, shared.T, term], (1, 2): np.float64(0.1 + 0.2)}
    found = unpack(pack(value))
    assert found["a"] == value["a"]
    assert math.copysign(1, found["a"][4]) == -1
    assert found["b"][2] == term
    assert type(found["b"][2].weights["refine"]) is Weight
    assert type(found[1, 2]) is np.float64
    assert found[1, 2] == 0.1 + 0.2
    assert math.isnan(unpack(pack(math.nan)))
    for array in (np.array(["a", "längst"]), np.array([True, False]), np.array(3), np.zeros((0, 3)), np.uint8([7])):
        again = unpack(pack([array]))[0]
        np.testing.assert_array_equal(again, array, strict=True)
        assert again.flags.writeable
    np.testing.assert_array_equal(found["b"][1], shared.T)
    same = unpack(pack((shared, [shared])))
    assert same[0] is same[1][0]


def test_arrays_lie_in_memory_as_they_did(rng: np.random.Generator) -> None:
    cube = rng.normal(size=(2, 3, 4))
    for array in (
        cube,
        cube.T,
        cube.transpose(1, 0, 2),
        cube.transpose(2, 0, 1),
        cube[0, 0, 0],
        np.zeros((0, 3)),
        cube[:1],
    ):
        found = unpack(pack(array))
        assert found.tobytes("A") == array.tobytes("A")
        assert (found.flags.c_contiguous, found.flags.f_contiguous) == (
            array.flags.c_contiguous,
            array.flags.f_contiguous,
        )
        long = [k for k in range(array.ndim) if array.shape[k] > 1]
        order = sorted(long, key=lambda axis: array.strides[axis])
        assert order == sorted(long, key=lambda axis: found.strides[axis])


@pytest.mark.parametrize("file", PROBLEMS, ids=lambda path: path.stem)
def test_the_model_of_any_task_comes_back(file: Path) -> None:
    model = build_model(load_task(file))
    found = unpack(pack(model))
    assert pack(found) == pack(model)
    assert repr(found) == repr(model)


def test_nothing_that_runs_comes_back(tmp_path: Path) -> None:
    harm = tmp_path / "harm"

    class Harmful:
        def __reduce__(self) -> Any:
            return Path.touch, (harm,)

    arrays = io.BytesIO()
    np.savez(arrays, tree=np.array([Harmful()], object))
    for data in (
        pickle.dumps(Harmful()),
        arrays.getvalue(),
        forged([0], [["object", ["os", "system"], {"command": f"touch {harm}"}]]),
        forged([0], [["object", ["casadi_hands.nlp.machine_code", "subprocess"], {}]]),
        forged([0], [["object", ["casadi_hands.export.folder", "remove_design"], {"directory": "."}]]),
        forged([3], []),
        forged([0], [["list", [[0]]]]),
        forged([0], [["array", "|O", 0, [1], [0]]], bytes(8)),
        forged([0], [["array", "<f8", 0, [2], [0]]], bytes(8)),
        forged([0], [["array", "<f8", -8, [1], [0]]], bytes(8)),
        forged([0], [["array", "<f8", 0, [2**62, 2**62], [0, 1]]], bytes(8)),
        forged([0], [["array", "<U0", 0, [2**62], [0]]], bytes(8)),
        pack([1.0, 2.0])[:-7],
        b"",
    ):
        with pytest.raises(NotStoredError):
            unpack(data)
    assert not harm.exists()
    with pytest.raises(TypeError, match=r"pathlib.PosixPath cannot be stored"):
        pack(harm)


def test_a_unit_that_is_kept_is_not_done_again(tmp_path: Path) -> None:
    done: list[str] = []

    def work(name: str) -> np.ndarray:
        done.append(name)
        return np.array([len(done)])

    first = Journal(tmp_path / "units")
    assert [first.once(name, lambda name=name: work(name))[0] for name in ("a", "b", "c")] == [1, 2, 3]
    (tmp_path / "units/002-000.npz").write_bytes((tmp_path / "units/002-000.npz").read_bytes()[:100])
    again = Journal(tmp_path / "units")
    # The second is truncated, the third was another.
    assert [again.once(name, lambda name=name: work(name))[0] for name in ("a", "b", "d")] == [1, 4, 5]
    assert done == ["a", "b", "c", "b", "d"]
    again.forget()
    assert not (tmp_path / "units").exists()


def test_without_a_folder_nothing_is_kept_and_what_cannot_be_kept_is_told(tmp_path: Path) -> None:
    journal, value = Journal(), object()
    assert journal.once("a", lambda: value) is value
    (tmp_path / "file").write_text("")
    with pytest.raises(SolveError, match="cannot write what is finished here"):
        Journal(tmp_path / "file" / "units").once("a", lambda: 1)
