import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation as ScipyRotation

from casadi_hands.task import Capsule, Sphere
from casadi_hands.task.object import ManipulatedObject


def test_mass_properties_of_two_shapes_agree_with_pinocchio() -> None:
    ball = Sphere(center=(0.04, 0.01, 0), radius=0.02)
    rod = Capsule(start=(-0.03, 0, 0), end=(0.03, 0, 0), radius=0.008)
    body = ManipulatedObject(mass=0.2, shapes=(ball, rod))

    density = 0.2 / (ball.body.volume + rod.body.volume)
    beside = pin.SE3(np.eye(3), np.array(ball.center))
    of_ball = pin.Inertia.FromSphere(density * ball.body.volume, 0.02).se3Action(beside)
    # Pinocchio's capsule lies along z, and its mass there is exact; turn it onto x.
    lying = pin.SE3(ScipyRotation.from_euler("y", 90, degrees=True).as_matrix(), np.zeros(3))
    of_rod = pin.Inertia.FromCapsule(density * rod.body.volume, 0.008, 0.06).se3Action(lying)
    whole = of_ball + of_rod
    assert body.center_of_mass == pytest.approx(whole.lever, abs=1e-12)
    assert np.array(body.inertia) == pytest.approx(whole.inertia, rel=1e-9, abs=1e-15)


def test_given_inertia_is_kept() -> None:
    given = ((3e-5, 1e-6, 0.0), (1e-6, 2e-5, 0.0), (0.0, 0.0, 4e-5))
    body = ManipulatedObject(mass=0.1, shapes=(Sphere(center=(0, 0, 0), radius=0.02),), inertia=given)
    assert body.inertia == given


def test_half_extent_is_half_the_longest_side_of_the_box() -> None:
    body = ManipulatedObject(
        mass=1,
        shapes=(
            Capsule(start=(-0.03, 0, 0), end=(0.05, 0, 0), radius=0.01),
            Sphere(center=(0, 0.02, 0), radius=0.015),
        ),
    )
    lower, upper = body.bounding_box
    assert lower == pytest.approx([-0.04, -0.01, -0.015])
    assert upper == pytest.approx([0.06, 0.035, 0.015])
    assert body.characteristic_length == pytest.approx(0.05)


def test_lowest_point_is_lowest_of_points_on_the_surface() -> None:
    body = ManipulatedObject(mass=1, shapes=(Capsule(start=(-0.03, 0, 0.01), end=(0.05, 0, 0), radius=0.01),))
    (capsule,) = body.shapes
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(4000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    surface = np.vstack([np.array(end) + capsule.radius * directions for end in (capsule.start, capsule.end)])
    for rotation in ScipyRotation.random(20, rng=2):
        lowest = float(rotation.apply(body.lowest_point(rotation.as_matrix()))[2])
        sampled = float(rotation.apply(surface)[:, 2].min())
        assert sampled - 2e-5 < lowest <= sampled


def test_lowest_point_of_a_level_capsule_is_its_middle() -> None:
    body = ManipulatedObject(mass=1, shapes=(Capsule(start=(-0.03, 0, 0), end=(0.05, 0, 0), radius=0.01),))
    assert body.lowest_point(np.eye(3)) == pytest.approx([0.01, 0, -0.01])
