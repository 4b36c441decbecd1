"""What fingers must follow, against SciPy's rotations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.stages.synthesis.target import string_of, target_of
from tests.problem.test_model import rotations
from tests.stages.example import Motion, everything, made_up_floating, project, rod, rods


@pytest.mark.parametrize(
    ("active", "expected"),
    [
        ([1, 1, 1], [0, 0, 0]),
        ([1, 1, 0, 1, 1], [0, 0, 1, 1, 1]),
        ([0, 0, 1, 0, 1, 0], [0, 0, 0, 1, 1, 1]),
        ([0, 0], [0, 0]),
    ],
)
def test_strings_number_the_runs_and_idle_ones_count_with_the_next(active: list[int], expected: list[int]) -> None:
    assert string_of(np.array(active, bool)).tolist() == expected


def test_contacts_and_forces_are_seen_from_the_palm() -> None:
    _, model = everything()
    floating = made_up_floating(model)
    target = target_of(model, floating)
    for k, (time, pose) in enumerate(zip(model.schedule.keyframes, floating.pose, strict=True)):
        sample = int(np.argmin(np.abs(model.schedule.samples - time)))
        palm = rotations(model.palm_quaternion[sample])
        turn = palm.inv() * Rotation.from_rotvec(pose[3:]) * rotations(model.reference)
        center = palm.inv().apply(pose[:3] - model.palm_position[sample])
        np.testing.assert_allclose(target.centers[k], center, atol=1e-12)
        for c in range(model.contacts):
            point, outward = project(floating.point[k, c], rod(model.touched[c]))
            force = turn.apply(floating.force[sample, c]) * floating.active[k, c]
            np.testing.assert_allclose(target.points[k, c], center + turn.apply(point), atol=1e-12)
            np.testing.assert_allclose(target.normals[k, c], -turn.apply(outward), atol=1e-12)
            np.testing.assert_allclose(target.forces[k, c], force, atol=1e-12)
    # The ground is no finger's contact.
    assert target.points.shape[1] == 3
    assert target.active.shape == (len(model.schedule.keyframes), 3)


def test_scene_is_the_object_s_bodies_and_the_ground_s_plane_in_the_palm_frame() -> None:
    _, model = everything()
    assert model.ground is not None
    floating = made_up_floating(model)
    target = target_of(model, floating)
    times = model.schedule.samples[::3]
    bodies, up, offset = target.scene(times)
    positions, turns = Motion(model, floating.pose).at(0)
    for t in range(len(times)):
        palm, position = rotations(model.palm_quaternion[3 * t]), model.palm_position[3 * t]
        for capsule, found in zip(map(rod, model.bodies), rods(model.bodies, bodies[t]), strict=True):
            for end in (slice(0, 3), slice(3, 6)):
                in_world = turns[3 * t].apply(capsule[end]) + positions[3 * t]
                np.testing.assert_allclose(found[end], palm.inv().apply(in_world - position), atol=1e-12)
            assert found[6] == capsule[6]
        on_ground = palm.inv().apply(np.array([0.4, -0.7, model.ground]) - position)
        above = palm.inv().apply(np.array([0.1, 0.2, model.ground + 0.3]) - position)
        assert up[t] @ on_ground == pytest.approx(offset[t], abs=1e-12)
        assert up[t] @ above == pytest.approx(offset[t] + 0.3, abs=1e-12)
