import coal
import numpy as np
import pytest
from scipy.spatial.transform import Rotation as ScipyRotation

from casadi_hands.task import Capsule, Palm
from casadi_hands.task.object import ManipulatedObject
from casadi_hands.task.obstacles import depth_below, depth_in_palm, palm_depth_below

BODY = ManipulatedObject(mass=1, shapes=(Capsule(start=(-0.03, 0, 0), end=(0.03, 0, 0), radius=0.01),))
PALM = Palm.model_validate({"radius": 0.05, "position": (0.1, 0.2, 0.3), "facing": (1, -2, 1)})


def test_clearance_of_object_and_palm_agrees_with_coal(rng: np.random.Generator) -> None:
    disc = coal.Cylinder(PALM.radius, PALM.thickness)
    placed = coal.Transform3s(PALM.rotation, np.array(PALM.position) - PALM.thickness / 2 * PALM.rotation[:, 2])
    apart = 0
    for turn in ScipyRotation.random(60, rng=5):
        position = np.array(PALM.position) + rng.uniform(-0.08, 0.08, 3)
        # Coal's capsule lies along z, ours along x.
        lying = (turn * ScipyRotation.from_euler("y", 90, degrees=True)).as_matrix()
        found = coal.distance(
            disc,
            placed,
            coal.Capsule(0.01, 0.06),
            coal.Transform3s(lying, position),
            coal.DistanceRequest(),
            coal.DistanceResult(),
        )
        depth = depth_in_palm(BODY, position, turn.as_rotvec(), PALM)
        # Overlapping, ours is the depth of the capsule's axis, Coal's that of the bodies: compare the sign.
        assert (depth > 0) == (found < 0)
        if found > 0:
            assert depth == pytest.approx(-found, abs=1e-6)
            apart += 1
    assert 10 < apart < 60


WIDE = {
    "sphere": {"center": (0, 0, 0), "radius": 0.15},
    "cylinder": {"start": (0, 0, -0.15), "end": (0, 0, 0.15), "radius": 0.15},
    "box": {"center": (0, 0, 0), "size": (0.3, 0.3, 0.3)},
    "convex": {"vertices": [(x, y, z) for x in (-0.15, 0.15) for y in (-0.15, 0.15) for z in (-0.15, 0.15)]},
}


@pytest.mark.parametrize("kind", WIDE)
def test_a_palm_within_a_face_or_behind_it_is_found(kind: str) -> None:
    """A small palm below the top of a large object, off edges and diagonals of faces, level and on edge."""
    body = ManipulatedObject.model_validate({"mass": 1, "shapes": [{kind: WIDE[kind]}]})
    palm = Palm.model_validate({"radius": 0.02, "thickness": 0.004, "position": (0, 0, 0), "facing": (0, 0, 1)})
    level, on_edge = np.eye(3), ScipyRotation.from_euler("x", 90, degrees=True).as_matrix()
    for rotation, deepest in ((level, 0.004), (on_edge, 0.02)):
        for below in (-0.01, -0.001, 0.001, 0.05, 0.15):
            at = np.array([0.05, 0.01, 0.15 - below + deepest]) if kind != "sphere" else [0, 0, 0.15 - below + deepest]
            depth = depth_in_palm(body, np.zeros(3), np.zeros(3), palm, (np.array(at), rotation))
            assert (depth > 0) == (below > 0)
            assert abs(depth) >= 0.9 * min(abs(below), 0.1)


def test_depths_below_the_ground() -> None:
    # The capsule stands on end, its lower end at 0.1 - 0.03 - 0.01.
    upright = np.array([0, np.pi / 2, 0])
    assert depth_below(BODY, np.array([0, 0, 0.1]), upright, 0.0) == pytest.approx(-0.06)
    assert depth_below(BODY, np.array([0, 0, 0.1]), upright, 0.07) == pytest.approx(0.01)


def test_palm_below_the_ground_agrees_with_points_of_its_rims() -> None:
    angles = np.linspace(0, 2 * np.pi, 3601)
    rim = PALM.radius * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    points = np.vstack([rim, rim - [0, 0, PALM.thickness]])
    for rotation in ScipyRotation.random(20, rng=7):
        lowest = float((np.array([0, 0, 0.3]) + rotation.apply(points))[:, 2].min())
        depth = palm_depth_below(PALM, np.array([0, 0, 0.3]), rotation.as_matrix(), 0.2)
        assert depth == pytest.approx(0.2 - lowest, abs=1e-7)
