"""Two-toned meshes against the surfaces they approximate."""

import numpy as np
import pytest

from casadi_hands.export.page.shapes import patched_cylinder, patched_sphere

TONES = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))


def outward(mesh):
    """Volume (m³) of the cone over every triangle from the origin; positive if it is counterclockwise from outside."""
    corners = mesh.vertices[mesh.faces]
    return np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6


def test_a_sphere_is_closed_and_round():
    mesh = patched_sphere(0.02, TONES)
    assert np.linalg.norm(mesh.vertices, axis=1) == pytest.approx(0.02, rel=1e-6)
    assert mesh.normals == pytest.approx(mesh.vertices / 0.02, abs=1e-6)
    volumes = outward(mesh)
    assert volumes.min() > -1e-12
    assert volumes.sum() == pytest.approx(4 / 3 * np.pi * 0.02**3, rel=0.02)


def test_a_cylinder_is_as_long_and_wide_as_said():
    mesh = patched_cylinder(0.02, 0.06, TONES)
    assert np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 1]).max() == pytest.approx(0.02, rel=1e-6)
    assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(1)
    assert (mesh.vertices[:, 2].min(), mesh.vertices[:, 2].max()) == pytest.approx((-0.03, 0.03))
    volumes = outward(mesh)
    assert volumes.min() > -1e-12
    assert volumes.sum() == pytest.approx(np.pi * 0.02**2 * 0.06, rel=0.02)


@pytest.mark.parametrize("mesh", [patched_sphere(1.0, TONES), patched_cylinder(1.0, 2.0, TONES)])
def test_colours_alternate_from_octant_to_octant(mesh):
    inside = mesh.vertices[(np.abs(mesh.vertices) > 0.05).all(axis=1)]
    colors = mesh.color[(np.abs(mesh.vertices) > 0.05).all(axis=1)]
    red = np.prod(np.sign(inside), axis=1) > 0
    assert (colors[red] == TONES[0]).all()
    assert (colors[~red] == TONES[1]).all()
    assert 0.4 < red.mean() < 0.6
