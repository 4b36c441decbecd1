"""Ways to falsify one thing in the files of a result folder; each returns what does it to a folder."""

from __future__ import annotations

import hashlib
import json
import re
import zipfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.errors import DesignError, TaskError
from casadi_hands.task import load_task, task_to_yaml
from casadi_hands.verify.audit import audit_files
from casadi_hands.verify.checks.structure import structure_problems
from casadi_hands.verify.figures.dynamics import shoot
from casadi_hands.verify.reading.folder import read_folder
from casadi_hands.verify.trajectory import build_trajectory

Falsify = Callable[[Path], None]
Cases = dict[str, tuple[Falsify, str]]
"""Name -> what falsifies a folder, and a pattern of what the audit then says."""

HAND, OBJECT, SCENE, NPZ = "hand.urdf", "object.urdf", "scene.xml", "motion.npz"
LINK, NEXT, JOINT = "link[@name='finger0_link0']", "link[@name='finger0_link1']", "joint[@name='finger0_joint1']"
BODY, THING = ".//body[@name='finger0_link1']", ".//body[@name='object']"
BALL = "<collision><geometry><sphere radius='0.01'/></geometry></collision>"
MASS = "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1'/></inertial>"
KINEMATIC = {"joint_velocities": None, "joint_torques": None, "joint_commands": None}
DISTURBED = "contact_force_disturbed", "external_force_disturbed", "external_torque_disturbed"


def refusal(folder: Path) -> str:
    """What the audit says against a folder, in lines; empty when it certifies it."""
    try:
        # What is wrong with the files is found faster than all figures are computed, and is enough.
        read = read_folder(folder)
        problems = structure_problems(read, build_trajectory(read, shoot(read)))
        return "\n".join(problems or audit_files(folder).reasons)
    except (DesignError, TaskError) as error:
        return str(error)


def emptied(folder: Path) -> None:
    """A table without a word in it."""
    (folder / "motion.csv").write_text("\n", encoding="utf-8")


def both(*steps: Falsify) -> Falsify:
    """Several one after the other."""

    def run(folder: Path) -> None:
        for step in steps:
            step(folder)

    return run


def text(file: str, old: str, new: str, count: int = 1) -> Falsify:
    """Replace text that must be there."""

    def run(folder: Path) -> None:
        content = (folder / file).read_text()
        assert old in content
        (folder / file).write_text(content.replace(old, new, count))

    return run


def whole(file: str, content: str | bytes) -> Falsify:
    """Write a whole file."""

    def run(folder: Path) -> None:
        (folder / file).write_bytes(content if isinstance(content, bytes) else content.encode())

    return run


def attribute(file: str, path: str, name: str, value: str | Callable[[str], str] | None) -> Falsify:
    """Set, change or (None) remove an attribute of the first element at a path of ElementTree's."""

    def change(element: ElementTree.Element, parent: ElementTree.Element) -> None:
        if value is None:
            del element.attrib[name]
        else:
            element.set(name, value(element.get(name, "")) if callable(value) else value)

    return edited(file, path, change)


def removed(file: str, path: str) -> Falsify:
    """Remove all elements at a path, below the root."""

    def change(element: ElementTree.Element, parent: ElementTree.Element) -> None:
        parent.remove(element)

    return edited(file, path, change, every=True)


def added(file: str, path: str, xml: str, first: bool = False) -> Falsify:
    """Add an element to that at a path, as its last child or its first."""

    def change(element: ElementTree.Element, parent: ElementTree.Element) -> None:
        element.insert(0 if first else len(element), ElementTree.fromstring(xml))

    return edited(file, path, change)


def edited(
    file: str, path: str, change: Callable[[ElementTree.Element, ElementTree.Element], None], every: bool = False
) -> Falsify:
    """Change the first element at a path, or every one; the change is also given its parent."""

    def run(folder: Path) -> None:
        root = ElementTree.parse(folder / file).getroot()
        parents = {child: parent for parent in root.iter() for child in parent}
        found = [root] if path == "." else root.findall(path)
        assert found, path
        for element in found if every else found[:1]:
            change(element, parents.get(element, root))
        (folder / file).write_text(ElementTree.tostring(root, encoding="unicode"))

    return run


def record(*path: Any, value: Any = None, drop: bool = False) -> Falsify:
    """Set or drop an entry of ``result.json``; a value may be a function of the one there."""

    def run(folder: Path) -> None:
        content = json.loads((folder / "result.json").read_text())
        place = content
        for step in path[:-1]:
            place = place[step]
        if drop:
            del place[path[-1]]
        else:
            place[path[-1]] = value(place[path[-1]]) if callable(value) else value
        (folder / "result.json").write_text(json.dumps(content))

    return run


def arrays(**changes: Any) -> Falsify:
    """Set, change or (None) remove arrays of ``motion.npz``, and the table; a change is a function of the array."""

    def run(folder: Path) -> None:
        with np.load(folder / "motion.npz") as file:
            content = dict(file)
        for name, change in changes.items():
            if change is None:
                del content[name]
            else:
                content[name] = change(content[name].copy()) if callable(change) else np.asarray(change)
        np.savez(folder / "motion.npz", **content)
        (folder / "motion.csv").unlink(missing_ok=True)

    return run


def entry(at: Any, value: Any, scale: float | None = None) -> Callable[[np.ndarray], np.ndarray]:
    """Return a change of an array that sets what stands at an index, or scales it."""

    def change(array: np.ndarray) -> np.ndarray:
        array[at] = value if scale is None else scale * array[at]
        return array

    return change


def task(old: str, new: str) -> Falsify:
    """Replace text in ``task.yaml`` and state its hash anew."""
    return both(text("task.yaml", old, new), _rehashed)


def _rehashed(folder: Path) -> None:
    # As whoever solves it would write it, defaults filled in, if it can be read.
    with suppress(TaskError):
        (folder / "task.yaml").write_text(task_to_yaml(load_task(folder / "task.yaml")))
    digest = hashlib.sha256((folder / "task.yaml").read_bytes()).hexdigest()
    record("task_hash", value=digest)(folder)


def copied(folder: Path, file: str, path: str) -> None:
    """Add an element once more, further down."""
    edited(file, path, lambda element, parent: parent.append(element))(folder)


def only(element: ElementTree.Element, xml: str) -> None:
    """Leave an element one child."""
    element[:] = [ElementTree.fromstring(xml)]


def reordered(element: ElementTree.Element) -> None:
    """Give an element's attributes in another order."""
    items = list(element.items())
    element.attrib.clear()
    element.attrib.update(reversed(items))


def appended(folder: Path, name: str) -> None:
    """Add an array to the archive once more."""
    with zipfile.ZipFile(folder / NPZ) as archive:
        data = archive.read(name)
    with zipfile.ZipFile(folder / NPZ, "a") as archive, pytest.warns(UserWarning, match="Duplicate name"):
        archive.writestr(name, data)


def halved(path: Path) -> None:
    """Cut a file in half."""
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])


def mistyped(folder: Path) -> None:
    """Change a number of the table."""
    lines = (folder / "motion.csv").read_text().splitlines()
    words = lines[5].split(",")
    words[-1] = str(float(words[-1]) + 1.0)
    lines[5] = ",".join(words)
    (folder / "motion.csv").write_text("\n".join(lines) + "\n")


def hung(folder: Path) -> None:
    """Hang the object on the palm."""
    root = ElementTree.parse(folder / SCENE).getroot()
    world = root.find("worldbody")
    assert world is not None
    palm, thing = world.find("body[@name='palm']"), world.find("body[@name='object']")
    assert palm is not None
    assert thing is not None
    world.remove(thing)
    palm.append(thing)
    (folder / SCENE).write_text(ElementTree.tostring(root, encoding="unicode"))


def links_of(folder: Path, shortest: float, longest: float) -> None:
    """Let the task allow links of other lengths, m."""
    lengths = re.search(r"link_length: \[.*\]", (folder / "task.yaml").read_text())
    assert lengths is not None
    task(lengths[0], f"link_length: [{shortest}, {longest}]")(folder)


def tipped(folder: Path, torsion: float) -> None:
    """Give the task fingertips of another torsional friction, m, and the scene likewise."""
    task("torsion: 0.00108}", f"torsion: {torsion}}}")(folder)
    edited(SCENE, ".//body//geom", lambda e, p: e.set("friction", f"0.9 {torsion} 0"), every=True)(folder)


def plain_forces(folder: Path, share: float = 0.0) -> None:
    """Let the disturbed forces be the plan's, and a share of what they are beyond them."""
    with np.load(folder / NPZ) as file:
        plan, disturbed = file["contact_force"], file["contact_force_disturbed"]
    arrays(contact_force_disturbed=plan + share * (disturbed - plan))(folder)


def squeezed(folder: Path, more: float) -> None:
    """Press the disturbed forces inward by so many newtons more where the push acts; they balance as before."""
    with np.load(folder / NPZ) as file:
        disturbed, points = file["contact_force_disturbed"], file["contact_point_object"]
        turn = Rotation.from_quat(file["object_orientation"], scalar_first=True)
    for k in range(5, 9):
        inward = -points[k] * [1, 1, 0] / 0.02
        disturbed[k] += more * turn[k].apply(inward)
    arrays(contact_force_disturbed=disturbed)(folder)
