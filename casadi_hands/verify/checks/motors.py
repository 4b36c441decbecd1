"""Rotors and dampers of ``scene.xml``: those of the task's motors, for the links that they move?"""

from __future__ import annotations

from math import sqrt

import numpy as np

from casadi_hands.verify.reading.drive import Drive
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.reading.scene_file import Scene, SceneBody
from casadi_hands.verify.reading.stored import same

FREQUENCY = 200.0
"""rad/s, natural frequency of a joint's rotor, or pulley, on its spring."""
SHARED_FREQUENCY, SHARED_STIFFNESS = 1000.0, 100.0
"""Of motors that share joints: rad/s, and times the stiffness of their springs, seen at the shaft."""
SHARED_MASS, SHARED_INERTIA = 1e-3, 1e-3
"""kg of the body that such a motor is in MuJoCo, and its inertia relative to the rotor's."""


def rotor(folder: Folder) -> float:
    """Return the inertia of a joint's rotor, or pulley, seen at the joint, kg·m²."""
    return float(folder.task.actuator.stiffness) / FREQUENCY**2


def joint_damping(folder: Folder, name: str) -> float:
    """Return the damping of a joint, N·m·s/rad: the task's, or critical with the links beyond it stretched out.

    Args:
        folder: the design.
        name: of the joint, in ``hand.urdf``.
    """
    named, stiffness = folder.task.actuator.damping, float(folder.task.actuator.stiffness)
    if named is not None:
        return float(named)
    moved, reach, joint = rotor(folder), 0.0, folder.joints[name]
    while True:
        link = folder.links[joint.child]
        moved += max(link.inertia[0, 0], link.inertia[1, 1]) + link.mass * (reach + link.center_of_mass[2]) ** 2
        following = [other for other in folder.joints.values() if other.parent == joint.child]
        if not following:
            return 2.0 * sqrt(max(stiffness * moved, 0.0))
        joint = following[0]
        reach += float(joint.position[2])


def damping_problem(folder: Folder, who: str, name: str, stated: float) -> list[str]:
    """Return that a joint's damper is not the task's, N·m·s/rad, in a sentence; nothing where it is.

    Args:
        folder: the design.
        who: has it.
        name: of the joint.
        stated: in ``scene.xml``.
    """
    if name not in folder.joints or same(stated, due := joint_damping(folder, name)):
        return []
    by = "the task's" if folder.task.actuator.damping is not None else "the critical one is"
    return [f"{who} has a damping of {stated:.4g} N·m·s/rad, {by} {due:.4g}"]


def rotor_problems(folder: Folder, scene: Scene) -> list[str]:
    """Return which joints of the fingers turn another inertia than that of the task's motors, a sentence each."""
    due = rotor(folder)
    return [
        f"joint {hinge.name}: its rotor has {hinge.armature:.4g} kg·m², on the task's stiffness it is {due:.4g}"
        for body in scene.bodies.values()
        for hinge in body.hinges
        if hinge.name in folder.joints and not same(hinge.armature, due)
    ]


def shared_motor_problems(folder: Folder, scene: Scene, drive: Drive) -> list[str]:
    """Return which motors that share joints are not held, damped or made as they should be, a sentence each."""
    problems = []
    springs = float(folder.task.actuator.stiffness) * np.sum(drive.ratios**2, axis=0)
    stiffness = dict(zip(drive.names, (SHARED_STIFFNESS * springs).tolist(), strict=True))
    for servo in scene.servos:
        if servo.name != servo.joint:
            problems.append(f"the actuator of {servo.joint} is called {servo.name}")
        if servo.joint not in stiffness:
            continue
        due = stiffness[servo.joint]
        for word, stated, value in (
            ("N·m/rad", servo.stiffness, due),
            ("N·m·s/rad", servo.damping, 2.0 * due / SHARED_FREQUENCY),
        ):
            if not same(stated, value):
                problems.append(
                    f"{servo.joint} is held where it is told to be with {stated:.4g} {word}, not with {value:.4g}"
                )
    for name in drive.names:
        problems += _body_problems(name, scene.bodies.get(name), stiffness[name] / SHARED_FREQUENCY**2)
    return problems


def _body_problems(name: str, body: SceneBody | None, inertia: float) -> list[str]:
    """Return where a motor is not a body at the origin that turns about z as it likes, with a rotor's inertia."""
    if body is None or len(body.hinges) != 1 or body.hinges[0].name != name or body.hinges[0].reference != 0.0:
        return [f"{name} is not a body with one joint of that name"]
    problems, (hinge,) = [], body.hinges
    if body.parent != "world" or body.geoms or body.free or body.mocap:
        problems.append(f"{name} is not a motor that turns in place")
    stands = np.array_equal(body.position, np.zeros(3)) and np.array_equal(body.orientation, [1.0, 0.0, 0.0, 0.0])
    if not stands or np.any(body.center) or not np.array_equal(hinge.axis, [0.0, 0.0, 1.0]):
        problems.append(f"{name} does not turn about z at the world's origin")
    if np.any(np.isfinite(hinge.limits)):
        problems.append(f"{name} has limits; only its torque has")
    if not same(hinge.armature, inertia):
        problems.append(f"the rotor of {name} has {hinge.armature:.4g} kg·m², not {inertia:.4g}")
    if not same(body.mass, SHARED_MASS) or not same(body.inertia, SHARED_INERTIA * inertia * np.eye(3)):
        problems.append(f"the body of {name} is not one of {SHARED_MASS:g} kg that adds next to nothing to its rotor")
    return problems
