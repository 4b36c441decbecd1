"""Can the joints supply the contact forces, and what disturbance can the grasp resist?"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from casadi_hands.verify.figures.attached import along_world
from casadi_hands.verify.figures.contact import Placements, active_contacts, surface_normals
from casadi_hands.verify.held import held
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.report import Figure, of_actuator, worse

LEAST_LEVER = 0.05
"""A direction of force counts as supplied when its lever is at least this share of half the object's extent."""

EDGES = 12
"""Edges of the pyramid inscribed in a friction cone."""

RESERVE = 2.0
"""The hand may squeeze this many times harder than the hardest moment of its plan."""


def contact_jacobian(folder: Folder, data: pin.Data, k: int, c: int) -> np.ndarray:
    """Return the Jacobian (3, J) of a link's contact point at a sample, palm frame, columns as the motion's joints."""
    twist = link_jacobian(folder, data, k, c)
    frame = folder.model.getFrameId(folder.motion.contact_link[c])
    arm = data.oMf[frame].rotation @ folder.motion.contact_point_link[k, c]
    jacobian: np.ndarray = twist[:3] - pin.skew(arm) @ twist[3:]
    return jacobian


def link_jacobian(folder: Folder, data: pin.Data, k: int, c: int) -> np.ndarray:
    """Return the Jacobian (6, J) of a contact's link at a sample: velocity of its origin, then spin; palm frame."""
    model, columns = folder.model, folder.joint_columns()
    configuration = pin.neutral(model)
    configuration[columns] = folder.motion.joint_angles[k]
    frame = model.getFrameId(folder.motion.contact_link[c])
    pin.computeJointJacobians(model, data, configuration)
    pin.updateFramePlacements(model, data)
    twist = pin.getFrameJacobian(model, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
    columned: np.ndarray = np.reshape(twist, (6, model.nv))[:, columns]  # that of one joint comes as a vector
    return columned


def planned_torques(folder: Folder, forces: np.ndarray | None = None) -> np.ndarray:
    """Return the joint torques (S, J) that press the contacts with forces (S, C, 3), N·m; links weigh nothing.

    Args:
        folder: the design.
        forces: N, world; those of the plan by default.
    """
    forces = folder.motion.contact_force if forces is None else forces
    torques = np.zeros_like(folder.motion.joint_angles)
    data = folder.model.createData()
    for k, c in active_contacts(folder):
        if folder.motion.contact_link[c] != "ground":
            torques[k] += contact_jacobian(folder, data, k, c).T @ in_palm(folder, k, forces[k, c])
            if folder.motion.contact_moment is not None:
                spin = link_jacobian(folder, data, k, c)[3:]
                torques[k] += spin.T @ in_palm(folder, k, folder.motion.contact_moment[k, c])
    return torques


def in_palm(folder: Folder, k: int, force: np.ndarray) -> np.ndarray:
    """Return a force (3,) in the world at a sample, in the palm's frame."""
    base = Rotation.from_quat(folder.motion.base_orientation[k], scalar_first=True)
    turned: np.ndarray = base.apply(force, inverse=True)
    return turned


def torque_figure(folder: Folder) -> Figure:
    """Return the largest torque of a joint or, where joints share motors, of a motor, by virtual work."""
    drive, worst = folder.drive, (0.0, "no joint presses")
    names = [f"joint {name}" for name in folder.motion.joint_names] if drive is None else drive.names
    for scenario, forces, _ in folder.scenarios():
        torques = planned_torques(folder, forces)
        torques = np.abs(torques if drive is None else torques @ drive.ratios)
        k, j = np.unravel_index(np.argmax(torques), torques.shape)
        worst = worse(worst, (float(torques[k, j]), f"{names[j]} at {folder.motion.time[k]:.3g} s{scenario}"))
    return of_actuator("torque", *worst, folder.task.actuator.torque, folder.task.limits.torque, "N·m")


def unsupplied_figure(folder: Folder) -> Figure:
    """Return the largest part of a contact force that no joint supplies with a sufficient lever, over the weight.

    The singular values of the contact's Jacobian are levers in m: a joint torque presses in a left singular direction
    with that lever. What lies outside the directions with levers long enough is borne by the structure alone.
    """
    worst, data = (0.0, "the joints supply every contact force"), folder.model.createData()
    for k, c in active_contacts(folder):
        if folder.motion.contact_link[c] == "ground":
            continue
        directions, levers, _ = np.linalg.svd(contact_jacobian(folder, data, k, c))
        kept = directions[:, : len(levers)][:, levers >= LEAST_LEVER * folder.length]
        for scenario, forces, rows in folder.scenarios():
            if not rows[k]:
                continue
            force = in_palm(folder, k, forces[k, c])
            left = float(np.linalg.norm(force - kept @ (kept.T @ force))) / folder.weight
            at = f"contact '{folder.motion.contact_names[c]}' at {folder.motion.time[k]:.3g} s{scenario}"
            worst = worse(worst, (left, f"no joint supplies a force of {{value}} of {at}"))
    return Figure("unsupplied_force", worst[0], folder.task.limits.unsupplied_force, "weight", worst[1])


def disturbance_figure(folder: Folder, placed: Placements) -> Figure:
    """Return the smallest wrench that the grasp cannot resist at some sample, force over m·g and torque over m·g·l.

    After Ferrari and Canny: the wrenches that active contacts can exert are the convex hull of zero and of the edges of
    their friction pyramids (inscribed), the torsion of soft fingertips among them, where all normal forces together are
    at most ``RESERVE`` times the largest sum in the plan. The radius is the distance from the wrench that the plan
    exerts to the hull's nearest face. Of an attached object only what moves it along its joint counts.
    """
    normals = np.zeros(len(folder.motion.time))
    for k, c in active_contacts(folder):
        normals[k] -= folder.motion.contact_force[k, c] @ surface_normals(folder, placed, k, c)[0]
    budget = RESERVE * float(np.max(normals)) / folder.weight
    cones = [_cones(folder, placed, k, budget) for k in range(len(folder.motion.time))]
    joint = held(folder)
    if joint is None:
        known: dict[tuple[bytes, bytes], float] = {}  # where nothing moves for a while, samples are the same
        for edges, exerted in cones:
            if (key := (edges.tobytes(), exerted.tobytes())) not in known:
                known[key] = disturbance_radius(edges, exerted)
        radii = [known[edges.tobytes(), exerted.tobytes()] for edges, exerted in cones]
    else:
        scale = np.concatenate([np.full(3, 1.0 / folder.length if joint.turns else 1.0), np.ones(3)])
        twists = along_world(folder, joint) * scale
        radii = [least_margin(edges @ row, exerted @ row) for (edges, exerted), row in zip(cones, twists, strict=True)]
    k = int(np.argmin(radii))
    words = f"a disturbance of {{value}} at {folder.motion.time[k]:.3g} s is the smallest the grasp cannot resist"
    limit = folder.task.limits.disturbance_radius
    return Figure("disturbance_radius", radii[k], limit, "weight", words, at_least=True)


def least_margin(edges: np.ndarray, exerted: float) -> float:
    """Return how much more, either way, of ``edges`` (N,) along a joint there could be than what is exerted."""
    most, least = float(edges.max(initial=0.0)), float(edges.min(initial=0.0))
    return float(max(min(most - exerted, exerted - least), 0.0))


def disturbance_radius(edges: np.ndarray, exerted: np.ndarray) -> float:
    """Return the distance from the wrench ``exerted`` (6,) to the nearest face of the hull of 0 and ``edges`` (N, 6).

    Zero when the hull is flat or the wrench lies outside.
    """
    points = np.vstack([np.zeros(6), edges]) - exerted
    if len(points) < 7 or np.linalg.matrix_rank(points - points[0], tol=1e-9) < 6:
        return 0.0
    try:
        hull = ConvexHull(points)
    except QhullError:
        return 0.0
    return max(float(np.min(-hull.equations[:, -1])), 0.0)


def _cones(folder: Folder, placed: Placements, k: int, budget: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the pyramids' edges (N, 6) at full budget and the exerted wrench (6,), nondimensional, at one sample."""
    edges, exerted, soft = [], np.zeros(6), folder.task.fingertip.torsion / folder.length
    turns = 2 * np.pi * np.arange(EDGES) / EDGES
    for c in np.flatnonzero(folder.motion.contact_active[k]):
        inward = -surface_normals(folder, placed, k, int(c))[0]
        arm = placed["object"][0][k] @ folder.motion.contact_point_object[k, c] / folder.length
        across = np.linalg.svd(inward[None])[2][1:]
        sideways = np.outer(np.cos(turns), across[0]) + np.outer(np.sin(turns), across[1])
        forces = budget * (inward + folder.friction(int(c)) * sideways)
        edges.append(np.hstack([forces, np.cross(arm, forces)]))
        if soft and folder.motion.contact_link[c] != "ground":  # pressing alone, a fingertip also resists a twist
            pressed = budget * np.concatenate([inward, np.cross(arm, inward)])
            twist = np.append(np.zeros(3), soft * budget * inward)
            edges.append(np.array([pressed + twist, pressed - twist]))
        force = folder.motion.contact_force[k, c] / folder.weight
        exerted += np.concatenate([force, np.cross(arm, force)])
        if folder.motion.contact_moment is not None:
            exerted[3:] += folder.motion.contact_moment[k, c] / (folder.weight * folder.length)
    return (np.vstack(edges) if edges else np.zeros((0, 6))), exerted
