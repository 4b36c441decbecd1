"""Result folders made by hand: small scenes whose physics is known, written as the format says."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from casadi_hands.export.commands import commanded
from casadi_hands.export.mjcf import scene_mjcf
from casadi_hands.problem.hand import Finger, Hand, Link
from casadi_hands.problem.motion import Motion
from casadi_hands.task import Task, load_task, task_to_yaml


@dataclass(frozen=True)
class Scene:
    """What a result folder says."""

    task: Task
    hand: Hand
    motion: Motion
    changes: dict[str, Any] = field(default_factory=dict)

    def write(self, directory: Path) -> Path:
        """Write task.yaml, hand.urdf, object.urdf, scene.xml, motion.npz and result.json.

        A motion without commands is written with those that go with it.
        """
        directory.mkdir(parents=True, exist_ok=True)
        motion = self.motion
        if motion.joint_commands is None:
            motion = commanded(self.task, self.hand, motion)
        (directory / "task.yaml").write_text(task_to_yaml(self.task))
        (directory / "hand.urdf").write_text(hand_urdf(self.hand))
        (directory / "object.urdf").write_text(object_urdf(self.task))
        for k, shape in enumerate(self.task.object.shapes):
            kind, given = _shape_given(shape)
            if kind == "convex":
                (directory / "meshes").mkdir(exist_ok=True)
                lines = [f"v {x!r} {y!r} {z!r}\n" for x, y, z in given["vertices"]]
                (directory / "meshes" / f"{k}.obj").write_text("".join(lines))
        (directory / "scene.xml").write_text(scene_mjcf(self.task, self.hand, motion))
        given = {name: getattr(motion, name) for name in Motion.__dataclass_fields__}
        arrays: dict[str, Any] = {name: np.asarray(a) for name, a in given.items() if a is not None}
        np.savez(directory / "motion.npz", **arrays)
        record = result(self.task, self.hand, len(motion.time))
        (directory / "result.json").write_text(json.dumps({**record, **self.changes}))
        return directory

    def moved(self, **arrays: Any) -> Scene:
        """Return the scene with other arrays in its motion."""
        return replace(self, motion=replace(self.motion, **arrays))


def read_task(directory: Path, text: str) -> Task:
    """Load a task from YAML text."""
    directory.mkdir(parents=True, exist_ok=True)
    (directory / "written.yaml").write_text(text)
    return load_task(directory / "written.yaml")


def _element(parent: ElementTree.Element, tag: str, **attributes: Any) -> ElementTree.Element:
    def text(value: Any) -> str:
        return value if isinstance(value, str) else " ".join(repr(float(x)) for x in np.atleast_1d(value))

    return ElementTree.SubElement(parent, tag, {name: text(value) for name, value in attributes.items()})


def _inertial(link: ElementTree.Element, mass: float, center: Any, inertia: np.ndarray) -> None:
    inertial = _element(link, "inertial")
    _element(inertial, "origin", xyz=center)
    _element(inertial, "mass", value=mass)
    names = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    _element(inertial, "inertia", **{name: inertia[at] for name, at in names.items()})


def _capsule(link: ElementTree.Element, start: Any, end: Any, radius: float) -> None:
    bar = np.any(np.subtract(end, start))
    for role in ("visual", "collision"):
        for at in (start, end) if bar else (start,):
            _shape(link, role, "sphere", at, [0.0, 0.0, 0.0], radius=radius)
    if bar:
        _cylinder(link, start, end, radius)


def _cylinder(link: ElementTree.Element, start: Any, end: Any, radius: float) -> None:
    start, end = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    length = float(np.linalg.norm(end - start))
    x, y, z = (end - start) / length
    for role in ("visual", "collision"):
        # Rolling by a about x and pitching by b about y takes z to (sin b cos a, -sin a, cos b cos a).
        turn = [np.arcsin(-y), np.arctan2(x, z), 0.0]
        _shape(link, role, "cylinder", (start + end) / 2, turn, radius=radius, length=length)


def _roll_pitch_yaw(bend: tuple[float, float]) -> np.ndarray:
    angles: np.ndarray = Rotation.from_rotvec([*bend, 0.0]).as_euler("xyz")
    return angles


def _shape(link: ElementTree.Element, role: str, kind: str, at: Any, turn: Any, **sizes: float) -> None:
    element = _element(link, role)
    _element(element, "origin", xyz=at, rpy=turn)
    _element(_element(element, "geometry"), kind, **sizes)


def _disc_inertia(mass: float, radius: float, thickness: float) -> np.ndarray:
    across = mass * (3 * radius**2 + thickness**2) / 12
    return np.diag([across, across, mass * radius**2 / 2])


def _palm_inertial(hand: Hand) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre of mass and inertia about it: a disc, and a ball where a hinged finger stands."""
    mass = hand.density * np.pi * hand.palm_radius**2 * hand.palm_thickness
    disc = _disc_inertia(mass, hand.palm_radius, hand.palm_thickness)
    parts = [(mass, np.array([0.0, 0.0, -hand.palm_thickness / 2]), disc)]
    for finger in hand.fingers:
        if finger.links[0].hinge:
            radius = finger.links[0].radius
            ball = hand.density * 4 / 3 * np.pi * radius**3
            parts.append((ball, np.array(finger.base), 2 / 5 * ball * radius**2 * np.eye(3)))
    total = sum(part[0] for part in parts)
    center = np.sum([part[0] * part[1] for part in parts], axis=0) / total
    inertia = np.sum([own - m * _skew(at - center) @ _skew(at - center) for m, at, own in parts], axis=0)
    return float(total), center, inertia


def _capsule_inertia(mass: float, radius: float, length: float) -> np.ndarray:
    """A cylinder and a ball cut in two, by the parallel axes' theorem, applied to half a ball twice."""
    rod = mass * length / (length + 4 / 3 * radius)
    ball = mass - rod
    across = rod * (3 * radius**2 + length**2) / 12
    # About its own centre half a ball has 83/320 m r², and its centre is 3/8 r off the flat face.
    across += ball * (83 / 320 * radius**2 + (length / 2 + 3 / 8 * radius) ** 2)
    return np.diag([across, across, rod * radius**2 / 2 + ball * 2 / 5 * radius**2])


def hand_urdf(hand: Hand) -> str:
    """Write the hand as the format says."""
    robot = ElementTree.Element("robot", name="hand")
    palm = _element(robot, "link", name="palm")
    middle, size = [0.0, 0.0, -hand.palm_thickness / 2], {"radius": hand.palm_radius, "length": hand.palm_thickness}
    _inertial(palm, *_palm_inertial(hand))
    for role in ("visual", "collision"):
        _shape(palm, role, "cylinder", middle, [0.0, 0.0, 0.0], **size)
    for finger in hand.fingers:
        if finger.links[0].hinge:
            _capsule(palm, finger.base, finger.base, finger.links[0].radius)
    for i, finger in enumerate(hand.fingers):
        parent, origin = "palm", np.asarray(finger.base)
        for j, segment in enumerate(finger.links):
            name = f"finger{i}_link{j}"
            link = _element(robot, "link", name=name)
            long, start = segment.length - segment.hinge, [0, 0, segment.hinge]
            mass = hand.density * np.pi * segment.radius**2 * (long + 4 / 3 * segment.radius)
            _inertial(link, mass, [0, 0, segment.hinge + long / 2], _capsule_inertia(mass, segment.radius, long))
            _capsule(link, start, [0, 0, segment.length], segment.radius)
            joint = _element(robot, "joint", name=f"finger{i}_joint{j}", type="revolute")
            _element(joint, "parent", link=parent)
            _element(joint, "child", link=name)
            _element(joint, "origin", xyz=origin, rpy=_roll_pitch_yaw(segment.bend))
            _element(joint, "axis", xyz=segment.axis)
            limits = {"lower": hand.joint_lower, "upper": hand.joint_upper}
            _element(joint, "limit", **limits, effort=hand.effort, velocity=hand.velocity)
            parent, origin = name, np.array([0, 0, segment.length])
    return ElementTree.tostring(robot, encoding="unicode")


def object_urdf(task: Task) -> str:
    """Write the object as the format says."""
    robot = ElementTree.Element("robot", name="object")
    link = _element(robot, "link", name="object")
    _inertial(link, task.object.mass, [0, 0, 0], np.asarray(task.object.inertia))
    for k, shape in enumerate(task.object.shapes):
        kind, given = _shape_given(shape)
        _SOLIDS[kind](link, given | ({"file": f"meshes/{k}.obj"} if kind == "convex" else {}))
    return ElementTree.tostring(robot, encoding="unicode")


def result(task: Task, hand: Hand, samples: int) -> dict[str, Any]:
    """Return the part of result.json that the audit reads."""
    fingers = [
        {
            "name": f.name,
            "base": f.base,
            "links": [
                {
                    "length": s.length,
                    "radius": s.radius,
                    "axis": Rotation.from_rotvec([*s.bend, 0.0]).apply(s.axis).tolist(),
                    "bend": s.bend,
                    "hinge": s.hinge,
                }
                for s in f.links
            ],
        }
        for f in hand.fingers
    ]
    goals = [
        {
            "time": goal.at,
            "position": list(goal.position or (0, 0, 0)),
            "orientation": Rotation.from_rotvec(goal.rotation.vector).as_quat(scalar_first=True).tolist(),
        }
        for goal in task.motion
    ]
    return {
        "format": 1,
        "status": "feasible",
        "task": task.name,
        "task_hash": hashlib.sha256(task_to_yaml(task).encode()).hexdigest(),
        "object": {
            "mass": task.object.mass,
            "inertia": np.asarray(task.object.inertia).tolist(),
            "shapes": [{"type": kind, **given} for kind, given in map(_shape_given, task.object.shapes)],
        },
        "friction": task.friction,
        "gravity": list(task.gravity),
        "ground_height": task.ground.height if task.ground else None,
        "ground_friction": task.ground.friction if task.ground else None,
        "goals": goals,
        "hand": {
            "palm": {"radius": hand.palm_radius, "thickness": hand.palm_thickness},
            "fingers": fingers,
            "joint_lower": hand.joint_lower,
            "joint_upper": hand.joint_upper,
            "effort": hand.effort,
            "velocity": hand.velocity,
            "density": hand.density,
            **({"servo": hand.servo} if hand.servo else {}),
        },
        "degrees_of_freedom": hand.degrees_of_freedom,
        "samples": samples,
    }


def _shape_given(shape: Any) -> tuple[str, dict[str, Any]]:
    """A primitive's kind and what its task file says of it."""
    ((kind, given),) = shape.model_dump(mode="json").items()
    return kind, given


_SOLIDS: dict[str, Callable[[ElementTree.Element, dict[str, Any]], None]] = {
    "sphere": lambda link, given: _capsule(link, given["center"], given["center"], given["radius"]),
    "capsule": lambda link, given: _capsule(link, given["start"], given["end"], given["radius"]),
    "cylinder": lambda link, given: _cylinder(link, given["start"], given["end"], given["radius"]),
    "box": lambda link, given: _flat(link, "box", given["center"], _box_turn(given), size=given["size"]),
    "convex": lambda link, given: _flat(link, "mesh", [0, 0, 0], [0, 0, 0], filename=given["file"]),
}


def _flat(link: ElementTree.Element, kind: str, at: Any, turn: Any, **given: Any) -> None:
    for role in ("visual", "collision"):
        element = _element(link, role)
        _element(element, "origin", xyz=at, rpy=turn)
        _element(_element(element, "geometry"), kind, **given)


def _box_turn(given: dict[str, Any]) -> np.ndarray:
    axis = np.asarray(given["rotation"]["axis"]) / np.linalg.norm(given["rotation"]["axis"])
    turn = Rotation.from_rotvec(np.radians(given["rotation"]["degrees"]) * axis)
    angles: np.ndarray = turn.as_euler("xyz")
    return angles


MASS, RADIUS, TIP = 0.1, 0.02, 0.006
STAND = 1.05 * TIP
"""m of a finger's first joint above the palm's face."""
CONTACTS = np.array([[RADIUS, 0.0, 0.004], *([-RADIUS / 2, s * RADIUS * np.sqrt(3) / 2, -0.002] for s in (1, -1))])
"""(3, 3) contact points on a capsule's side, 120 degrees apart, object frame."""


def _skew(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


GRASP = np.vstack([np.hstack([np.eye(3)] * 3), np.hstack([_skew(point) for point in CONTACTS])])
"""(6, 9) contact forces to force and torque on the object, its frame."""
NORMALS = np.array([[point[0], point[1], 0.0] for point in CONTACTS]) / RADIUS
"""(3, 3) outward, of the object's surface at the contacts."""

_RIM = [(2 * RADIUS * np.cos(a), 2 * RADIUS * np.sin(a)) for a in np.pi / 3 * np.array([1, 3, 5])]
SIZES = {"convex": f"vertices: {[[float(x), float(y), z] for x, y in _RIM for z in (-0.03, 0.03)]}"}
"""Of a prism whose three sides touch the cylinder where fingers do."""

_TASK = """
name: carried
object: {{mass: 0.1, shapes: [{{{shape}: {{{sizes}}}}}]}}
palm: {{radius: 0.05, position: [0, 0, 0.2], facing: [0, 0, 1], moves: true}}
motion:
{goals}
fingers: {{one: {{touches: {0}}}, two: {{touches: {1}}}, three: {{touches: {2}}}}}
friction: 0.9
hand: {{joint_limits: [-150, 150], link_radius: {link}, hinge_length: {hinge}}}
actuator: {{torque: 0.5, speed: 5}}
limits: {{unsupplied_force: 10}}
{fingertip}
"""


def carried(
    directory: Path,
    more: str = "",
    shape: str = "capsule",
    hard: bool = False,
    bent: bool = False,
    hinge: float = 0.0,
    link: float = TIP,
) -> Scene:
    """Three fingers of two joints, held stiff, and an object between them; the palm carries all along a free curve.

    Forces and torsional moments are chosen first and SciPy integrates the object under them; the palm then follows it
    rigidly. So physics holds to the integrator's 1e-12, nothing slips or spins, and the contact points stay where they
    are. It starts and ends at rest. Where the task has perturbations, the least forces beside the plan's bear them.

    Args:
        directory: for the task's file.
        more: sections of the task beside those of `_TASK`.
        shape: of the object, ``capsule`` or ``cylinder``, or ``convex``, a prism about them; contacts are on the side
            that all have.
        hard: whether fingertips are points, without moments.
        bent: whether links are bent at zero angle; they stand where straight ones do.
        hinge: from a joint to where its link's body begins, m; 0 where neighbours share a ball.
        link: radius of first links, m; that of fingertips stays as it is.
    """
    tip = {"torsion": 0} if hard else {}
    fingertip = f"fingertip: {tip if link == TIP else tip | {'radius': TIP}}"
    time, ends = np.linspace(0.0, 2.0, 21), [[0, 0, 0.28]] * 2
    places = [c.tolist() for c in CONTACTS]
    goals = _goals([0, 2], ends, [[1, 0, 0, 0]] * 2)
    sizes = SIZES.get(shape, "start: [0, 0, -0.03], end: [0, 0, 0.03], radius: 0.02")
    given = {"shape": shape, "sizes": sizes, "fingertip": fingertip, "hinge": hinge, "link": link}
    task = read_task(directory, _TASK.format(*places, goals=goals, **given))
    moments = np.zeros((len(time), 3, 3)) if hard else _moments(time)
    forces, position, quaternion = _carrying(task, moments)
    goals = _goals([0, 1, 2], position[[0, 10, 20]], quaternion[[0, 10, 20]])
    task = read_task(directory, _TASK.format(*places, goals=goals, **given) + more)
    hand, angles, points = _grasp(task, BENDS if bent else ((0.0, 0.0),) * 2)
    turn = Rotation.from_quat(quaternion, scalar_first=True)
    base = Rotation.from_matrix(task.palm.rotation)
    samples = len(time)
    motion = Motion(
        time=time,
        object_position=position,
        object_orientation=quaternion,
        base_position=position + turn.apply([0, 0, -0.08]),
        base_orientation=(turn * base).as_quat(scalar_first=True),
        joint_angles=np.tile(angles, (samples, 1)),
        joint_names=hand.joint_names,
        contact_names=("one", "two", "three"),
        contact_link=("finger0_link1", "finger1_link1", "finger2_link1"),
        contact_active=np.ones((samples, 3), dtype=bool),
        contact_force=np.array([turn[k].apply(forces[k]) for k in range(samples)]),
        contact_point_object=np.tile(CONTACTS, (samples, 1, 1)),
        contact_point_link=np.tile(points, (samples, 1, 1)),
        external_force=np.zeros((samples, 3)),
        external_torque=np.zeros((samples, 3)),
        contact_moment=None if hard else np.array([turn[k].apply(moments[k]) for k in range(samples)]),
    )
    return Scene(task, hand, _disturbed(task, motion, turn) if task.perturbations else motion)


def _disturbed(task: Task, motion: Motion, turn: Rotation) -> Motion:
    """Return the motion with its second scenario; perturbations must begin and end between samples, or at none."""
    force, torque = np.zeros((len(motion.time), 3)), np.zeros((len(motion.time), 3))
    for push in task.perturbations:
        acts = (motion.time > push.start) & (motion.time < push.end)
        if not acts.any():
            acts[np.argmin(np.abs(motion.time - (push.start + push.end) / 2))] = True
        force[acts] += push.force
        torque[acts] += push.torque
    wrench = np.hstack([turn.apply(force, inverse=True), turn.apply(torque, inverse=True)])
    more = np.linalg.lstsq(GRASP, -wrench.T, rcond=None)[0].T.reshape(-1, 3, 3)
    more = np.array([turn[k].apply(row) for k, row in enumerate(more)])
    return replace(
        motion,
        contact_force_disturbed=motion.contact_force + more,
        external_force_disturbed=force,
        external_torque_disturbed=torque,
    )


def _goals(times: Any, positions: Any, quaternions: Any) -> str:
    lines = [
        f"  - {{at: {float(t)}, position: {list(p)}, rotation: {{quaternion: {list(q)}}}}}"
        for t, p, q in zip(times, np.asarray(positions).tolist(), np.asarray(quaternions).tolist(), strict=True)
    ]
    return "\n".join(lines)


def _moments(time: np.ndarray) -> np.ndarray:
    """Return torsional moments (S, 3, 3) on the object, N·m, in its frame: a part of what the fingertips bear."""
    sizes = [0.5 * np.cos(np.pi * time), -0.3 + 0.0 * time, np.sin(np.pi * time)]
    moments: np.ndarray = 3e-4 * np.column_stack(sizes)[:, :, None] * NORMALS
    return moments


def _carrying(task: Task, moments: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return contact forces (S, 3, 3) in the object's frame, and positions and orientations that follow from them.

    A squeeze, what a planned motion needs roughly, and a little more in the middle, by which it ends at rest.
    """
    known = task.object.model_dump_json(), task.gravity, moments.tobytes()
    if known not in _carryings:
        time, inertia = np.linspace(0.0, 2.0, 21), np.asarray(task.object.inertia)
        torques = moments.sum(axis=1)
        rough = _rough_forces(time, task.object.mass, inertia, torques)
        body = CONTACTS, task.object.mass, inertia, np.asarray(task.gravity), np.array([0, 0, 0.28])

        def carry(wrench: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            more = np.outer(np.sin(np.pi * time / time[-1]), np.linalg.pinv(GRASP) @ wrench).reshape(-1, 3, 3)
            return rough + more, _integrated(time, rough + more, *body, torques=torques)

        def speeds(wrench: np.ndarray) -> np.ndarray:
            last = carry(wrench)[1][-1]
            return np.concatenate([last[3:6], last[15:]])

        wrench, ends = np.zeros(6), speeds(np.zeros(6))
        steps = 1e-3 * np.array([*[1.0] * 3, *[0.01] * 3])
        slope = np.column_stack([(speeds(step) - ends) / step.sum() for step in np.diag(steps)])
        while np.abs(ends).max() > 1e-10:
            wrench = wrench - np.linalg.solve(slope, ends)
            ends = speeds(wrench)
        forces, states = carry(wrench)
        _carryings[known] = forces, states[:, :3], _quaternions(states)
    return _carryings[known]


_carryings: dict[Any, tuple[np.ndarray, np.ndarray, np.ndarray]] = {}


def _rough_forces(time: np.ndarray, mass: float, inertia: np.ndarray, torques: np.ndarray) -> np.ndarray:
    """Return (S, 3, 3) contact forces in the object's frame: a squeeze, and what a planned motion needs roughly.

    Args:
        time: s.
        mass: of the object, kg.
        inertia: kg·m², its frame.
        torques: (S, 3) N·m that act beside them.
    """
    axis = np.array([1.0, 2.0, 0.5]) / np.linalg.norm([1.0, 2.0, 0.5])
    inward = (-1.5 * np.array([[p[0], p[1], 0.0] for p in CONTACTS]) / RADIUS).ravel()
    squeeze = inward - np.linalg.lstsq(GRASP, GRASP @ inward, rcond=None)[0]
    forces = []
    for t, torque in zip(time, torques, strict=True):
        angle, spin_up = 0.25 * (1 - np.cos(np.pi * t)), 0.25 * np.pi**2 * np.cos(np.pi * t)
        acceleration = 0.02 * np.pi**2 * np.cos(np.pi * t) * np.array([1.0, 0.5, 0.3])
        turn = Rotation.from_rotvec(angle * axis)
        force = turn.apply(mass * (acceleration + np.array([0, 0, 9.81])), inverse=True)
        wrench = np.concatenate([force, inertia @ axis * spin_up - torque])
        forces.append(np.linalg.lstsq(GRASP, wrench, rcond=None)[0] + squeeze)
    return np.array(forces).reshape(-1, 3, 3)


def integrate(
    time: np.ndarray,
    forces: np.ndarray,
    points: np.ndarray,
    mass: float,
    inertia: np.ndarray,
    gravity: np.ndarray,
    start: np.ndarray,
    rate: Any = (0.0, 0.0, 0.0),
    torques: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Integrate a body with SciPy under forces (S, C, 3) at fixed points (C, 3) and torques (S, 3), all in its frame.

    Returns:
        positions (S, 3) and orientations (S, 4) [w, x, y, z] ; it starts upright, at rest but for ``rate``.
    """
    states = _integrated(time, forces, points, mass, inertia, gravity, start, rate, torques)
    return states[:, :3], _quaternions(states)


def _quaternions(states: np.ndarray) -> np.ndarray:
    quaternions: np.ndarray = Rotation.from_matrix(states[:, 6:15].reshape(-1, 3, 3)).as_quat(scalar_first=True)
    return quaternions


def _integrated(
    time: np.ndarray,
    forces: np.ndarray,
    points: np.ndarray,
    mass: float,
    inertia: np.ndarray,
    gravity: np.ndarray,
    start: np.ndarray,
    rate: Any = (0.0, 0.0, 0.0),
    torques: np.ndarray | None = None,
) -> np.ndarray:
    """Return states (S, 18): position, velocity, rotation matrix, rate in the body's frame."""
    beside = np.zeros((len(time), 3)) if torques is None else torques
    states = [np.concatenate([start, np.zeros(3), np.eye(3).ravel(), rate])]
    for k in range(len(time) - 1):

        def slope(t: float, y: np.ndarray, k: int = k) -> np.ndarray:
            share = (t - time[k]) / (time[k + 1] - time[k])
            force = (1 - share) * forces[k] + share * forces[k + 1]
            turn, omega = y[6:15].reshape(3, 3), y[15:]
            torque = sum(_skew(p) @ f for p, f in zip(points, force, strict=True))
            torque += (1 - share) * beside[k] + share * beside[k + 1]
            acceleration = turn @ force.sum(axis=0) / mass + gravity
            spin = np.linalg.solve(inertia, torque - np.cross(omega, inertia @ omega))
            return np.concatenate([y[3:6], acceleration, (turn @ _skew(omega)).ravel(), spin])

        solution = solve_ivp(slope, time[k : k + 2], states[-1], method="DOP853", rtol=1e-13, atol=1e-15)
        states.append(solution.y[:, -1])
    return np.array(states)


BENDS = ((20.0, -15.0), (-30.0, 10.0))
"""Degrees that a finger's bent links are bent about the axis that straight ones turn about, and across that."""


def _grasp(task: Task, bends: tuple[tuple[float, float], ...]) -> tuple[Hand, np.ndarray, np.ndarray]:
    """Return a hand whose three fingers touch the contacts, its angles (6,) and link points (3, 3).

    Each finger leans out and then in, in the plane of the palm's normal and its contact's direction.
    """
    to_palm = Rotation.from_matrix(task.palm.rotation).inv()
    fingers, angles, points = [], [], []
    out_angle, in_angle = np.deg2rad(30.0), np.deg2rad(-25.0)
    for name, contact in zip(task.fingers, CONTACTS, strict=True):
        radial = to_palm.apply([contact[0], contact[1], 0.0]) / RADIUS
        tip = to_palm.apply(contact) + [0, 0, 0.08] + TIP * radial
        outer, inner = _lean(radial, out_angle), _lean(radial, in_angle)
        # Both lengths follow from where the tip is once the base is 38 mm from the palm's centre, on its face.
        base = 0.038 * radial + [0.0, 0.0, 1.05 * float(task.hand.link_radius)]
        lengths = np.linalg.lstsq(np.column_stack([outer, inner]), tip - base, rcond=None)[0]
        axis, turn, links = np.cross([0, 0, 1], radial), Rotation.identity(), []
        thick = float(task.hand.link_radius), TIP
        for length, way, bend, radius in zip(lengths, (outer, inner), bends, thick, strict=True):
            link, angle = _pointing(float(length), turn.apply(way, inverse=True), axis, np.deg2rad(bend))
            link = replace(link, radius=radius, hinge=float(task.hand.hinge_length) / thick[0] * radius)
            turn *= Rotation.from_rotvec([*link.bend, 0.0]) * Rotation.from_rotvec(angle * np.array(link.axis))
            links.append(link)
            angles.append(angle)
        fingers.append(Finger(name, tuple(base.tolist()), tuple(links)))
        points.append(turn.apply(-TIP * radial, inverse=True) + np.array([0, 0, lengths[1]]))
    limits = np.deg2rad(150.0)
    hand = Hand(0.05, float(task.palm.thickness), tuple(fingers), -limits, limits, 0.5, 5.0, float(task.hand.density))
    return hand, np.array(angles), np.array(points)


def _pointing(length: float, way: np.ndarray, about: np.ndarray, bend: np.ndarray) -> tuple[Link, float]:
    """Return a link and its joint's angle at which it points along ``way`` (3,), unit, in its parent's frame.

    Its joint's axis stands across it, near ``about`` (3,), unit, across z; ``bend`` (2,) is about that and across it.
    """
    vector = bend[0] * about + bend[1] * np.cross([0.0, 0.0, 1.0], about)
    left = Rotation.from_rotvec(vector).apply(way, inverse=True)
    across = np.cross([0.0, 0.0, 1.0], left)
    sine = float(np.linalg.norm(across)) * (1.0 if about @ across > 0 else -1.0)
    x, y, z = (across / sine).tolist()
    return Link(length, TIP, (x, y, z), (float(vector[0]), float(vector[1]))), float(np.arctan2(sine, left[2]))


def _lean(radial: np.ndarray, angle: float) -> np.ndarray:
    leaning: np.ndarray = np.cos(angle) * np.array([0.0, 0.0, 1.0]) + np.sin(angle) * radial
    return leaning


def plain(task: Task, time: np.ndarray, links: int = 1, **arrays: Any) -> Scene:
    """A hand of straight fingers on the palm's rim, touching nothing, and an object that stands at its first goal.

    Arrays given by name replace those of the motion; every finger has a contact, none of them active.
    """
    fingers = []
    for i, name in enumerate(task.fingers):
        turn = 2 * np.pi * i / len(task.fingers)
        base = (0.8 * task.palm.radius * np.cos(turn), 0.8 * task.palm.radius * np.sin(turn), STAND)
        fingers.append(Finger(name, base, (Link(0.04, TIP, (0.0, 1.0, 0.0)),) * links))
    limit, samples, contacts = float(np.deg2rad(150.0)), len(time), len(fingers)
    hand = Hand(task.palm.radius, task.palm.thickness, tuple(fingers), -limit, limit, 1.0, 5.0, task.hand.density)
    start = np.asarray(task.motion[0].position or (0.0, 0.0, 0.0))
    base_turn = Rotation.from_matrix(task.palm.rotation).as_quat(scalar_first=True)
    rows: dict[str, Any] = {
        "time": time,
        "object_position": np.tile(start, (samples, 1)),
        "object_orientation": np.tile([1.0, 0.0, 0.0, 0.0], (samples, 1)),
        "base_position": np.tile(np.asarray(task.palm.position), (samples, 1)),
        "base_orientation": np.tile(base_turn, (samples, 1)),
        "joint_angles": np.zeros((samples, hand.degrees_of_freedom)),
        "joint_names": hand.joint_names,
        "contact_names": tuple(task.fingers),
        "contact_link": tuple(f"finger{i}_link{links - 1}" for i in range(contacts)),
        "contact_active": np.zeros((samples, contacts), dtype=bool),
        "contact_force": np.zeros((samples, contacts, 3)),
        "contact_point_object": np.zeros((samples, contacts, 3)),
        "contact_point_link": np.zeros((samples, contacts, 3)),
        "external_force": np.zeros((samples, 3)),
        "external_torque": np.zeros((samples, 3)),
    }
    return Scene(task, hand, Motion(**{**rows, **arrays}))


SPHERE = """
name: ball
object: {mass: 0.2, shapes: [{sphere: {center: [0, 0, 0], radius: 0.03}}]}
palm: {radius: 0.05, position: [0, 0, -0.5], facing: [0, 0, 1]}
motion: [{at: 0, position: [0, 0, 0]}, {at: 1, position: [0, 0, 0]}]
fingers: {left: {touches: [-0.03, 0, 0]}, right: {touches: [0.03, 0, 0]}}
friction: 0.5
hand: {joint_limits: [-150, 150], link_radius: 0.006, hinge_length: 0}
"""
"""A ball of 3 cm that stands half a metre over an upright palm, for scenes where the hand matters little."""


TWIST = SPHERE.replace("position: [0, 0, -0.5]", "position: [-0.076, 0, -0.02]")
TWIST = TWIST.replace("[-150, 150]", "[-170, 170], axes: {from_link: [0, 90]}")


def geared(directory: Path, ball: float, finger: float) -> Scene:
    """A finger along z that turns about its own axis against the ball, like two gears; both in radians, in all."""
    task, time = read_task(directory, TWIST), np.linspace(0.0, 1.0, 11)
    scene = plain(task, time)
    fingers = tuple(
        type(f)(f.name, f.base, (type(f.links[0])(0.04, TIP, (0.0, 0.0, 1.0)),)) for f in scene.hand.fingers
    )
    # The palm stands so that the left finger's axis passes the ball's centre at the sum of radii, to the ball's left.
    base = Rotation.from_matrix(task.palm.rotation)
    place = np.array([-0.03 - TIP, 0, -0.02]) - base.apply(fingers[0].base)
    angles, turned = np.zeros((11, 2)), Rotation.from_rotvec(np.outer(ball * time, [0, 0, 1.0]))
    angles[:, 0] = finger * time
    link = base * Rotation.from_rotvec(np.outer(angles[:, 0], [0, 0, 1.0]))
    touch, side = np.array([-0.03, 0, 0]), np.array([TIP, 0, 0])
    on_object, on_link = turned.apply(touch, inverse=True), link.apply(side, inverse=True) + np.array([0, 0, 0.02])
    return Scene(task, type(scene.hand)(**{**vars(scene.hand), "fingers": fingers}), scene.motion).moved(
        base_position=np.tile(place, (11, 1)),
        joint_angles=angles,
        object_orientation=turned.as_quat(scalar_first=True),
        contact_active=np.tile([True, False], (11, 1)),
        contact_point_object=np.stack([on_object, 0 * on_object], axis=1),
        contact_point_link=np.stack([on_link, 0 * on_link], axis=1),
    )
