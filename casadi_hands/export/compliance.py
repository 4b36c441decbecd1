"""How far contacts give in MuJoCo: as fingertips of rubber do.

A ball of rubber of radius r on a flat body gives by δ = (9 F² / (16 E*² r))^⅓ under a force F (Hertz), with the
effective modulus E* = E / (1 - ν²). MuJoCo's contacts are springs between accelerations; one at rest is deep by

    δ = F W (1 - d) (d₁ t / d)²,

with the time constant t (``solref``), the impedance d at that depth and d₁ at the most (``solimp``), and W, 1/kg, how
easily forces move the centre of mass of either body, added up (its documentation: Computation, Parameters). One time
constant serves the scene: all planned forces together press as deep as into rubber.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from casadi_hands.export.urdf import hand_urdf

if TYPE_CHECKING:
    from collections.abc import Sequence

    from casadi_hands.problem.hand import Hand
    from casadi_hands.problem.motion import Motion
    from casadi_hands.problem.motors import Motor
    from casadi_hands.task import Task

IMPEDANCE = 0.9, 0.95
"""``solimp`` of contacts that barely touch, and of deep ones."""

_MODULUS = 3e6 / (1 - 0.5**2)  # Pa: E* of silicone or rubber of some 55 Shore A, which keeps its volume
_USUAL = 0.01  # s, where no finger presses


def contact_time(task: Task, hand: Hand, motion: Motion, motors: Sequence[Motor], moves: bool, least: float) -> float:
    """Return the time constant, s, with which fingertips give like rubber under the planned forces.

    Args:
        task: gives the object's mass; an object that hangs on the world counts as a free one.
        hand: its last links' radii are the fingertips'.
        motion: its forces, and the joint angles at its first sample.
        motors: of the joints, whose rotors resist, too.
        moves: the palm is a free body, not part of the world.
        least: that the scene's time step allows, s.
    """
    forces = np.linalg.norm(motion.contact_force, axis=2)
    eases = link_eases(hand, motion, motors, moves)
    radii = {f"finger{i}_link{j}": link.radius for i, f in enumerate(hand.fingers) for j, link in enumerate(f.links)}
    rubber = soft = 0.0
    for force, link in zip(forces.T, motion.contact_link, strict=True):
        if link in radii:
            rubber += float(np.sum(np.cbrt(9 * force**2 / (16 * _MODULUS**2 * radii[link]))))
            soft += float(np.sum(force)) * (1 / task.object.mass + eases[link])
    if not soft:
        return _USUAL
    first, last = IMPEDANCE
    return max(first / last * float(np.sqrt(rubber / soft / (1 - first))), least)


def link_eases(hand: Hand, motion: Motion, motors: Sequence[Motor], moves: bool) -> dict[str, float]:
    """Return how easily forces at its centre of mass move each link, 1/kg: the mean over all directions.

    Args:
        hand: whose links they are.
        motion: stands as at its first sample.
        motors: of the joints.
        moves: the palm is a free body.
    """
    text = hand_urdf(hand)
    model = pin.buildModelFromXML(text, pin.JointModelFreeFlyer()) if moves else pin.buildModelFromXML(text)
    data, angles, rotors = model.createData(), pin.neutral(model), np.zeros(model.nv)
    for name, motor in zip(hand.joint_names, motors, strict=True):
        joint = model.joints[model.getJointId(name)]
        angles[joint.idx_q] = motion.joint_angles[0, motion.joint_names.index(name)]
        rotors[joint.idx_v] = motor.armature
    upper = np.triu(np.reshape(pin.crba(model, data, angles), (model.nv, model.nv)))
    inertia = upper + np.triu(upper, 1).T + np.diag(rotors)
    pin.computeJointJacobians(model, data, angles)
    eases = {}
    for name in hand.joint_names:
        joint = model.getJointId(name)
        slope = np.reshape(pin.getJointJacobian(model, data, joint, pin.ReferenceFrame.LOCAL), (6, model.nv))
        moved = slope[:3] - pin.skew(model.inertias[joint].lever) @ slope[3:]
        eases[name.replace("_joint", "_link")] = float(np.trace(moved @ np.linalg.solve(inertia, moved.T))) / 3
    return eases
