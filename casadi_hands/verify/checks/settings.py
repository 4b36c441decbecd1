"""Does ``scene.xml`` have MuJoCo compute contacts as the format says: no harder, and stepped finely enough?

Replays depend on it. What makes them harder, softer contacts say, is no falsification.
"""

from __future__ import annotations

from math import sqrt

import numpy as np
import pinocchio as pin

from casadi_hands.problem.stored import read_text
from casadi_hands.verify.checks.motors import rotor
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.reading.settings import Settings

RUBBER = 4e6
"""Pa, E / (1 - ν²) of fingertips: of rubber of 3 MPa, which keeps its volume."""
STIFFEST = 0.002
"""s: whatever forces are planned, contacts may be as stiff."""
HARDEST, PASSES = 100.0, 20
"""Of friction beside normal forces, and passes that take out its creep."""
LOW, HIGH, DEPTH = 0.9, 0.95, 0.02
"""Impedance of contacts that barely touch, of deep ones, and between them at least, of half the object's extent."""
CLOSE = 0.01
"""Share by which machines may differ."""


def settings_problems(folder: Folder, settings: Settings, moves: bool) -> list[str]:
    """Return what of the settings is not as the format has it, a sentence each.

    Args:
        folder: the design.
        settings: of its scene.
        moves: whether the palm does, as a free body that follows another.
    """
    problems = []
    if settings.integrator != "implicitfast":
        problems.append(f"its integrator is {settings.integrator[:40]}, not implicitfast")
    if settings.cone != "elliptic":
        problems.append(f"its friction cones are {settings.cone[:40]}, not elliptic")
    if settings.dimensions != 4:
        problems.append(f"contacts have {settings.dimensions:g} dimensions (condim), not the 4 of friction and torsion")
    if not (1.0 <= settings.hardness <= HARDEST * (1 + 1e-9) and 0 <= settings.no_slip <= PASSES):
        problems.append(
            f"friction is {settings.hardness:g} times as hard as normal forces (impratio), with {settings.no_slip:g}"
            f" passes against creep; at most {HARDEST:g} and {PASSES} are played"
        )
    low, high, depth = settings.impedance
    least = DEPTH * folder.length
    if not (0 < low <= LOW + 1e-9 and low <= high <= HIGH + 1e-9 and depth >= least * (1 - CLOSE)):
        problems.append(
            f"contacts have an impedance of {low:g} to {high:g} over {depth:.3g} m (solimp); at most {LOW:g} to"
            f" {HIGH:g} over {least:.3g} m"
        )
    due = max(rubber_time(folder, moves), STIFFEST)
    if not (settings.time >= due * (1 - CLOSE) and abs(settings.damping - 1) < 1e-6):
        problems.append(
            f"contacts push out what is in them in {settings.time:.3g} s, damped by {settings.damping:g} (solref);"
            f" rubber fingertips do in {due:.3g} s, damped by 1"
        )
    if not 0 < settings.step <= 0.5 * max(settings.time, 0.0):
        problems.append(
            f"steps of {settings.step:g} s are too long for contacts of {settings.time:.3g} s; at most half of that"
        )
    return problems


def rubber_time(folder: Folder, moves: bool) -> float:
    """Return the time, s, with which MuJoCo's contacts give like rubber under the planned forces, all together.

    A ball of radius r gives by (9 F² / (16 E*² r))^⅓ (Hertz), a contact of MuJoCo by F W (1 - d) (D t / d)², where W is
    how easily a force moves the centre of mass of either body, d its least impedance and D its largest.

    Args:
        folder: the design; an object that hangs on a joint is taken for a free one.
        moves: whether the palm is a free body.
    """
    motion, eases = folder.motion, _eases(folder, moves)
    rubber = stiff = 0.0
    for c, link in enumerate(motion.contact_link):
        if link not in eases:
            continue
        forces = np.linalg.norm(motion.contact_force[:, c], axis=1)
        radius = folder.links[link].capsules[0].radius
        rubber += float(np.cbrt(9 * forces**2 / (16 * RUBBER**2 * radius)).sum())
        stiff += float(forces.sum()) * (1 / folder.object.mass + eases[link])
    return LOW / HIGH * sqrt(rubber / (stiff * (1 - LOW))) if stiff > 0 else 0.0


def _eases(folder: Folder, moves: bool) -> dict[str, float]:
    """Return how easily, 1/kg, forces move the centre of mass of each finger's link, on average over directions."""
    model = folder.model
    if moves:
        model = pin.buildModelFromXML(read_text(folder.path / "hand.urdf"), pin.JointModelFreeFlyer())
    data, angles, motors = model.createData(), pin.neutral(model), np.zeros(model.nv)
    for name, angle in zip(folder.motion.joint_names, folder.motion.joint_angles[0], strict=True):
        joint = model.joints[model.getJointId(name)]
        angles[joint.idx_q], motors[joint.idx_v] = angle, rotor(folder)
    upper = np.triu(np.reshape(pin.crba(model, data, angles), (model.nv, model.nv)))
    inverse = np.linalg.inv(upper + np.triu(upper, 1).T + np.diag(motors))
    pin.computeJointJacobians(model, data, angles)
    eases = {}
    for name, joint in folder.joints.items():
        number = model.getJointId(name)
        center = pin.SE3(np.eye(3), model.inertias[number].lever)
        slope = np.reshape(pin.getJointJacobian(model, data, number, pin.LOCAL), (6, model.nv))
        moved = (center.toActionMatrixInverse() @ slope)[:3]
        eases[joint.child] = float(np.trace(moved @ inverse @ moved.T)) / 3
    return eases
