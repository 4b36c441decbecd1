"""Do the files of a result folder agree with each other, with the task, and with the format?"""

from __future__ import annotations

from casadi_hands.verify.checks.against_task import hand_task_problems
from casadi_hands.verify.checks.agreement import hand_problems, object_problems, record_problems
from casadi_hands.verify.checks.commands import command_problems
from casadi_hands.verify.checks.drive import drive_problems
from casadi_hands.verify.checks.motion import motion_problems
from casadi_hands.verify.checks.palm import palm_problems
from casadi_hands.verify.checks.raw_mesh import raw_mesh_problems
from casadi_hands.verify.checks.scene import scene_problems
from casadi_hands.verify.checks.servos import servo_problems
from casadi_hands.verify.checks.table import table_problems
from casadi_hands.verify.checks.trust import task_problems
from casadi_hands.verify.figures.disturbances import external_problems
from casadi_hands.verify.held import joint_problems
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.trajectory import Trajectory


def structure_problems(folder: Folder, path: Trajectory) -> list[str]:
    """Return what is wrong with the files themselves, a sentence each.

    Args:
        folder: the design.
        path: its motion between samples.
    """
    return [
        *_version_problems(folder),
        *task_problems(folder),
        *folder.strange,
        *motion_problems(folder),
        *external_problems(folder),
        *joint_problems(folder),
        *object_problems(folder),
        *raw_mesh_problems(folder),
        *hand_problems(folder),
        *hand_task_problems(folder, path),
        *servo_problems(folder),
        *palm_problems(folder),
        *record_problems(folder),
        *drive_problems(folder),
        *command_problems(folder),
        *scene_problems(folder),
        *table_problems(folder),
    ]


def _version_problems(folder: Folder) -> list[str]:
    if not folder.legacy:
        return []
    again = f"`casadi-hands solve {folder.path / 'task.yaml'} --from {folder.path}` makes it anew"
    absent = [name for name in ("joint_commands",) if getattr(folder.motion, name) is None]
    lacks = ", ".join(f"no {name}" for name in (*folder.unstated, *absent))
    return [f"the folder was written by an earlier version ({lacks}): {again}"]
