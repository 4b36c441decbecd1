"""Do ``hand.urdf``, ``object.urdf``, ``result.json`` and ``task.yaml`` state the same facts?"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.verify.bodies import Body, swept_inertial
from casadi_hands.verify.checks.servos import put_together
from casadi_hands.verify.checks.sizes import hinge_of, radius_of
from casadi_hands.verify.forms import FORMS
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.reading.stored import as_array, brief, entry, same
from casadi_hands.verify.shapes import Capsule, Cylinder, Shape

STATUSES = ("certified", "feasible", "failed")


def object_problems(folder: Folder) -> list[str]:
    """Return where the object is not the same in ``object.urdf``, ``task.yaml`` and ``result.json``."""
    body, task, stated = folder.object, folder.task, entry(folder.result, "object")
    problems = []
    for source, mass, inertia in (
        ("task.yaml", task.object.mass, np.asarray(task.object.inertia).tolist()),
        ("result.json", entry(stated, "mass"), entry(stated, "inertia")),
    ):
        if not same(mass, body.mass):
            problems.append(f"mass: object.urdf says {body.mass:.6g} kg, {source} says {mass} kg")
        if not same(inertia, body.inertia):
            problems.append(f"inertia of the object: object.urdf and {source} disagree")
    if not np.all(np.abs(body.center_of_mass) <= 1e-6 * folder.length):
        problems.append("object.urdf: the link's frame is not the centre of mass")
    return problems + _shape_problems(folder)


def _shape_problems(folder: Folder) -> list[str]:
    """Return where the object's shapes are not the same in the three files."""
    problems, bodies = [], folder.object.shapes
    given = [next(iter(shape.model_dump(mode="json").items())) for shape in folder.task.object.shapes]
    shapes = [_shape(kind, numbers) for kind, numbers in given]
    if not all(shape is not None and any(shape.agrees(body) for body in bodies) for shape in shapes):
        problems.append("shapes: object.urdf has not the shapes of task.yaml")
    if not all(any(shape is not None and shape.agrees(body) for shape in shapes) for body in bodies):
        problems.append("shapes: object.urdf has a shape that is not in task.yaml")
    if len(bodies) != len(shapes):
        problems.append(f"shapes: object.urdf has {len(bodies)}, task.yaml has {len(shapes)}")
    listed = entry(folder.result, "object", "shapes")
    if not isinstance(listed, list) or len(listed) != len(shapes):
        problems.append("shapes: result.json has not as many as task.yaml")
    elif not all(_is_stated(item, *each) for item, each in zip(listed, given, strict=True)):
        problems.append("shapes: those of result.json are not those of task.yaml")
    return problems


def _shape(kind: Any, numbers: Any) -> Shape | None:
    """Return what a kind and its numbers state, or None where they state no shape that is measured."""
    form = FORMS.get(kind) if isinstance(kind, str) else None
    return None if form is None else form.read(numbers)


def _is_stated(item: Any, kind: str, numbers: dict[str, Any]) -> bool:
    """Whether a result states a task's shape; a capsule of no length may be called a sphere."""
    stated, due = _shape(entry(item, "type"), item), _shape(kind, numbers)
    if stated is None or due is None or not due.agrees(stated):
        return False
    return all(same(entry(item, name), numbers[name]) for name in FORMS[kind].lengths)


def record_problems(folder: Folder) -> list[str]:
    """Return where ``result.json`` states other facts than ``task.yaml`` and ``motion.npz``."""
    task, record = folder.task, folder.result
    ground = task.ground
    facts: dict[str, Any] = {
        "task": folder.written.name,
        "friction": task.friction,
        "gravity": list(task.gravity),
        "ground_height": ground.height if ground else None,
        "ground_friction": ground.friction if ground else None,
    }
    sizes = {"degrees_of_freedom": len(folder.motion.joint_names), "samples": len(folder.motion.time)}
    problems = []
    for key, value in {**facts, **sizes}.items():
        stated = record.get(key)
        agrees = stated == value if value is None or isinstance(value, str) else same(stated, value)
        if not agrees:
            source = "motion.npz" if key in sizes else "task.yaml"
            problems.append(f"{key}: result.json says {brief(stated)}, {source} says {brief(value)}")
    if record.get("status") not in STATUSES:
        problems.append(f"status: result.json says {brief(record.get('status'))}, not one of {', '.join(STATUSES)}")
    return problems + _goal_problems(folder)


def _goal_problems(folder: Folder) -> list[str]:
    goals, stated, tool = folder.task.motion, folder.result.get("goals"), folder.task.tool
    if not isinstance(stated, list) or len(goals) != len(stated):
        count = len(stated) if isinstance(stated, list) else "none"
        return [f"goals: result.json has {count}, task.yaml has {len(goals)}"]
    problems = []
    for number, (goal, other) in enumerate(zip(goals, stated, strict=True), start=1):
        agree = same(entry(other, "time"), goal.at)
        if tool is not None:
            agree &= same(entry(other, "point"), goal.tool_at) and same(entry(other, "tool_point"), tool)
        else:
            quaternion = as_array(entry(other, "orientation"), (4,))
            agree &= same(entry(other, "position"), goal.position)
            agree &= quaternion is not None and abs(float(np.linalg.norm(quaternion)) - 1.0) < 1e-6
            if agree:
                turn = Rotation.from_rotvec(goal.rotation.vector).inv()
                agree = (turn * Rotation.from_quat(quaternion, scalar_first=True)).magnitude() < 1e-6
        exerts = entry(other, "exert")
        if goal.exert is None:
            agree &= exerts is None
        else:
            agree &= all(same(entry(exerts, name), getattr(goal.exert, name)) for name in ("force", "torque"))
        if not agree:
            problems.append(f"goals: goal {number} of result.json is not that of task.yaml")
    return problems


def hand_problems(folder: Folder) -> list[str]:
    """Return where the hand is not the same in ``hand.urdf`` and ``result.json``."""
    hand = folder.result.get("hand")
    fingers = entry(hand, "fingers")
    if not isinstance(fingers, list) or not all(isinstance(entry(finger, "links"), list) for finger in fingers):
        return ["hand: result.json has no list of fingers with their links"]
    problems = []
    for key, values in {
        "joint_lower": [joint.lower for joint in folder.joints.values()],
        "joint_upper": [joint.upper for joint in folder.joints.values()],
        "effort": [joint.effort for joint in folder.joints.values()],
        "velocity": [joint.velocity for joint in folder.joints.values()],
    }.items():
        off = [name for name, value in zip(folder.joints, values, strict=True) if not same(entry(hand, key), value)]
        if off:
            problems.append(f"{key}: joint {off[0]} has another in hand.urdf than result.json says")
    if not same(entry(hand, "density"), folder.task.hand.density):
        problems.append(f"density: result.json says {brief(entry(hand, 'density'))}, not the task's")
    links, joints = {"palm"}, set()
    for i, finger in enumerate(fingers):
        name = folder.fingers[i] if i < len(folder.fingers) else None
        if entry(finger, "name") != name:
            problems.append(f"fingers: finger {i} is '{entry(finger, 'name')}' in result.json, '{name}' in the task")
        for j, link in enumerate(finger["links"]):
            links.add(f"finger{i}_link{j}")
            joints.add(f"finger{i}_joint{j}")
            parent = f"finger{i}_link{j - 1}" if j else "palm"
            origin = entry(finger, "base") if j == 0 else [0, 0, entry(finger, "links", j - 1, "length")]
            problems += _link_problems(folder, f"finger{i}_link{j}", link, parent, origin)
    if len(fingers) != len(folder.fingers):
        problems.append(f"fingers: result.json has {len(fingers)}, the motion has contacts of {len(folder.fingers)}")
    problems += [f"hand.urdf: link {name} is not in result.json" for name in folder.links if name not in links]
    problems += [f"hand.urdf: joint {name} is not in result.json" for name in folder.joints if name not in joints]
    return problems + _palm_body_problems(folder, folder.links["palm"], entry(hand, "palm"))


def _palm_body_problems(folder: Folder, body: Body, stated: Any) -> list[str]:
    problems = []
    palm = folder.task.palm
    for name, due in (("radius", palm.radius), ("thickness", palm.thickness)):
        if not same(entry(stated, name), due):
            problems.append(f"palm: result.json says {brief(entry(stated, name))} m of {name}, the task {due:.6g} m")
    discs = [shape for shape in body.shapes if isinstance(shape, Cylinder)]
    if len(discs) != 1:
        return [*problems, "the palm: hand.urdf has not the one disc that it is"]
    disc, balls = discs[0], [shape for shape in body.shapes if shape is not discs[0]]
    due_balls = _palm_balls(folder)
    if len(balls) != len(due_balls) or not all(any(due.agrees(ball) for ball in balls) for due in due_balls):
        problems.append("the palm: its balls in hand.urdf are not those in which result.json has first joints turn")
    if not (same(disc.radius, palm.radius) and same(disc.length, palm.thickness)):
        problems.append(
            f"the palm: hand.urdf has a disc of {1e3 * disc.radius:.4g} mm × {1e3 * disc.length:.4g} mm,"
            f" the task one of {1e3 * palm.radius:.4g} mm × {1e3 * palm.thickness:.4g} mm"
        )
    elif not disc.agrees(Cylinder(np.array([0.0, 0.0, -palm.thickness]), np.zeros(3), palm.radius)):
        problems.append("the palm: its disc in hand.urdf is not behind the face with the fingers")
    middle = np.array([0.0, 0.0, -0.5 * palm.thickness])
    rim = float(palm.radius)
    flat = [(-float(palm.thickness), 0.0, rim, rim)]
    return problems + _mass_problems(folder, "the palm", body, flat, middle, due_balls)


def _palm_balls(folder: Folder) -> tuple[Capsule, ...]:
    """The balls in which first joints turn, where the task's links do not begin in their joints."""
    if not folder.task.hand.hinge_length:
        return ()
    first = [joint for joint in folder.joints.values() if joint.parent == "palm"]
    return tuple(Capsule(joint.position, joint.position, radius_of(folder, joint.child)) for joint in first)


def _link_problems(folder: Folder, name: str, stated: Any, parent: str, origin: Any) -> list[str]:
    who = folder.call(name)
    body, joint = folder.links.get(name), folder.joints.get(name.replace("_link", "_joint"))
    if body is None or joint is None or not body.capsules:
        return [f"{who}: result.json has it, hand.urdf has no such capsule"]
    length, radius = (as_array(entry(stated, key), ()) for key in ("length", "radius"))
    if length is None or radius is None or not (length > 0 and radius > 0):
        return [f"{who}: result.json states no length and radius"]
    problems = []
    capsule, tip = body.capsules[0], np.array([0.0, 0.0, float(length)])
    hinge = as_array(entry(stated, "hinge"), ()) if "hinge" in stated else np.zeros(())
    if hinge is None or not same(hinge, hinge_of(folder, name)):
        return [f"{who}: it does not begin a hinge's length from its joint, as the task has it"]
    root = np.array([0.0, 0.0, float(hinge)])
    if len(body.shapes) > 1:
        problems.append(f"{who}: hand.urdf has more than the one capsule that it is")
    if not capsule.agrees(Capsule(root, tip, float(radius))):
        problems.append(
            f"{who}: hand.urdf has a capsule of {1e3 * capsule.length:.4g} mm × {1e3 * capsule.radius:.4g} mm,"
            f" result.json one of {1e3 * (length - hinge):.4g} mm × {1e3 * radius:.4g} mm from its hinge on"
        )
    if joint.child != name or joint.parent != parent:
        problems.append(f"{who}: in hand.urdf it hangs on {folder.call(joint.parent)}, not on {folder.call(parent)}")
    place, near = as_array(origin, (3,)), 1e-6 * (float(length) + float(radius))
    if place is None or np.linalg.norm(joint.position - place) > near:
        words = "at its base" if parent == "palm" else "at the end of the link before"
        problems.append(f"{who}: its joint in hand.urdf is not {words} as result.json has it")
    axis = as_array(entry(stated, "axis"), (3,))
    if axis is None or abs(float(np.linalg.norm(axis)) - 1.0) > 1e-6:
        problems.append(f"{who}: its axis in result.json is not a unit vector")
    elif np.linalg.norm(axis - Rotation.from_euler("xyz", joint.turn).apply(joint.axis)) > 1e-6:
        problems.append(f"{who}: its axis in hand.urdf is not that of result.json")
    bend = as_array(entry(stated, "bend"), (2,)) if "bend" in stated else np.zeros(2)
    if bend is None:
        problems.append(f"{who}: result.json states no bend of two numbers")
    elif (Rotation.from_rotvec([*bend, 0.0]).inv() * Rotation.from_euler("xyz", joint.turn)).magnitude() > 1e-6:
        problems.append(f"{who}: its frame in hand.urdf is not turned at zero angle as result.json has it bent")
    low, high, round_ = float(hinge), float(length), float(radius)
    slices = [(low - round_, low, 0.0, round_), (low, high, round_, round_), (high, high + round_, round_, 0.0)]
    return problems + _mass_problems(folder, who, body, slices, (root + tip) / 2)


def _mass_problems(
    folder: Folder,
    who: str,
    body: Body,
    slices: list[tuple[float, float, float, float]],
    middle: np.ndarray,
    balls: tuple[Capsule, ...] = (),
) -> list[str]:
    """Return where a body's mass properties are not those of its solid at the task's density."""
    mass, inertia = swept_inertial(slices, float(middle[2]), float(folder.task.hand.density))
    due, servos = put_together(folder, body, mass, middle, inertia, balls), " and its servos" if body.cases else ""
    problems = []
    if not same(body.mass, due.mass, 1e-6):
        problems.append(f"{who}: {body.mass:.4g} kg is not its volume times the task's density{servos}")
    if np.linalg.norm(body.center_of_mass - due.center_of_mass) > 1e-6 * folder.length:
        problems.append(f"{who}: its centre of mass in hand.urdf is not in its middle{servos and ' with its servos'}")
    if not same(body.inertia, due.inertia):
        problems.append(f"{who}: its inertia in hand.urdf is not that of its solid{servos}")
    return problems
