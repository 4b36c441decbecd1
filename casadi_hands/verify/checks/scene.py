"""Is ``scene.xml`` the hand, the object and the world that the other files state, and does it collide as they do?"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.verify.bodies import Body
from casadi_hands.verify.checks.drive import scene_drive_problems
from casadi_hands.verify.checks.keyframes import keyframe_problems
from casadi_hands.verify.checks.motors import damping_problem, rotor_problems
from casadi_hands.verify.checks.mount import mount_problems
from casadi_hands.verify.checks.settings import settings_problems
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.reading.scene_file import Scene, SceneBody
from casadi_hands.verify.reading.stored import same

EXACT = 1e-6


def scene_problems(folder: Folder) -> list[str]:
    """Return where the scene is not what the other files say, a sentence each."""
    scene = folder.scene
    if scene is None:
        return [] if folder.legacy else ["scene.xml: missing"]
    if folder.legacy:  # which stood and was held in another way
        return []
    problems = [
        *scene.strange,
        *settings_problems(folder, scene.settings, palm_moves(folder)),
        *_world_problems(folder, scene),
        *_body_problems(folder, scene),
        *_hold_problems(folder, scene),
        *mount_problems(folder, scene),
        *rotor_problems(folder, scene),
        *(
            _servo_problems(folder, scene)
            if folder.drive is None
            else scene_drive_problems(folder, scene, folder.drive)
        ),
        *keyframe_problems(folder, scene),
    ]
    return [f"scene.xml: {problem}" for problem in problems]


def palm_moves(folder: Folder) -> bool:
    """Whether the palm's pose changes over the motion, where the task lets it."""
    motion, palm = folder.motion, folder.task.palm
    if not palm.may_move and len(palm.waypoints) == 1:
        return False
    shift = np.abs(motion.base_position - motion.base_position[0]).max() / folder.task.palm.radius
    turn = 1 - np.abs(motion.base_orientation @ motion.base_orientation[0]).min()
    return bool(shift > 1e-9 or turn > 1e-9)


def _world_problems(folder: Folder, scene: Scene) -> list[str]:
    """Gravity, the ground and friction."""
    problems, ground = [], folder.task.ground
    if not np.allclose(scene.gravity, folder.gravity, atol=1e-9, rtol=EXACT):
        problems.append(f"gravity is {scene.gravity.tolist()}, in task.yaml {folder.gravity.tolist()}")
    if len(scene.planes) != (0 if ground is None else 1) or any(plane.kind != "plane" for plane in scene.planes):
        due = "no ground" if ground is None else "a ground"
        problems.append(f"has {len(scene.planes)} solids beside hand and object; the task has {due}")
    elif ground is not None:
        plane = scene.planes[0]
        if abs(plane.place[2] - ground.height) > EXACT * folder.length:
            problems.append(f"the ground is at {plane.place[2]:.4g} m, in task.yaml at {ground.height:.4g} m")
        if not same(plane.friction[0], ground.friction) or np.any(plane.friction[1:]):
            problems.append(f"the ground's friction is {plane.friction.tolist()}, in task.yaml {ground.friction:g}")
        if not all(plane.priority > geom.priority for body in scene.bodies.values() for geom in body.geoms):
            problems.append("the ground's friction does not hold where the object touches it")
    for name, body in scene.bodies.items():
        who = folder.call(name)
        for slides in sorted(
            {geom.friction[0] for geom in body.geoms if not same(geom.friction[0], folder.task.friction)}
        ):
            problems.append(f"the friction of {who} is {slides:g}, in task.yaml {folder.task.friction:g}")
        if any(not same(geom.friction[1], folder.task.fingertip.torsion) or geom.friction[2] for geom in body.geoms):
            problems.append(f"{who} does not resist turning and rolling as the task's fingertips do")
    return problems


def _body_problems(folder: Folder, scene: Scene) -> list[str]:
    """Every body: where it hangs, its mass, its solids, its joint."""
    motion, moves = folder.motion, palm_moves(folder)
    due = {**folder.links, "object": folder.object}
    known = {*due, *(("palm_target",) if moves else ())}
    shared = () if folder.drive is None else folder.drive.names
    problems = [f"body {name} is in no other file" for name in scene.bodies if name not in (*known, *shared)]
    problems += [f"has no body {name}" for name in known if name not in scene.bodies]
    starts = {
        "palm": (motion.base_position[0], motion.base_orientation[0]),
        "palm_target": (motion.base_position[0], motion.base_orientation[0]),
        "object": (motion.object_position[0], motion.object_orientation[0]),
    }
    hung = {joint.child: joint for joint in folder.joints.values()}
    for name, body in scene.bodies.items():
        if name not in known:
            continue
        who, joint = folder.call(name), hung.get(name)
        if joint is None:
            position, orientation = starts[name]
            parent, reference = "world", 0.0
        else:
            reference = float(motion.joint_angles[0, motion.joint_names.index(joint.name)])
            turn = Rotation.from_rotvec(reference * joint.axis / np.linalg.norm(joint.axis))
            turn = Rotation.from_euler("xyz", joint.turn) * turn
            position, orientation, parent = joint.position, turn.as_quat(scalar_first=True), joint.parent
        if body.parent != parent:
            problems.append(f"{who} hangs on {body.parent}, not on {parent}")
        problems += _pose_problems(folder, who, body, position, orientation)
        if body.borne != (name in folder.links):
            taken = "not taken off it, as a hand carries itself" if name in folder.links else "taken off it"
            problems.append(f"the weight of {who} is {taken} (gravcomp)")
        if name in due:
            problems += _solid_problems(folder, who, body, due[name])
        elif body.geoms or body.mass:
            problems.append(f"{who} has solids or mass, and is only a place for the palm to follow")
        loose = folder.task.object.attached is None
        if body.mocap != (name == "palm_target") or body.free != (
            (name == "object" and loose) or (name == "palm" and moves)
        ):
            problems.append(f"{who} is not {'free' if name == 'object' and loose else 'held'} as the motion has it")
        if joint is None:
            problems += [f"{who} turns on joint {hinge.name}, which is in no other file" for hinge in body.hinges]
            continue
        hinge = body.hinges[0] if len(body.hinges) == 1 else None
        if hinge is None or hinge.name != joint.name:
            problems.append(f"{who} does not turn on its joint {joint.name} alone")
            continue
        limits = [joint.lower, joint.upper]
        for word, stated, said in (
            ("axis is not that", hinge.axis, joint.axis),
            ("limits are not those", hinge.limits, limits),
            ("angle at the start is not that", hinge.reference, reference),
        ):
            if np.max(np.abs(np.asarray(stated) - np.asarray(said))) > EXACT:
                problems.append(f"joint {joint.name}: its {word} of the other files")
    return problems


def _pose_problems(
    folder: Folder, who: str, body: SceneBody, position: np.ndarray, orientation: np.ndarray
) -> list[str]:
    if np.linalg.norm(body.orientation) < 1e-3:
        return [f"{who} has no orientation"]
    turn = Rotation.from_quat(body.orientation, scalar_first=True)
    angle = (turn.inv() * Rotation.from_quat(orientation, scalar_first=True)).magnitude()
    if np.linalg.norm(body.position - position) > EXACT * folder.length or angle > EXACT:
        return [f"{who} does not stand as at the motion's first sample"]
    return []


def _solid_problems(folder: Folder, who: str, body: SceneBody, due: Body) -> list[str]:
    file, problems = "object.urdf" if due is folder.object else "hand.urdf", []
    if not same(body.mass, due.mass):
        problems.append(f"the mass of {who} is {body.mass:.4g} kg, in {file} {due.mass:.4g} kg")
    if not same(body.inertia, due.inertia) or np.linalg.norm(body.center - due.center_of_mass) > EXACT * folder.length:
        problems.append(f"inertia or centre of mass of {who} is not that of {file}")
    found = [geom.shape for geom in body.geoms if geom.shape is not None]
    missing = [shape for shape in due.shapes if not any(shape.agrees(other) for other in found)]
    # Both ways: the task may have one shape twice.
    missing += [other for other in found if not any(shape.agrees(other) for shape in due.shapes)]
    if missing or len(body.geoms) != len(due.shapes):
        problems.append(f"the solids of {who} are not those of {file}")
    return problems


def _hold_problems(folder: Folder, scene: Scene) -> list[str]:
    """What does not collide, and what holds a palm that moves."""
    allowed = {frozenset((joint.parent, joint.child)) for joint in folder.joints.values()}
    problems = [
        f"{' and '.join(folder.call(name) for name in sorted(pair))} do not collide, though they share no joint"
        for pair in scene.excluded
        if pair not in allowed
    ]
    problems += [
        f"{' and '.join(folder.call(name) for name in sorted(pair))} collide, though they share a joint"
        for pair in sorted(allowed - set(scene.excluded), key=sorted)
    ]
    due = [("palm_target", "palm")] if palm_moves(folder) else []
    if scene.welds != due:
        held = ", ".join(f"{one} to {other}" for one, other in scene.welds) or "nothing"
        problems.append(f"welds {held}; the motion asks for {'palm_target to palm' if due else 'nothing'}")
    return problems


def _servo_problems(folder: Folder, scene: Scene) -> list[str]:
    names, problems = [servo.joint for servo in scene.servos], []
    if names != list(folder.motion.joint_names):
        problems.append(
            f"its actuators turn {', '.join(names) or 'nothing'}; there must be one a joint, in their order"
        )
    if scene.springs:
        problems.append("it has springs, though every joint has a motor of its own")
    for servo in scene.servos:
        if servo.name != servo.joint:
            problems.append(f"the actuator of joint {servo.joint} is called {servo.name}")
        joint = folder.joints.get(servo.joint)
        if joint is not None and not np.allclose(servo.limits, [-joint.effort, joint.effort], rtol=EXACT, atol=0.0):
            problems.append(f"the torque of joint {servo.joint} is not limited to its effort in hand.urdf")
        if not same(servo.stiffness, folder.task.actuator.stiffness):
            due = folder.task.actuator.stiffness
            problems.append(f"the motor of joint {servo.joint} has {servo.stiffness:.4g} N·m/rad, the task's {due:.4g}")
        problems += damping_problem(folder, f"the motor of joint {servo.joint}", servo.joint, servo.damping)
    return problems
