"""The stiffness that rolling asks for, against what two fingertips on an object are by hand."""

import numpy as np
import pytest

from casadi_hands.geometry.bodies import KINDS
from casadi_hands.placement.loads import Contacts
from casadi_hands.placement.stability import needed_stiffness, shape_operators
from casadi_hands.placement.surface import Spots

SQUEEZE = np.array([[-2.0, 0, 0], [2.0, 0, 0]])


def stiffness(half: float, radius: float, tip: float, force: np.ndarray = SQUEEZE) -> float:
    """Of two fingertips that squeeze a capsule of some half length at its ends."""
    body = KINDS["capsule"](np.array([radius - half, 0, 0]), np.array([half - radius, 0, 0]), radius)
    points = np.array([[half, 0, 0], [-half, 0, 0]])
    on = Spots(points, points / half, np.zeros(2, int))
    contacts = Contacts.of(on.points, on.normals, 0.5, 0.0)
    shapes = shape_operators([body], on, contacts.frames, 1e-4)
    return needed_stiffness(points, contacts, np.arange(2), shapes, tip, force)


@pytest.mark.parametrize(("half", "radius", "tip"), [(1.0, 1.0, 0.2), (1.0, 0.3, 0.2), (2.0, 0.5, 5.0)])
def test_a_squeeze_between_fingertips(half: float, radius: float, tip: float) -> None:
    # Turned by w, each force's lever is w (half - rolled); each spring turns back with its stiffness × half² w.
    rolled = radius * tip / (radius + tip)
    assert stiffness(half, radius, tip) == pytest.approx(2.0 * (half - rolled) / half**2, rel=1e-3)


def test_what_pulls_needs_none() -> None:
    assert stiffness(1.0, 0.3, 0.2, -SQUEEZE) == 0


def test_shape_operators() -> None:
    capsule = KINDS["capsule"](np.array([0, 0, -1.0]), np.array([0, 0, 1.0]), 0.5)
    on = Spots(np.array([[0.5, 0, 0]]), np.array([[1.0, 0, 0]]), np.zeros(1, int))
    frames = np.array([[[-1.0, 0, 0], [0, 1, 0], [0, 0, 1]]])
    assert shape_operators([capsule], on, frames, 1e-3)[0] == pytest.approx(np.diag([2.0, 0.0]), abs=1e-3)
