"""Two-toned meshes against the surfaces they approximate."""

import numpy as np
import pytest

from casadi_hands.export.page.shapes import faceted, patched_cylinder, patched_sphere

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


def test_a_flat_face_has_one_colour_however_it_is_cut(rng):
    """Of a prism of twelve sides, each face cut into triangles that meet at any point of it."""
    angles = np.pi / 6 * np.arange(12)
    rim = np.column_stack([0.03 * np.cos(angles), 0.02 * np.sin(angles)])
    faces = [[(*rim[k], -0.05), (*rim[(k + 1) % 12], -0.05), (*rim[(k + 1) % 12], 0.05)] for k in range(12)]
    faces = [np.array([*face, (*rim[k], 0.05)]) for k, face in enumerate(faces)]
    faces += [np.column_stack([rim, np.full(12, 0.05)]), np.column_stack([rim, np.full(12, -0.05)])[::-1]]
    corners = []
    for face in faces:
        inside = rng.dirichlet(np.ones(len(face))) @ face
        corners += [(inside, a, b) for a, b in zip(face, np.roll(face, -1, axis=0), strict=True)]
    vertices = np.array(corners).reshape(-1, 3)
    mesh = faceted(vertices, np.arange(len(vertices)).reshape(-1, 3), TONES)
    assert outward(mesh).min() > 0
    ends = np.cumsum([3 * len(face) for face in faces])
    colors = [np.unique(part, axis=0) for part in np.split(mesh.color, ends[:-1])]
    assert [len(each) for each in colors] == [1] * 14
    # Sides in four quarters, above and below alike since each reaches from end to end.
    red = [bool((each == TONES[0]).all()) for each in colors]
    assert red[:12] == [True] * 3 + [False] * 3 + [True] * 3 + [False] * 3
    normals = mesh.normals.reshape(-1, 3, 3)
    sides = mesh.vertices[mesh.faces]
    assert np.abs(np.einsum("tki,tji->tkj", normals, sides - sides[:, :1])).max() < 1e-8
