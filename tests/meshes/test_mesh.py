"""Mass moments against closed forms and trimesh; sizes."""

import numpy as np
import pytest
import trimesh

from casadi_hands.errors import MeshError
from casadi_hands.geometry.hull import mass_moments
from casadi_hands.meshes import Mesh, scaled
from tests.meshes.solids import angle, ball, box, inverted, joined


def test_a_box_weighs_as_the_closed_form_says() -> None:
    a, b, c = 0.02, 0.05, 0.11
    volume, center, inertia = mass_moments(box((a, b, c), (0.3, -0.2, 1.0)).corners)
    assert volume == pytest.approx(a * b * c, rel=1e-12)
    np.testing.assert_allclose(center, [0.3, -0.2, 1.0], atol=1e-13)
    np.testing.assert_allclose(inertia, np.diag([b**2 + c**2, a**2 + c**2, a**2 + b**2]) / 12, atol=1e-15)


def test_a_fine_ball_weighs_as_a_sphere() -> None:
    volume, center, inertia = mass_moments(ball(0.02, 120).corners)
    assert volume == pytest.approx(4 / 3 * np.pi * 0.02**3, rel=1e-3)
    np.testing.assert_allclose(center, 0, atol=1e-12)
    np.testing.assert_allclose(inertia, 0.4 * 0.02**2 * np.eye(3), rtol=1e-3, atol=1e-12)


@pytest.mark.parametrize("mesh", [angle(), joined(box(), inverted(box((0.02, 0.02, 0.02), (0.005, 0, 0))))])
def test_what_is_not_convex_weighs_as_trimesh_says(mesh: Mesh) -> None:
    volume, center, inertia = mass_moments(mesh.corners)
    oracle = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    oracle.density = 1 / oracle.volume
    assert volume == pytest.approx(oracle.volume, rel=1e-12) == pytest.approx(mesh.volume, rel=1e-12)
    np.testing.assert_allclose(center, oracle.center_mass, atol=1e-12)
    np.testing.assert_allclose(inertia, oracle.moment_inertia, atol=1e-12)


def test_a_mesh_is_brought_to_metres() -> None:
    np.testing.assert_allclose(np.ptp(scaled(box((40, 40, 40)), 0.001).vertices, axis=0), 0.04)


@pytest.mark.parametrize(
    ("size", "scale", "message"),
    [
        (40.0, 1.0, "given a mesh 40 m long; allowed: at most 5 m; is it in millimetres? `scale: 0.001`"),
        (40.0, 0.5, "given a mesh 20 m long; allowed: at most 5 m; is `scale: 0.5` right?"),
        (0.04, 0.001, "given a mesh 0.04 mm long; allowed: at least 1 mm; is it in metres? `scale: 1`"),
        (1e300, 1e300, "given a mesh inf m long; allowed: at most 5 m; is `scale: 1e+300` right?"),
    ],
)
@pytest.mark.filterwarnings("ignore:overflow")
def test_a_mesh_of_no_size_for_a_hand_is_asked_about(size: float, scale: float, message: str) -> None:
    with pytest.raises(MeshError) as caught:
        scaled(box((size, size, size)), scale)
    assert str(caught.value) == message
