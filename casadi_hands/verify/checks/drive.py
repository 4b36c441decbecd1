"""Do the files agree on the motors that share joints?"""

from __future__ import annotations

import numpy as np

from casadi_hands.verify.checks.motors import damping_problem, shared_motor_problems
from casadi_hands.verify.figures.coupling import motor_speeds
from casadi_hands.verify.figures.wrench import planned_torques
from casadi_hands.verify.reading.drive import Drive
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.reading.scene_file import Scene
from casadi_hands.verify.reading.stored import entry, same

EXACT = 1e-6
ROUNDED_RATIO = 1e-7
"""By which a ratio may be out of its bounds: as much as a solve's constraints."""


def drive_problems(folder: Folder) -> list[str]:
    """Return where hand.urdf, result.json, the motion and the task differ on motors, a sentence each."""
    drive, motion = folder.drive, folder.motion
    stated = entry(folder.result, "hand", "motors")
    due = len(motion.joint_names) if drive is None else drive.ratios.shape[1]
    problems = [] if stated in (None, due) else [f"motors: result.json says {stated}, there are {due}"]
    problems += _mimic_problems(folder, drive)
    if drive is not None and folder.task.motors == "independent":
        problems.append(f"motors: {due} share the joints, where the task has one for every joint")
    return problems if drive is None else [*problems, *_ratio_problems(folder, drive), *_limit_problems(folder, drive)]


def _mimic_problems(folder: Folder, drive: Drive | None) -> list[str]:
    """A joint of hand.urdf follows the first that its one motor turns alone, by their commands."""
    problems, names = [], list(folder.motion.joint_names)
    for j, name in enumerate(names):
        due = None if drive is None else _leader(drive, j)
        mimic = folder.joints[name].mimic
        if due is None and mimic is not None:
            problems.append(f"joint {name}: in hand.urdf it mimics {mimic[0]}; by its motors it follows none")
        elif due is not None:
            leader, multiplier, offset = names[due[0]], due[1], due[2]
            if mimic is None or mimic[0] != leader or not np.allclose(mimic[1:], [multiplier, offset], atol=EXACT):
                follows = f"{leader} times {multiplier:.4g} plus {offset:.4g} rad"
                problems.append(f"joint {name}: by result.json it follows {follows}, in hand.urdf it does not")
    return problems


def _leader(drive: Drive, joint: int) -> tuple[int, float, float] | None:
    turned = [m for m, ratio in enumerate(drive.ratios[joint]) if ratio != 0.0]
    if len(turned) > 1:
        return None
    m = turned[0] if turned else 0
    rows = [j for j, row in enumerate(drive.ratios) if row[m] != 0.0 and np.count_nonzero(row) == 1]
    if not rows or rows[0] == joint:
        return None
    multiplier = float(drive.ratios[joint, m] / drive.ratios[rows[0], m])
    return rows[0], multiplier, float(drive.offsets[joint] - multiplier * drive.offsets[rows[0]])


def _ratio_problems(folder: Folder, drive: Drive) -> list[str]:
    problems, (least, most) = [], folder.task.hand.ratios
    sizes, names = np.abs(drive.ratios), folder.motion.joint_names
    for j, m in np.argwhere((sizes > 0) & ((sizes < least - ROUNDED_RATIO) | (sizes > most + ROUNDED_RATIO))):
        given = f"{drive.names[m]} turns joint {names[j]} by a ratio of {drive.ratios[j, m]:.4g}"
        problems.append(f"{given}; the task allows sizes from {least:g} to {most:g} (hand.ratios)")
    for m, name in enumerate(drive.names):
        if not any(row[m] == 1.0 and np.count_nonzero(row) == 1 for row in drive.ratios):
            problems.append(f"{name} has no joint that it alone turns, one to one")
    return problems


def _limit_problems(folder: Folder, drive: Drive) -> list[str]:
    """A motor's limits are the task's, or enough for the motion."""
    torque = max(float(np.abs(planned_torques(folder, f) @ drive.ratios).max()) for _, f, _ in folder.scenarios())
    problems, motor = [], folder.task.actuator
    for word, has, needs, unit, named in (
        ("motor_effort", drive.effort, torque, "N·m", motor.torque),
        ("motor_velocity", drive.velocity, float(np.abs(motor_speeds(folder)).max()), "rad/s", motor.speed),
    ):
        if named is not None and not same(has, named):
            problems.append(f"{word}: result.json says {has:.4g} {unit}, the task's motor has {named:.4g}")
        elif named is None and needs > has * (1 + EXACT):
            problems.append(f"{word}: {has:.4g} {unit} is below the {needs:.4g} that the motion needs")
    return problems


def scene_drive_problems(folder: Folder, scene: Scene, drive: Drive) -> list[str]:
    """Return where motors and springs of scene.xml are not those of result.json, a sentence each."""
    task, names, problems = folder.task, list(folder.motion.joint_names), []
    if [servo.joint for servo in scene.servos] != drive.names:
        problems.append(f"its actuators turn other than {', '.join(drive.names)}, in this order")
    for servo in scene.servos:
        if not np.allclose(servo.limits, [-drive.effort, drive.effort], rtol=EXACT, atol=0.0):
            problems.append(f"the torque of {servo.joint} is not limited to motor_effort of result.json")
    problems += shared_motor_problems(folder, scene, drive)
    if [spring.name for spring in scene.springs] != names:
        return [*problems, "its springs are not one a joint, in their order"]
    for j, spring in enumerate(scene.springs):
        due = {names[j]: 1.0} | {m: -r for m, r in zip(drive.names, drive.ratios[j], strict=True) if r != 0.0}
        if spring.coefficients.keys() != due.keys() or any(
            abs(spring.coefficients[name] - value) > EXACT for name, value in due.items()
        ):
            problems.append(f"the spring of joint {spring.name} does not pull by the ratios of result.json")
        if abs(spring.rest - drive.offsets[j]) > EXACT:
            problems.append(f"the spring of joint {spring.name} rests at {spring.rest:.6g}, not at its offset")
        if not same(spring.stiffness, task.actuator.stiffness):
            stated = f"{spring.stiffness:.4g} N·m/rad, the task's {task.actuator.stiffness:.4g}"
            problems.append(f"the spring of joint {spring.name} has {stated}")
        problems += damping_problem(folder, f"the spring of joint {spring.name}", spring.name, spring.damping)
    return problems
