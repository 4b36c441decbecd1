"""A task file's primitives: which there are, and that they are the bodies they give."""

import numpy as np
import pytest

from casadi_hands.geometry.bodies import KINDS
from casadi_hands.task import Capsule, Sphere
from casadi_hands.task.shapes import SECTIONS


def test_every_body_has_its_section() -> None:
    assert list(SECTIONS) == [*KINDS, "mesh"]
    for name, section in SECTIONS.items():
        assert section.__name__.lower() == name
        assert all(field.description for field in section.model_fields.values())


def test_body_is_the_primitive_in_numbers() -> None:
    ball = Sphere(center=(1, 2, 3), radius=0.5).body
    assert isinstance(ball, KINDS["sphere"])
    assert ball.parameters == pytest.approx([1, 2, 3, 0.5])
    rod = Capsule(start=(1, 2, 3), end=(4, 5, 6), radius=0.5).body
    assert isinstance(rod, KINDS["capsule"])
    assert rod.parameters == pytest.approx([1, 2, 3, 4, 5, 6, 0.5])


def test_a_primitive_is_written_under_its_name() -> None:
    written = Capsule(start=(1, 2, 3), end=(4, 5, 6), radius=0.5).model_dump()
    assert written == {"capsule": {"start": (1, 2, 3), "end": (4, 5, 6), "radius": 0.5}}


def test_moved() -> None:
    assert Sphere(center=(1, 2, 3), radius=0.5).moved(np.array([1, 0, -1])).center == (2, 2, 2)
    moved = Capsule(start=(0, 0, 0), end=(0, 0, 1), radius=0.5).moved(np.array([1, 0, -1]))
    assert (moved.start, moved.end) == ((1, 0, -1), (1, 0, 0))


def test_balls_and_boxes_are_about_the_origin_unless_their_middle_is_given() -> None:
    for name, half in (("sphere", (0.5, 0.5, 0.5)), ("box", (0.5, 1, 1.5))):
        body = SECTIONS[name](**({"radius": 0.5} if name == "sphere" else {"size": (1, 2, 3)}))
        assert np.array(body.bounding_box) == pytest.approx(np.array([np.negative(half), half]))
