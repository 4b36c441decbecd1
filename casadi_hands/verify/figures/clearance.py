"""Do bodies overlap, and do joints stay within what the hand can do?"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from casadi_hands.verify.bodies import Body, body_distance
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.report import Figure, of_actuator, worse
from casadi_hands.verify.trajectory import DENSITY, Trajectory


def body_pairs(folder: Folder) -> list[tuple[Body, Body]]:
    """Return every pair of bodies that must not overlap.

    Where the task's links begin in their joints, neighbours in a chain share a ball there and so touch; else they do
    not. Palm and ground may not touch either.
    """
    bodies = [folder.object, *folder.links.values()]
    share = not folder.task.hand.hinge_length
    pairs = [pair for pair in combinations(bodies, 2) if not (share and _neighbours(pair[0].name, pair[1].name))]
    if folder.ground is not None:
        pairs += [(folder.ground, body) for body in bodies]
    return pairs


def servo_pairs(folder: Folder) -> list[tuple[Body, Body, str, str]]:
    """Return every pair of a servo's case and a body, or another's case, that must not overlap, and how to call both.

    A case may be in the link that holds it and in the one that it turns. It goes by the name of what it moves with.
    """
    cases = []
    for holder in folder.links.values():
        for case in holder.cases:
            turned = [j for j in folder.joints.values() if j.parent == holder.name]
            joint = min(turned, key=lambda j: float(np.linalg.norm(j.position - case.center)), default=None)
            if joint is not None:
                body = Body(holder.name, 0.0, np.zeros(3), np.zeros((3, 3)), (case,))
                cases.append((body, {holder.name, joint.child}, f"the servo of joint {joint.name}"))
    others = [folder.object, *folder.links.values(), *([folder.ground] if folder.ground else [])]
    pairs = [(case, body, who, "") for case, own, who in cases for body in others if body.name not in own]
    return pairs + [(one, other, who, whose) for (one, _, who), (other, _, whose) in combinations(cases, 2)]


def _neighbours(first: str, second: str) -> bool:
    if not {"object", "palm"}.isdisjoint((first, second)):
        return False
    (one, _, i), (other, _, j) = first.partition("_link"), second.partition("_link")
    return one == other and abs(int(i) - int(j)) < 2


def penetration_figure(folder: Folder, path: Trajectory) -> Figure:
    """Return the deepest overlap of any two bodies at dense times, m; zero when none overlap."""
    worst = (0.0, "no two bodies overlap")
    depths = np.zeros(len(folder.motion.time) - 1)
    loose, held = [(*pair, "", "") for pair in body_pairs(folder)], servo_pairs(folder)
    for first, second, one, other in (*loose, *held):
        for i in range(0, len(path.time), DENSITY // 4):
            depth = -body_distance(first, path.at(first.name, i), second, path.at(second.name, i))
            k = path.interval[i]
            depths[k] = np.fmax(depths[k], depth)
            if not depth <= worst[0]:
                names = f"{one or folder.call(first.name)} and {other or folder.call(second.name)}"
                worst = worse(worst, (depth, f"{names} overlap by {{value}} at {path.time[i]:.3g} s"))
    return Figure("penetration", worst[0], folder.task.limits.penetration, "m", worst[1], by_interval=depths)


def joint_figure(folder: Folder, path: Trajectory) -> Figure:
    """Return the angle beyond a joint's limit, deg."""
    columns = folder.joint_columns()
    low, high = folder.model.lowerPositionLimit[columns], folder.model.upperPositionLimit[columns]
    over = np.rad2deg(np.maximum(path.joints - high, low - path.joints))
    i, j = np.unravel_index(np.argmax(over), over.shape)
    name, limits = folder.motion.joint_names[j], folder.task.limits
    words = f"joint {name} of {_finger(folder, name)} is {{value}} beyond its limit at {path.time[i]:.3g} s"
    if over[i, j] <= 0.0:
        words = "no joint is beyond its limit"
    by_interval = np.zeros(len(folder.motion.time) - 1)
    np.maximum.at(by_interval, path.interval, over.max(axis=1))
    value = max(float(over[i, j]), 0.0)
    return Figure("joint_limit", value, limits.joint_limit, "deg", words, by_interval=by_interval)


def speed_figure(folder: Folder, path: Trajectory) -> Figure:
    """Return the largest speed of a joint."""
    speed = np.abs(path.speeds)
    i, j = np.unravel_index(np.argmax(speed), speed.shape)
    name = folder.motion.joint_names[j]
    where = f"joint {name} of {_finger(folder, name)} at {path.time[i]:.3g} s"
    named, limit = folder.task.actuator.speed, folder.task.limits.speed
    return of_actuator("speed", float(speed[i, j]), where, named, limit, "rad/s")


def _finger(folder: Folder, joint: str) -> str:
    return folder.call(joint.replace("_joint", "_link")).partition(" (")[0]
