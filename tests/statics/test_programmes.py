"""Least squares over forces that may only push."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

from casadi_hands.statics import programmes


@pytest.mark.parametrize("gives_up", [False, True])
def test_a_nonnegative_fit_is_as_near_as_can_be(gives_up: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    def circles(*_: Any) -> Any:
        raise RuntimeError("Maximum number of iterations reached.")

    if gives_up:
        monkeypatch.setattr(programmes, "nnls", circles)
    rng = np.random.default_rng(0)
    for _ in range(5):
        matrix, wanted = rng.normal(size=(6, 4)), rng.normal(size=6)
        x, missing = programmes.nonnegative_fit(matrix, wanted)
        found = minimize(
            lambda x, a=matrix, b=wanted: ((a @ x - b) ** 2).sum(),
            np.ones(4),
            jac=lambda x, a=matrix, b=wanted: 2 * a.T @ (a @ x - b),
            bounds=[(0, None)] * 4,
            tol=1e-14,
        )
        assert (x >= 0).all()
        assert missing == pytest.approx(np.linalg.norm(matrix @ x - wanted), rel=1e-9)
        assert missing == pytest.approx(np.sqrt(found.fun), rel=1e-6)


def test_forces_oppose_each_other_where_no_direction_has_a_part_of_all() -> None:
    push = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    assert not programmes.opposes(push)
    assert not programmes.opposes(np.array([[1.0, -1.0], [0.1, 0.1], [0.0, 0.0]]))
    assert programmes.opposes(np.array([[1.0, -2.0], [0.0, 0.0], [0.0, 0.0]]))
    assert programmes.opposes(np.column_stack([push, [-1.0, -1.0, -1.0]]))


def test_a_fit_of_many_columns_is_the_fit_of_all_of_them() -> None:
    rng = np.random.default_rng(1)
    for part in (1.0, 0.2):  # of the sphere that columns point to: to all sides, and to one
        for _ in range(5):
            matrix, wanted = rng.normal(size=(6, 500)), rng.normal(size=6)
            matrix[0] = np.abs(matrix[0]) / part
            missing = programmes.least_missing(matrix, wanted)
            assert missing == pytest.approx(programmes.nonnegative_fit(matrix, wanted)[1], abs=1e-8)
            assert programmes.least_missing(matrix, wanted, missing + 0.1) <= missing + 0.1
    # The nearest on the ray through (1, 1) to (3, 1) is (2, 2).
    assert programmes.least_missing(np.ones((2, 1)), np.array([3.0, 1.0])) == pytest.approx(np.sqrt(2))
