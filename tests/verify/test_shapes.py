"""Shapes against coal and closed forms, and bodies as they are read from a URDF."""

from __future__ import annotations

from pathlib import Path

import coal
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.verify.bodies import Body, body_distance
from casadi_hands.verify.flat import Box, Convex
from casadi_hands.verify.reading.robot import read_robot
from casadi_hands.verify.shapes import Capsule, Cylinder, HalfSpace, Shape

SPHERE = '<collision><origin xyz="{} {} 0"/><geometry><sphere radius="0.01"/></geometry></collision>'
CYLINDER = (
    '<collision><origin xyz="{} {} 0" rpy="{}"/><geometry><cylinder radius="0.01" length="0.1"/></geometry></collision>'
)
INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'
ALONG_X, ALONG_Y = "0 1.5707963267948966 0", "-1.5707963267948966 0 0"
CORNERS = [(0, 0), (0.1, 0), (0.1, 0.1), (0, 0.1)]
SIDES = [
    CYLINDER.format(x, y, turn)
    for x, y, turn in ((0.05, 0, ALONG_X), (0.1, 0.05, ALONG_Y), (0.05, 0.1, ALONG_X), (0, 0.05, ALONG_Y))
]
TURN = Rotation.from_rotvec([0.3, -0.6, 1.1]).as_matrix()
START, END = np.array([0.01, -0.02, 0.03]), np.array([0.04, 0.02, 0.05])
SHAPES: dict[str, Shape] = {
    "sphere": Capsule(START, START, 0.02),
    "capsule": Capsule(START, END, 0.02),
    "cylinder": Cylinder(START, END, 0.02),
    "disc": Cylinder(START, START + 0.1 * (END - START), 0.05),
    "box": Box(np.array([0.05, 0.03, 0.08]), (START + END) / 2, TURN),
    "wedge": Convex(np.array([[0, 0, 0], [0.06, 0, 0], [0, 0.05, 0], [0, 0, 0.07], [0.06, 0, 0.07]]) @ TURN.T + START),
}
STATION = Cylinder(np.array([0, 0, -0.03]), np.array([0, 0, 0.03]), 0.02)
"""Upright, to be measured by hand."""


@pytest.fixture(params=sorted(SHAPES))
def shape(request: pytest.FixtureRequest) -> Shape:
    return SHAPES[request.param]


def _around(rng: np.random.Generator, count: int) -> np.ndarray:
    """Points (count, 3) in and about the shapes."""
    return (START + END) / 2 + rng.normal(scale=0.04, size=(count, 3))


def _by_coal(shape: Shape, point: np.ndarray) -> float:
    """Signed distance of a point, as a tiny ball's."""
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.enable_signed_distance = True
    frame, at = coal.Transform3s(*shape.pose), coal.Transform3s(np.eye(3), point)
    return float(coal.distance(shape.coal(), frame, coal.Sphere(1e-9), at, request, result))


def test_distances_are_coals(shape: Shape) -> None:
    points = _around(np.random.default_rng(0), 300)
    found, expected = shape.distance(points), np.array([_by_coal(shape, point) for point in points])
    # A ball without size deep inside a cylinder is beyond coal, but for its sign.
    outside = expected > 0
    np.testing.assert_allclose(found[outside], expected[outside], atol=2e-6)
    np.testing.assert_array_equal(found > 0, outside)
    assert (~outside).sum() > 5
    assert float(shape.distance(points[7])) == found[7]


def test_normals_are_the_distances_gradients(shape: Shape) -> None:
    points, h = _around(np.random.default_rng(1), 300), 1e-7
    slopes = [(shape.distance(points + h * e) - shape.distance(points - h * e)) / (2 * h) for e in np.eye(3)]
    found = shape.normal(points)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1, rtol=1e-12)
    np.testing.assert_allclose(found, np.transpose(slopes), atol=2e-5)
    np.testing.assert_allclose(shape.normal(points[7]), found[7], rtol=1e-14)


def test_a_point_less_its_distance_along_the_normal_is_on_the_surface(shape: Shape) -> None:
    body = Body("it", 1.0, np.zeros(3), np.eye(3), (shape,))
    for point in _around(np.random.default_rng(2), 100):
        nearest = body.project(point)
        assert abs(body.surface_distance(nearest)) < 1e-15
        assert np.linalg.norm(nearest - point) == pytest.approx(abs(body.surface_distance(point)))


@pytest.mark.parametrize(
    ("point", "distance", "normal"),
    [
        ([0.05, 0, 0.01], 0.03, [1, 0, 0]),
        ([0, 0.01, -0.07], 0.04, [0, 0, -1]),
        ([0.023, 0, 0.034], 0.005, [0.6, 0, 0.8]),
        ([0, 0.019, 0.0], -0.001, [0, 1, 0]),
        ([0, 0.012, 0.028], -0.002, [0, 0, 1]),
        ([0, 0, 0.03], 0.0, [0, 0, 1]),
        ([-0.02, 0, 0.01], 0.0, [-1, 0, 0]),
        ([0, 0, 0.029], -0.001, [0, 0, 1]),
        ([0, 0, 0.0], -0.02, [0, 0, 0]),
    ],
)
def test_a_cylinder_has_a_side_two_faces_and_sharp_edges(point: list[float], distance: float, normal: list) -> None:
    assert float(STATION.distance(np.array(point))) == pytest.approx(distance, abs=1e-15)
    np.testing.assert_allclose(STATION.normal(np.array(point)), normal, atol=1e-12)


def test_the_normal_at_an_edge_is_between_side_and_face() -> None:
    normal = STATION.normal(np.array([0.02, 0, 0.03]))
    assert np.linalg.norm(normal) == pytest.approx(1)
    assert min(normal[0], normal[2]) >= 0


def test_boxes_are_the_largest_of_many_surface_points(shape: Shape) -> None:
    body = Body("it", 1.0, np.zeros(3), np.eye(3), (shape,))
    lower, upper = shape.box
    middle = (lower + upper) / 2
    for axis in np.eye(3):
        # Far away along an axis, the nearest point is the farthest one that way.
        for sign, corner in ((1, upper), (-1, lower)):
            assert body.project(middle + sign * 1e4 * axis) @ axis == pytest.approx(corner @ axis, abs=1e-6)


def test_what_is_the_same_agrees_either_way_around(shape: Shape) -> None:
    for name, other in SHAPES.items():
        assert other.agrees(shape) == (other is shape), name
    if isinstance(shape, Box):
        assert Box(shape.sides[[1, 0, 2]], shape.center, shape.turn[:, [1, 0, 2]]).agrees(shape)
        assert not Box(shape.sides * [1, 1, 1.00001], shape.center, shape.turn).agrees(shape)
        return
    if isinstance(shape, Convex):
        beside = shape.points + np.array([0, 0, 1e-6])
        assert Convex(shape.points[::-1]).agrees(shape)
        assert not Convex(beside).agrees(shape)
        return
    turned = type(shape)(shape.end, shape.start, shape.radius)  # type: ignore[attr-defined,call-arg]
    assert turned.agrees(shape)
    assert not type(shape)(shape.end, shape.start, 1.00001 * shape.radius).agrees(shape)  # type: ignore[attr-defined,call-arg]
    assert not type(shape)(shape.end, shape.start + 1e-6, shape.radius).agrees(shape)  # type: ignore[attr-defined,call-arg]


def test_a_half_space_is_flat() -> None:
    ground = HalfSpace(0.3)
    points = np.random.default_rng(3).normal(size=(20, 3))
    np.testing.assert_allclose(ground.distance(points), points[:, 2] - 0.3)
    np.testing.assert_array_equal(ground.normal(points), np.tile([0, 0, 1], (20, 1)))


def test_a_cylinder_and_a_fingertip_are_apart_as_in_closed_form() -> None:
    """The tip's end on the side, over the face, off the edge; depths where the two overlap."""
    body = Body("object", 1.0, np.zeros(3), np.eye(3), (STATION,))
    tip = Body("tip", 1.0, np.zeros(3), np.eye(3), (Capsule(np.zeros(3), np.array([0, 0, 0.04]), 0.006),))
    rng, still = np.random.default_rng(4), (np.eye(3), np.zeros(3))
    for _ in range(100):
        at = rng.uniform([-0.05, -0.05, -0.07], [0.05, 0.05, 0.07])
        normal = STATION.normal(at)
        # The tip points away from the cylinder, so that its end is nearest.
        turn = Rotation.align_vectors([normal], [[0.0, 0.0, 1.0]])[0].as_matrix()
        found = body_distance(body, still, tip, (turn, at))
        expected = float(STATION.distance(at)) - 0.006
        if expected > -0.006:
            assert found == pytest.approx(expected, abs=2e-6)


@pytest.mark.parametrize("each", [1, 2])
def test_capsules_that_share_their_ends_are_told_apart(each: int, tmp_path: Path) -> None:
    # Four sides of a square; at a corner one sphere for both capsules, or one for each.
    shapes = [SPHERE.format(*corner) for corner in CORNERS for _ in range(each)] + SIDES
    file = tmp_path / "frame.urdf"
    file.write_text(f"<robot name='r'><link name='frame'>{INERTIAL}{''.join(shapes)}</link></robot>")
    body = read_robot(file).links["frame"]
    ends = {frozenset(tuple(np.round(p[:2], 9).tolist()) for p in (c.start, c.end)) for c in body.capsules}
    assert len(body.shapes) == len(body.capsules) == 4
    assert ends == {frozenset((CORNERS[i], CORNERS[(i + 1) % 4])) for i in range(4)}


def test_a_sphere_that_ends_no_cylinder_stays_a_sphere(tmp_path: Path) -> None:
    shapes = [SPHERE.format(0, 0), SPHERE.format(0.1, 0), SPHERE.format(0.1, 0.1), SIDES[0]]
    file = tmp_path / "bar.urdf"
    file.write_text(f"<robot name='r'><link name='bar'>{INERTIAL}{''.join(shapes)}</link></robot>")
    lengths = [c.length for c in read_robot(file).links["bar"].capsules]
    assert sorted(lengths) == pytest.approx([0, 0.1])


def test_a_cylinder_without_spheres_at_both_its_ends_stays_one(tmp_path: Path) -> None:
    shapes = [SPHERE.format(0, 0), *SIDES[:2]]
    file = tmp_path / "bar.urdf"
    file.write_text(f"<robot name='r'><link name='bar'>{INERTIAL}{''.join(shapes)}</link></robot>")
    sphere, one, other = read_robot(file).links["bar"].shapes
    assert sphere.agrees(Capsule(np.zeros(3), np.zeros(3), 0.01))
    assert one.agrees(Cylinder(np.zeros(3), np.array([0.1, 0, 0]), 0.01))
    assert other.agrees(Cylinder(np.array([0.1, 0, 0]), np.array([0.1, 0.1, 0]), 0.01))
