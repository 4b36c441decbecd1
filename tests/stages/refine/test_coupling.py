"""Shared motors' blocks: commands against virtual work by differences, derivatives, and bounds of ratios."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.geometry.bodies.capsule import Capsule
from casadi_hands.problem.coupling import Coupling
from casadi_hands.problem.structure import Structure
from casadi_hands.stages.refine import coupling
from casadi_hands.stages.refine.problem import RefineProblem
from tests.stages.blocks import Place, check_block, frames, numbers, random_finger, shape, surface
from tests.stages.example import PinFinger, everything, nearest_on_axis

Array = np.ndarray
LINK, RADIUS, HINGE, STIFFNESS, TORSION, MOTORS = 0.15, 0.2, 0.42, 3.0, 0.4, 2


class Pressing:
    """A random finger whose last link is pressed by a force and a torsional moment on a random capsule."""

    def __init__(self, joints: int, soft: bool) -> None:
        rng = np.random.default_rng((joints, soft))
        self.joints, self.soft = joints, soft
        self.finger, self.place = random_finger(joints, rng), Place(rng)
        self.capsule, self.point = np.r_[rng.normal(size=6), 0.3], rng.normal(size=3)
        self.force, self.torsion = rng.normal(size=3), float(rng.normal())
        self.ratios, self.offsets = rng.normal(size=(joints, MOTORS)), rng.normal(size=joints)
        self.motors = rng.normal(size=MOTORS)

    @property
    def block(self) -> tuple[dict[str, object], dict[str, object]]:
        variables = {"pose": self.place.pose, "point": self.point, "force": self.force, "angles": self.finger.angles}
        variables |= {"ratios": self.ratios, "offsets": self.offsets, "motors": self.motors, **shape(self.finger)}
        parameters = {"frames": frames(self.finger), **self.place.parameters, "body": self.capsule}
        parameters |= {"radius": LINK, "tip_radius": RADIUS, "hinge": HINGE, "stiffness": STIFFNESS}
        if self.soft:
            variables["torsion"], parameters["torsion_radius"] = self.torsion, TORSION
        return variables, parameters

    def work(self) -> Array:
        """What the force and the moment, fixed in the palm, do over small turns of each joint."""
        finger, angles = PinFinger(self.finger, RADIUS if self.joints == 1 else LINK), self.finger.angles[0]
        points, rotation = finger.chain(angles)
        on_link = rotation.T @ (self.place.in_palm(self.point) - points[-2])
        on_axis = nearest_on_axis(on_link, np.r_[0, 0, HINGE, 0, 0, self.finger.lengths[-1], RADIUS])
        touched = on_axis + RADIUS * (on_link - on_axis) / np.linalg.norm(on_link - on_axis)
        to_palm = self.place.palm.inv() * self.place.turn
        done = finger.jacobian(angles, touched).T @ to_palm.apply(self.force)
        if self.soft:
            moment = to_palm.apply(TORSION * self.torsion * surface(self.point, self.capsule)[1])
            for j, step in enumerate(1e-5 * np.eye(self.joints)):
                after, before = (finger.chain(angles + sign * step)[1] for sign in (1, -1))
                done[j] += moment @ Rotation.from_matrix(after @ before.T).as_rotvec() / 2e-5
        return done


@pytest.mark.parametrize("soft", [False, True])
@pytest.mark.parametrize("joints", [1, 2, 3])
def test_commands_press_by_virtual_work(joints: int, soft: bool) -> None:
    case = Pressing(joints, soft)
    found = numbers(coupling.pressing(joints, Capsule, soft, MOTORS), *case.block)["on_lines"]
    lines = case.offsets + case.ratios @ case.motors
    # Where a link becomes its cap, the nearest point of its axis is rounded off.
    np.testing.assert_allclose(found, case.finger.angles[0] + case.work() / STIFFNESS - lines, atol=3e-5)


@pytest.mark.parametrize("soft", [False, True])
def test_derivatives_of_pressing(soft: bool) -> None:
    check_block(coupling.pressing(2, Capsule, soft, MOTORS), *Pressing(2, soft).block)


def test_a_finger_in_the_air_is_at_its_commands(rng: np.random.Generator) -> None:
    ratios, offsets, motors, angles = (rng.normal(size=size) for size in ((3, 2), 3, 2, 3))
    given = {"ratios": ratios, "offsets": offsets, "motors": motors, "angles": angles}
    found = numbers(coupling.idle(3, 2), given, {})["on_lines"]
    np.testing.assert_allclose(found, angles - offsets - ratios @ motors, atol=1e-14)


def test_motors_bear_what_springs_pull(rng: np.random.Generator) -> None:
    """The torque of a motor is the slope of the springs' energy in its position."""
    ratios, offsets, angles = ([rng.normal(size=(n, *rest)) for n in (2, 1)] for rest in ((2,), (), ()))
    motors = rng.normal(size=2)
    given = {"motors": motors}
    for name, values in (("ratios", ratios), ("offsets", offsets), ("angles", angles)):
        given |= {f"{name}{i}": value for i, value in enumerate(values)}
    found = numbers(coupling.motor_torque((2, 1), 2), given, {"stiffness": STIFFNESS})["torque"]

    def energy(positions: Array) -> float:
        stretched = [o + c @ positions - q for o, c, q in zip(offsets, ratios, angles, strict=True)]
        return STIFFNESS / 2 * float(sum(each @ each for each in stretched))

    slope = [(energy(motors + step) - energy(motors - step)) / 2e-5 for step in 1e-5 * np.eye(2)]
    np.testing.assert_allclose(found, slope, rtol=1e-6)


def test_exact_ratios_are_zero_or_of_an_allowed_size_and_keep_their_signs() -> None:
    model = replace(everything()[1], motors=2)
    active = np.ones((len(model.schedule.samples), model.contacts + 1), bool)
    built = RefineProblem(Structure.of(model, (0, 1), (2, 2), active))
    ratios = np.array([[1.0, 0.0], [0.03, -0.6], [0.0, 1.0], [0.07, 1.9]])
    begun = Coupling(ratios, np.zeros(4), np.zeros((len(model.schedule.samples), 2)), (0, 2))
    low, high = coupling.bounds(built, begun, (0.1, 2.0), exact=True)
    np.testing.assert_array_equal(np.vstack([low["ratios0"], low["ratios1"]]), [[1, 0, 0, -2], [0, 1, 0.1, 0.1]])
    np.testing.assert_array_equal(np.vstack([high["ratios0"], high["ratios1"]]), [[1, 0, 0, -0.1], [0, 1, 2, 2]])
    assert np.all(low["motors"][0] == 0.0)
    assert np.all(high["motors"][0] == 0.0)
    assert np.all(np.isinf(high["motors"][1:]))
    loose = coupling.bounds(built, begun, (0.1, 2.0), exact=False)
    np.testing.assert_array_equal(loose[1]["ratios0"], [[1, 0, 2, 2]])
