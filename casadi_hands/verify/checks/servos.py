"""Servos in the joints: are they the task's, where their joints are, and in the masses of what holds them?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.verify.bodies import Body
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.reading.stored import brief, entry
from casadi_hands.verify.shapes import Capsule


def servo_problems(folder: Folder) -> list[str]:
    """Return where the servos of ``hand.urdf`` are not one in every joint as the task says, a sentence each."""
    drive, stated = folder.task.hand.drive, entry(folder.result.get("hand"), "servo")
    problems = []
    if stated != drive.servo:
        problems.append(f"servo: result.json says {brief(stated)}, the task {brief(drive.servo)}")
    for name, body in folder.links.items():
        turned = [joint for joint in folder.joints.values() if joint.parent == name] if drive.motor else []
        if len(body.cases) != len(turned):
            problems.append(f"{folder.call(name)}: hand.urdf has {len(body.cases)} servos in it, not {len(turned)}")
            continue
        for joint in turned:
            assert drive.motor is not None
            near = 1e-6 * drive.motor.reach
            axis = Rotation.from_euler("xyz", joint.turn).apply(joint.axis / np.linalg.norm(joint.axis))
            if not any(
                np.linalg.norm(case.center - joint.position) < near
                and np.max(np.abs(case.sides - drive.motor.size)) < near
                and np.linalg.norm(np.cross(case.turn[:, 0], axis)) < 1e-6
                for case in body.cases
            ):
                problems.append(
                    f"joint {joint.name}: no {drive.servo} stands on it in hand.urdf, its shaft on the axis"
                )
    return problems


def put_together(
    folder: Folder, body: Body, mass: float, center: np.ndarray, inertia: np.ndarray, balls: tuple[Capsule, ...] = ()
) -> Body:
    """Return a body with the mass properties of a solid, of balls on it and of the servos that it holds.

    Args:
        folder: the design.
        body: with the servos.
        mass: of the solid, kg.
        center: (3,) m, its centre of mass.
        inertia: (3, 3) kg·m², about that.
        balls: as dense as the task says.
    """
    servo = folder.task.hand.drive.motor
    # Second moments ∫ x xᵀ dm about the frame's origin: of parts they add.
    parts = [(mass, center, 0.5 * np.trace(inertia) * np.eye(3) - inertia)]
    for ball in balls:
        weighs = folder.task.hand.density * 4 / 3 * np.pi * ball.radius**3
        parts.append((weighs, ball.start, weighs * ball.radius**2 / 5 * np.eye(3)))
    for case in body.cases if servo else ():
        assert servo is not None
        parts.append((servo.mass, case.center, case.turn @ np.diag(servo.mass * case.sides**2 / 12) @ case.turn.T))
    total = sum(each for each, _, _ in parts)
    middle = sum((each * at for each, at, _ in parts), np.zeros(3)) / total
    moments = sum((own + each * np.outer(at, at) for each, at, own in parts), np.zeros((3, 3)))
    moments -= total * np.outer(middle, middle)
    return replace(body, mass=total, center_of_mass=middle, inertia=np.trace(moments) * np.eye(3) - moments)
