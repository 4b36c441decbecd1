"""Named arrays in a vector, and rows of linear expressions, against plain NumPy."""

import numpy as np
import pytest

from casadi_hands.nlp import Layout, Parameter, Problem, Rows
from casadi_hands.nlp.layout import Label


def example() -> Layout:
    layout = Layout()
    layout.add("pose", (4, 6))
    layout.add("scalar", (1,))
    layout.add("force", (3, 2))
    return layout


def test_unpack_undoes_pack(rng: np.random.Generator) -> None:
    layout = example()
    values = {name: rng.normal(size=layout[name].shape) for name in layout.names()}
    vector = layout.pack(values, np.zeros(layout.size))
    assert layout.size == 4 * 6 + 1 + 6
    assert sorted(vector) == sorted(np.concatenate([v.ravel() for v in values.values()]))
    for name, value in layout.unpack(vector).items():
        np.testing.assert_array_equal(value, values[name])


def test_pack_keeps_the_rest_broadcasts_and_copies() -> None:
    layout, start = example(), np.arange(31.0)
    packed = layout.pack({"force": [7, 8]}, start)
    np.testing.assert_array_equal(packed[:25], start[:25])
    np.testing.assert_array_equal(layout.unpack(packed)["force"], [[7, 8]] * 3)
    assert start[-1] == 30


def test_unknown_and_repeated_names_are_refused() -> None:
    layout = example()
    with pytest.raises(KeyError, match="'pse' is not one of pose, scalar, force"):
        layout.pack({"pse": 0.0}, np.zeros(layout.size))
    with pytest.raises(KeyError, match="'pose' is already in the layout"):
        layout.add("pose", (1, 1))
    assert "pose" in layout
    assert "pse" not in layout


def test_rows_read_combine_take_and_split(rng: np.random.Generator) -> None:
    indices = rng.permutation(12).reshape(4, 3)
    x, weights = rng.normal(size=12), rng.normal(size=(5, 4))
    rows = Rows.of(indices, 12)
    plain = x[indices]

    def read(rows: Rows) -> np.ndarray:
        return (rows.matrix @ x).reshape(rows.count, rows.width)

    np.testing.assert_array_equal(read(rows), plain)
    np.testing.assert_allclose(read(rows.combine(weights)), weights @ plain, atol=1e-14)
    np.testing.assert_array_equal(read(rows.take([2, 2, 0])), plain[[2, 2, 0]])
    np.testing.assert_array_equal(read(rows.entries(1, 3)), plain[:, 1:3])
    np.testing.assert_array_equal(read(rows.constant(3)), plain[[0, 0, 0]])
    np.testing.assert_allclose(
        read(rows.combine(weights).entries(0, 2).take([4])), (weights @ plain)[[4], :2], atol=1e-14
    )


def test_rows_beside_each_other_have_the_entries_of_all(rng: np.random.Generator) -> None:
    x = rng.normal(size=20)
    first, second = rng.permutation(20)[:12].reshape(4, 3), rng.permutation(20)[:8].reshape(4, 2)
    rows = Rows.beside([Rows.of(first, 20), Rows.of(second, 20), Rows.of(first, 20).entries(1, 2)])
    assert (rows.count, rows.width) == (4, 6)
    np.testing.assert_array_equal((rows.matrix @ x).reshape(4, 6), np.hstack([x[first], x[second], x[first][:, 1:2]]))


def test_rows_of_no_instance_keep_their_width() -> None:
    rows = Rows.of(np.arange(12).reshape(4, 3), 12)
    none = rows.take([])
    assert (none.count, none.width) == (0, 3)
    assert (none.entries(1, 3).count, none.entries(1, 3).width) == (0, 2)
    assert Rows.beside([none, none.entries(0, 1)]).width == 4


def test_offsets_go_along_with_the_rows_they_are_added_to() -> None:
    rng = np.random.default_rng(0)
    x, weights, added = rng.normal(size=6), rng.normal(size=(4, 3)), rng.normal(size=(3, 2))
    rows = Rows.of(np.arange(6).reshape(3, 2), 6).plus(added)

    def values(of: Rows) -> np.ndarray:
        return (of.matrix @ x + of.offset).reshape(of.count, of.width)

    expected = x.reshape(3, 2) + added
    np.testing.assert_allclose(values(rows), expected)
    np.testing.assert_allclose(values(rows.plus(added)), expected + added)
    np.testing.assert_allclose(values(rows.combine(weights)), weights @ expected)
    np.testing.assert_allclose(values(rows.take([2, 0, 2])), expected[[2, 0, 2]])
    np.testing.assert_allclose(values(rows.entries(1, 2)), expected[:, 1:])
    np.testing.assert_allclose(values(Rows.beside([rows, rows.entries(0, 1)])), np.hstack([expected, expected[:, :1]]))
    np.testing.assert_allclose(values(rows.constant(2)), expected[[0, 0]])


# What rows and parameters are.


def test_rows_keep_what_they_are_and_tell_when() -> None:
    label = Label("pose", owner=3)
    rows = Rows.of(np.arange(12).reshape(4, 3), 12, label)
    assert rows.label == label
    for same in (rows.plus(np.ones((4, 3))), rows.entries(1, 2), rows.combine(np.eye(4))):
        assert same.label == label
    # The mark grows with what is taken, and with the offset that a combination is said to have.
    assert rows.take([1, 2]).label == Label("pose", 3, 1.5)
    assert rows.take([2, 2]).entries(0, 1).plus(np.ones((2, 1))).label == Label("pose", 3, 2.0)
    assert rows.take([1, 2]).combine(np.eye(2), when=-1).label == Label("pose", 3, -1)
    assert rows.take([]).label == label
    # A single row is what it is at all times.
    single = Rows.of(np.arange(3)[None], 12, Label("base", 3))
    assert single.constant(4).label == single.take([0, 0]).label == Label("base", 3)
    assert Rows.beside([rows.take([0, 1]), rows.take([2, 3])]).label == Label("pose", 3, 0.5)
    assert Rows.of(np.arange(3)[None], 12).label == Label()


def test_parameters_read_take_and_split(rng: np.random.Generator) -> None:
    positions, label = rng.permutation(12).reshape(4, 3), Label("target", owner=1)
    target = Parameter(positions, label)
    assert target.shape == (4, 3)
    for taken, expected, mark in (
        (target.take([2, 2, 0]), positions[[2, 2, 0]], Label("target", 1, 4 / 3)),
        (target.take([]), positions[:0], label),
        (target.entries(1, 3), positions[:, 1:3], label),
        (target.take([1, 3]).entries(0, 1), positions[[1, 3], :1], Label("target", 1, 2.0)),
    ):
        np.testing.assert_array_equal(taken.positions, expected)
        assert taken.label == mark


def test_a_parameter_that_all_instances_share_is_taken_whole() -> None:
    shared = Parameter(np.array([[4, 5]]), Label("reference"))
    for taken in (shared.take([3, 7]), shared.take([])):
        np.testing.assert_array_equal(taken.positions, [[4, 5]])
        assert taken.label == Label("reference")


def test_a_problem_labels_what_it_declares_and_finds_parameters_again() -> None:
    problem = Problem()
    assert problem.variable("force_disturbed", (2, 3), quantity="force").label == Label("force")
    assert problem.variable("angles1", (2, 3), quantity="angles", owner=1).label == Label("angles", 1)
    assert problem.variable("pose", (2, 6)).label == Label("pose")
    friction, step = problem.parameter("friction", (1, 1)), problem.parameter("step", (2, 1))
    before = problem.parameter("palm_before", (2, 3), quantity="palm", owner=2, when=-1)
    assert (friction.label, before.label) == (Label("friction"), Label("palm", 2, -1))
    np.testing.assert_array_equal(before.positions, problem.parameters["palm_before"])
    assert problem["step"] is step
    assert problem.given("step", "friction") == {"step": step, "friction": friction}
    for find in (problem.given, problem.__getitem__):
        with pytest.raises(KeyError, match="stpe"):
            find("stpe")
