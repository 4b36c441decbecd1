"""Contacts stay on the faces where the task has them, off their edges."""

from __future__ import annotations

import numpy as np
import pytest

from casadi_hands.problem.model import Model
from casadi_hands.problem.si import build_model
from casadi_hands.stages.refine import faces
from casadi_hands.stages.refine.stage import RefineStage
from casadi_hands.task import parse_task

CRATE = """\
object: {mass: 0.05, shapes: [{box: {size: [0.04, 0.04, 0.06], edge_radius: 0.001}}]}
palm: {radius: 0.05, position: [0, 0, 0.2], facing: [0, 0, -1]}
motion: [{at: 0, position: [0, 0, 0.1]}, {at: 1, position: [0.01, 0, 0.1]}]
"""
FINGERS = "fingers: {left: {touches: [0.02, 0.005, 0]}, right: {touches: [-0.02, %s, 0]}}\n"
HALF = 0.02


def crate(right: float = 0.0) -> Model:
    return build_model(parse_task(CRATE + FINGERS % right))


def test_bounds_are_those_of_the_contacts_faces() -> None:
    model = crate()
    values = faces.parameters(model, (0, 1))
    count, edge = len(model.schedule.samples), 0.001
    for c in range(2):
        ways, reach = np.asarray(values[f"face_ways{c}"]), np.asarray(values[f"face_reach{c}"])
        assert ways.shape == (count, 12)
        assert np.ptp(ways, axis=0).max() == np.ptp(reach, axis=0).max() == 0
        np.testing.assert_allclose(np.abs(ways[0].reshape(4, 3)).sum(axis=0), [0, 2, 2], atol=1e-12)
        off = np.array([HALF, HALF, 0.03, 0.03]) - reach[0] * model.units.length
        assert np.all((off >= edge) & (off < 2 * edge))


def test_a_contact_that_the_task_has_on_an_edge_may_stay_there() -> None:
    values = faces.parameters(crate(right=0.0198), (0, 1))
    ways, reach = (np.asarray(values[f"{name}1"])[0] for name in ("face_ways", "face_reach"))
    free = np.flatnonzero(~ways.reshape(4, 3).any(axis=1))
    assert len(free) == 1
    assert reach[free] == 1


def test_each_touch_has_the_face_of_its_own_place(monkeypatch: pytest.MonkeyPatch) -> None:
    model = crate()
    patches = np.tile(model.keyframe_patches[:1], (len(model.schedule.keyframes), 1, 1))
    patches[-1, 0] = np.array([0.0, HALF, 0.0]) / model.units.length
    monkeypatch.setattr(Model, "keyframe_patches", patches)
    ways = np.asarray(faces.parameters(model, (0,))["face_ways0"]).reshape(-1, 4, 3)
    assert not ways[0, :, 0].any()
    assert not ways[-1, :, 1].any()


def test_only_bodies_with_faces_have_them() -> None:
    ball = parse_task(
        CRATE.replace(
            "box: {size: [0.04, 0.04, 0.06], edge_radius: 0.001}", "sphere: {center: [0, 0, 0], radius: 0.02}"
        )
        + FINGERS % 0.0
    )
    active = np.ones((len(crate().schedule.samples), 2), bool)
    blocks = [RefineStage(model, (0, 1), (2, 2), active).built.blocks for model in (crate(), build_model(ball))]
    assert [name in blocks[0] for name in ("face0", "face1")] == [True, True]
    assert not any(name.startswith("face") for name in blocks[1])
