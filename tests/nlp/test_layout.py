"""Named arrays in a vector, and rows of linear expressions, against plain NumPy."""

import numpy as np
import pytest

from casadi_hands.nlp import Layout, Rows

RANDOM = np.random.default_rng(0)


def example() -> Layout:
    layout = Layout()
    layout.add("pose", (4, 6))
    layout.add("scalar", (1,))
    layout.add("force", (3, 2))
    return layout


def test_unpack_undoes_pack() -> None:
    layout = example()
    values = {name: RANDOM.normal(size=layout[name].shape) for name in layout.names()}
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


def test_rows_read_combine_take_and_split() -> None:
    indices = RANDOM.permutation(12).reshape(4, 3)
    x, weights = RANDOM.normal(size=12), RANDOM.normal(size=(5, 4))
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


def test_rows_beside_each_other_have_the_entries_of_all() -> None:
    x = RANDOM.normal(size=20)
    first, second = RANDOM.permutation(20)[:12].reshape(4, 3), RANDOM.permutation(20)[:8].reshape(4, 2)
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
