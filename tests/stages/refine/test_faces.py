"""Contacts stay on the faces where the task has them, off their edges."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from casadi_hands.geometry.bodies.box import Box
from casadi_hands.problem.model import Model
from casadi_hands.problem.regrasp import Regrasp
from casadi_hands.problem.si import build_model
from casadi_hands.problem.structure import Structure
from casadi_hands.stages.refine import faces
from casadi_hands.stages.refine.stage import RefineStage
from casadi_hands.task import parse_task
from tests.stages.blocks import numbers

pytestmark = pytest.mark.usefixtures("interpreted")

CRATE = """\
object: {mass: 0.05, shapes: [{box: {size: [0.04, 0.04, 0.06], edge_radius: 0.001}}]}
palm: {radius: 0.05, position: [0, 0, 0.2], facing: [0, 0, -1]}
motion: [{at: 0, position: [0, 0, 0.1]}, {at: 1, position: [0.01, 0, 0.1]}]
"""
FINGERS = "fingers: {left: {touches: [0.02, 0.005, 0]}, right: {touches: [-0.02, %s, 0]}}\n"
HALF = 0.02


def crate(right: float = 0.0) -> Model:
    return build_model(parse_task(CRATE + FINGERS % right))


def bounds(model: Model, active: NDArray[np.bool_] | None = None, point: Any = None) -> dict[str, Any]:
    """Normals (S, 4, 3) and offsets (S, 4) of both contacts; ``point`` is where the motion has them."""
    count = len(model.schedule.samples)
    touching = np.ones((count, 2), bool) if active is None else active
    structure = Structure.of(model, (0, 1), (2, 2), touching)
    motion: Any = SimpleNamespace(point=np.full((count, 2, 3), np.nan) if point is None else point)
    found = {name: np.asarray(each) for name, each in faces.parameters(structure, motion).items()}
    return {name: each.reshape(count, 4, -1).squeeze() for name, each in found.items()}


def moved(model: Model, lifted: bool) -> Model:
    """The left contact goes to the next face halfway, lifted or not."""
    count = len(model.schedule.keyframes)
    patches, flags = np.tile(model.keyframe_patches[:1], (count, 1, 1)), np.zeros((count, 2), bool)
    patches[2:, 0] = np.array([0.0, HALF, 0.0]) / model.units.length
    flags[1, 0] = lifted
    return replace(model, regrasp=Regrasp(flags, patches))


def test_bounds_are_those_of_the_contacts_faces() -> None:
    model = crate()
    values, edge = bounds(model), 0.001
    for c in range(2):
        normals, offsets = values[f"face_normals{c}"], values[f"face_offsets{c}"]
        assert np.ptp(normals, axis=0).max() == np.ptp(offsets, axis=0).max() == 0
        np.testing.assert_allclose(np.abs(normals[0]).sum(axis=0), [0, 2, 2], atol=1e-12)
        off = np.array([HALF, HALF, 0.03, 0.03]) - offsets[0] * model.units.length
        assert np.all((off >= edge) & (off < 2 * edge))


def test_the_constraint_is_the_distance_from_the_half_spaces_planes(rng: np.random.Generator) -> None:
    body = Box(rng.normal(size=3), np.array([1.0, 1.2, 1.6]), rng.normal(size=3), 0.05)
    point = body.center + body.turn @ [0.5, 0.3, -0.79]
    normals, offsets = body.face(point)
    given = {"face_normals": normals.ravel(), "face_offsets": offsets}
    room = np.ravel(numbers(faces.face(4), {"point": point}, given)["on_face"])
    np.testing.assert_allclose(room, offsets - normals @ point)
    np.testing.assert_allclose(normals[room < 0] @ body.turn, [[0, 0, -1]], atol=1e-12)  # beyond the edge below alone


def test_a_contact_that_the_task_has_on_an_edge_may_stay_there() -> None:
    values = bounds(crate(right=0.0198))
    free = np.flatnonzero(~values["face_normals1"][0].any(axis=1))
    assert len(free) == 1
    assert values["face_offsets1"][0, free] == 1


def test_each_touch_has_the_face_of_its_own_place() -> None:
    model = moved(crate(), lifted=True)
    active = np.ones((len(model.schedule.samples), 2), bool)
    at = model.schedule.keyframe_samples
    active[at[1] : at[2], 0] = False
    normals = bounds(model, active)["face_normals0"]
    assert not normals[0, :, 0].any()
    assert normals[0].any()
    assert not normals[-1, :, 1].any()
    assert normals[-1].any()
    # Where nothing is planned, of an earlier result, the motion tells.
    point = np.tile(crate().keyframe_patches[0], (len(active), 1, 1))
    point[at[2] :, 0] = np.array([0.0, HALF, 0.0]) / model.units.length
    np.testing.assert_array_equal(bounds(replace(model, regrasp=None), active, point)["face_normals0"], normals)


def test_a_contact_that_is_to_go_to_another_face_is_free_to() -> None:
    values = bounds(moved(crate(), lifted=False))
    assert not values["face_normals0"].any()
    assert np.all(values["face_offsets0"] == 1)
    assert values["face_normals1"].any()


def test_only_bodies_with_faces_have_them() -> None:
    sphere = "sphere: {center: [0, 0, 0], radius: 0.02}"
    ball = parse_task(CRATE.replace("box: {size: [0.04, 0.04, 0.06], edge_radius: 0.001}", sphere) + FINGERS % 0.0)
    active = np.ones((len(crate().schedule.samples), 2), bool)
    blocks = [RefineStage(model, (0, 1), (2, 2), active).built.blocks for model in (crate(), build_model(ball))]
    assert [name in blocks[0] for name in ("face0", "face1")] == [True, True]
    assert not any(name.startswith("face") for name in blocks[1])


@pytest.mark.parametrize(("edge", "bounded"), [(1.6e-6, 0), (1e-4, 8)])
def test_a_face_that_is_all_edge_has_no_bounds(edge: float, bounded: int) -> None:
    disc = f"cylinder: {{start: [0, 0, -0.005], end: [0, 0, 0.005], radius: 0.02, edge_radius: {edge}}}"
    text = CRATE.replace("box: {size: [0.04, 0.04, 0.06], edge_radius: 0.001}", disc)
    text += "fingers: {left: {touches: [0.006, 0, 0.005]}, right: {touches: [-0.006, 0, -0.005]}}\n"
    model = build_model(parse_task(text))
    structure = Structure.of(model, (0, 1), (2, 2), np.ones((len(model.schedule.samples), 2), bool))
    values = faces.parameters(structure, SimpleNamespace(point=None))  # type: ignore[arg-type]
    normals = np.asarray(values["face_normals0"]).reshape(len(model.schedule.samples), 8, 3)
    np.testing.assert_array_equal(normals.any(axis=2).sum(axis=1), bounded)
