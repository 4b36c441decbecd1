"""Does ``scene.xml`` hold an attached object as the task does?"""

from __future__ import annotations

import numpy as np

from casadi_hands.verify.held import course, held
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.reading.mount import Mount
from casadi_hands.verify.reading.scene_file import Scene
from casadi_hands.verify.reading.stored import same

EXACT = 1e-6


def mount_problems(folder: Folder, scene: Scene) -> list[str]:
    """Return what of the object's joint is not that of ``task.yaml``, a sentence each."""
    body, joint = scene.bodies.get("object"), held(folder)
    if body is None:
        return []
    if joint is None:
        return ["the object turns on a joint, which the task does not have"] if body.mounts or scene.threads else []
    threaded = joint.turns and joint.advance != 0.0
    due = ["object_along", "object"] if folder.task.object.attached.screw else ["object"]  # type: ignore[union-attr]
    if [mount.name for mount in body.mounts] != due:
        return [f"the object hangs on {', '.join(m.name for m in body.mounts) or 'nothing'}, not on {', '.join(due)}"]
    start = float(course(folder, joint).position[0])
    own = {"object": (joint.friction, joint.stiffness, joint.damping), "object_along": (0.0, 0.0, 0.0)}
    kinds = {"object": "hinge" if joint.turns else "slide", "object_along": "slide"}
    begins = {"object": start, "object_along": joint.advance * start}
    problems = []
    for mount in body.mounts:
        if mount.kind != kinds[mount.name]:
            problems.append(f"joint {mount.name} is a {mount.kind}, not a {kinds[mount.name]}")
        if not _is_axis(folder, mount):
            problems.append(f"joint {mount.name} has not the axis of the object's joint in task.yaml")
        if max(abs(mount.reference - begins[mount.name]), abs(mount.rest)) > EXACT:
            problems.append(f"joint {mount.name} does not begin where the motion does")
        given = mount.friction, mount.stiffness, mount.damping
        for word, value, stated in zip(("friction", "stiffness", "damping"), given, own[mount.name], strict=True):
            if not same(value, stated):
                problems.append(f"the {word} of joint {mount.name} is {value:.4g}, in task.yaml {stated:.4g}")
    coefficients = np.array([0.0, joint.advance, 0.0, 0.0, 0.0])
    kept = [
        (one, other) for one, other, found in scene.threads if np.allclose(found, coefficients, rtol=EXACT, atol=0.0)
    ]
    if kept != ([("object_along", "object")] if len(due) > 1 else []) or len(scene.threads) != len(kept):
        problems.append(f"the object's joint has {'not the' if threaded else 'a'} pitch of a thread")
    return problems


def _is_axis(folder: Folder, mount: Mount) -> bool:
    """Whether a joint's axis is the task's."""
    joint = folder.task.object.attached.joint  # type: ignore[union-attr]
    axis, size = np.array(joint.axis) / np.linalg.norm(joint.axis), np.linalg.norm(mount.axis)
    point = np.array(getattr(joint, "point", (0.0, 0.0, 0.0)))
    off = np.linalg.norm(np.cross(axis, mount.place - point)) if folder.task.object.attached.slider is None else 0.0  # type: ignore[union-attr]
    return bool(np.linalg.norm(mount.axis / size - axis) < EXACT and off < EXACT * folder.length)
