"""What the tests of the refine stage's blocks share: a block in numbers, its derivatives, random scenes."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
import coal
import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from casadi_hands.kinematics.morphology import FingerSeed
from casadi_hands.nlp import Kernel
from tests.stages.example import nearest_on_axis

Array = np.ndarray
Values = Mapping[str, ArrayLike]
STEP = 0.1
STILL = [1.0, 0.0, 0.0, 0.0]


def packed(kernel: Kernel, variables: Values, parameters: Values) -> list[Array]:
    """Variables and parameters given by name in the order of declaration, each in one column."""
    columns = []
    for symbols, values in ((kernel.local_variables, variables), (kernel.local_parameters, parameters)):
        assert {local.name: local.size for local in symbols} == {name: np.size(v) for name, v in values.items()}
        columns.append(np.concatenate([np.zeros(0), *[np.ravel(values[local.name]) for local in symbols]]))
    return columns


def numbers(kernel: Kernel, variables: Values, parameters: Values) -> dict[str, Array]:
    """Every term and constraint of a kernel."""
    found = {**kernel.terms, **kernel.constraints}
    function = ca.Function("f", [kernel.variables, kernel.parameters], list(found.values()))
    values = function.call(packed(kernel, variables, parameters))
    return {name: np.asarray(v).ravel() for name, v in zip(found, values, strict=True)}


def check_block(kernel: Kernel, variables: Values, parameters: Values, h: float = 1e-5) -> None:
    """Jacobian and Hessian of everything in a kernel against central differences along random directions."""
    x, p = packed(kernel, variables, parameters)
    stacked = ca.vertcat(*kernel.terms.values(), *kernel.constraints.values())
    multipliers = ca.SX.sym("multipliers", stacked.numel())
    hessian, gradient = ca.hessian(ca.dot(multipliers, stacked), kernel.variables)
    inputs = [kernel.variables, kernel.parameters, multipliers]
    function = ca.Function("f", inputs, [stacked, ca.jacobian(stacked, kernel.variables), gradient, hessian])
    rng = np.random.default_rng(0)
    weights = rng.normal(size=stacked.numel())

    def at(x: Array) -> list[Array]:
        return [np.asarray(value) for value in function(x, p, weights)]

    _, jacobian, _, bent = at(x)
    for _ in range(3):
        way = rng.normal(size=x.size)
        way /= np.linalg.norm(way)
        ahead, behind = at(x + h * way), at(x - h * way)
        for k, derivative in ((0, jacobian), (2, bent)):
            difference = (ahead[k] - behind[k]).ravel() / (2 * h)
            scale = max(1.0, np.abs(difference).max(), np.abs(ahead[k]).max())
            np.testing.assert_allclose(derivative @ way, difference, atol=1e-5 * scale)


class Place:
    """Where object and palm are, at random."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.position, self.palm_position = rng.normal(size=(2, 3))
        self.reference, self.palm = Rotation.random(rng=rng), Rotation.random(rng=rng)
        self.vector = rng.uniform(-1, 1, 3)

    @property
    def pose(self) -> Array:
        pose: Array = np.r_[self.position, self.vector]
        return pose

    @property
    def turn(self) -> Rotation:
        return Rotation.from_rotvec(self.vector) * self.reference

    @property
    def parameters(self) -> dict[str, object]:
        quaternions = [r.as_quat(scalar_first=True) for r in (self.reference, self.palm)]
        return {"reference": quaternions[0], "palm_position": self.palm_position, "palm_quaternion": quaternions[1]}

    def in_world(self, point: Array) -> Array:
        moved: Array = self.turn.apply(point) + self.position
        return moved

    def in_palm(self, point: Array) -> Array:
        seen: Array = self.palm.inv().apply(self.in_world(point) - self.palm_position)
        return seen


def surface(point: Array, capsule: Array) -> tuple[float, Array]:
    """Signed distance and outward normal of a capsule."""
    outward = point - nearest_on_axis(point, capsule)
    return float(np.linalg.norm(outward)) - capsule[6], outward / np.linalg.norm(outward)


def random_finger(joints: int, rng: np.random.Generator) -> FingerSeed:
    return FingerSeed(
        base=rng.uniform(-0.8, 0.8, 2),
        lengths=rng.uniform(0.9, 2.0, joints),
        frames=Rotation.random(joints, rng=rng).as_matrix(),
        axes=rng.uniform(-0.7, 0.7, (joints, 2)),
        bends=rng.uniform(-0.4, 0.4, (joints, 2)),
        angles=rng.uniform(-0.8, 0.8, (1, joints)),
        tips=np.zeros((1, 2)),
    )


def shape(finger: FingerSeed, tag: str = "") -> dict[str, object]:
    return {
        f"base{tag}": finger.base,
        f"lengths{tag}": finger.lengths,
        f"axes{tag}": finger.axes,
        f"bends{tag}": finger.bends,
    }


def frames(finger: FingerSeed) -> Array:
    """Rotations with their columns stacked, one after another."""
    return finger.frames.transpose(0, 2, 1).ravel()


def segment(start: Array, end: Array, radius: float) -> tuple[object, coal.Transform3s]:
    """A capsule, or where it has no length a sphere, for coal."""
    length = np.linalg.norm(end - start)
    if length == 0:
        return coal.Sphere(radius), coal.Transform3s(np.eye(3), start)
    turn = Rotation.align_vectors([(end - start) / length], [[0, 0, 1]])[0]
    return coal.Capsule(radius, length), coal.Transform3s(turn.as_matrix(), (start + end) / 2)


def coal_distance(one: tuple[object, coal.Transform3s], other: tuple[object, coal.Transform3s]) -> float:
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    return float(coal.distance(*one, *other, request, result))


def between(one: tuple[Array, Array], other: tuple[Array, Array], radii: float) -> float:
    """Distance of two capsules' surfaces, by coal."""
    return coal_distance(segment(*one, 1e-6), segment(*other, 1e-6)) + 2e-6 - radii
