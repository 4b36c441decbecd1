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


def test_the_least_missing_is_the_distance_of_the_cone_in_the_largest_component() -> None:
    edges = np.array([[1.0, 0.0], [0.0, 1.0]])
    assert programmes.least_missing(edges, np.array([2.0, 3.0])) == pytest.approx(0.0, abs=1e-9)
    assert programmes.least_missing(edges, np.array([2.0, -3.0])) == pytest.approx(3.0)
    # The nearest on the ray through (1, 1) to (3, 1) is (2, 2).
    assert programmes.least_missing(np.array([[1.0], [1.0]]), np.array([3.0, 1.0])) == pytest.approx(1.0)
