"""What of a task stands somewhere and can be moved: the palm, the object at its goals, contacts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from casadi_hands.motion import nearest_exponential
from casadi_hands.studio.document import Path, value_at, with_value, without
from casadi_hands.task import Palm, Task
from casadi_hands.task.fields import vector

_STEP = 1e-5  # m, to which positions are rounded
_LEAST_TURN = 0.05  # deg; less is a hand that trembled


@dataclass(frozen=True)
class Place:
    """Something that can be moved.

    Attributes:
        path: of its section in the file.
        kind: ``palm``, ``waypoint``, ``goal``, ``tool goal`` (a point of a drawing), ``joint goal`` (of an object on a
            joint, which the file places by an angle or a distance) or ``contact``.
        name: for people.
        position: (3,) m, world.
        rotation: (3, 3) world <- it; of contacts the object's at the start.
    """

    path: Path
    kind: str
    name: str
    position: np.ndarray
    rotation: np.ndarray

    @property
    def short(self) -> str:
        """Its name where it is drawn, so that one sees what it is."""
        for before in ("object, ", "tool, ", "contact with the ", "contact "):
            if self.name.startswith(before):
                return self.name.removeprefix(before)
        return self.name

    @property
    def moves(self) -> bool:
        """Whether it can be moved."""
        return self.kind != "joint goal"

    @property
    def turns(self) -> bool:
        """Whether it can be turned."""
        return self.kind in ("palm", "waypoint", "goal")

    @property
    def removable(self) -> bool:
        """Whether a task can be without it."""
        return self.kind != "palm"


def places(task: Task) -> list[Place]:
    """All that can be moved of a task as it is written, the palm first."""
    return [*_palm_places(task), *_goal_places(task), *_contact_places(task)]


def moved(text: str, task: Task, place: Place, position: np.ndarray, rotation: np.ndarray) -> str:
    """The text with something moved; what has not changed stays as it is written.

    Args:
        text: of the file.
        task: the text's, as it is written.
        place: one of its places.
        position: (3,) m, world, where it shall be.
        rotation: (3, 3) how it shall stand, world <- it; ignored where it does not turn.
    """
    shifted = bool(np.abs(position - place.position).max() > _STEP / 2)
    turned = place.turns and np.degrees(_angle(rotation @ place.rotation.T)) > _LEAST_TURN
    if place.kind == "palm" and (shifted or turned):
        text = _standing(text, task)
    if shifted and place.kind == "contact":
        local = place.rotation.T @ (position - _start(task)[0])
        text = with_value(text, place.path, _point(local))
    elif shifted:
        name = "tool_at" if place.kind == "tool goal" else "position"
        text = with_value(text, (*place.path, name), _point(position))
    if turned and place.kind == "goal":
        text = _turned_goal(text, task, place, rotation)
    elif turned:
        text = _turned_palm(text, task, place, rotation)
    return text


def _standing(text: str, task: Task) -> str:
    """The text with the palm's place written out, where it leaves that to the program."""
    given = value_at(text, ("palm",))
    if given == "auto":
        text = with_value(text, ("palm",), {})
    elif isinstance(given, dict) and given.get("auto") is True:
        text = without(text, ("palm", "auto"))
    else:
        return text
    text = with_value(text, ("palm", "position"), _point(np.array(task.palm.position)))
    return with_value(text, ("palm", "facing"), _direction(np.array(task.palm.facing)))


def _turned_goal(text: str, task: Task, place: Place, rotation: np.ndarray) -> str:
    number = place.path[-1]
    assert isinstance(number, int)
    turn = np.degrees(nearest_exponential(rotation, task.motion[number].rotation.vector))
    angle = float(np.linalg.norm(turn))
    path = (*place.path, "rotation")
    if angle < _LEAST_TURN:
        return without(text, path)
    return with_value(text, path, {"axis": _direction(turn / angle), "degrees": _rounded(angle, 2)})


def _turned_palm(text: str, task: Task, place: Place, rotation: np.ndarray) -> str:
    facing = _direction(rotation[:, 2])
    text = with_value(text, (*place.path, "facing"), facing)
    if place.kind == "waypoint":
        return text
    # `up` says how a palm is rolled; it is written only where the usual roll is not meant.
    usual = Palm.model_validate({**_palm_data(task), "facing": facing, "up": None})
    if np.degrees(_angle(usual.rotation.T @ rotation)) < 0.5:
        return without(text, (*place.path, "up"))
    return with_value(text, (*place.path, "up"), _direction(rotation[:, 0]))


def _palm_data(task: Task) -> dict[str, object]:
    return {"radius": task.palm.radius, "position": task.palm.position}


def with_goal(text: str, task: Task) -> str:
    """The text with one more goal, a second after the last, where that is."""
    last = len(task.motion) - 1
    goal = {**(value_at(text, ("motion", last)) or {}), "at": _rounded(task.motion[last].at + 1.0, 6)}
    return with_value(text, ("motion", last + 1), goal)


def with_finger(text: str, task: Task, name: str) -> str:
    """The text with one more finger, which touches as far from the others' contacts as an axis leads."""
    taken = [np.array(finger.point) for finger in task.fingers.values() if finger.is_placed]
    candidates = []
    for shape in task.object.shapes:
        lower, upper = shape.bounding_box
        middle = (lower + upper) / 2
        for axis in range(3):
            for end in (lower, upper):
                beyond = middle.copy()
                beyond[axis] = end[axis]
                candidates.append(shape.body.on_surface(middle + 0.999 * (beyond - middle)))
    clear = [min((float(np.linalg.norm(each - point)) for each in taken), default=0.0) for point in candidates]
    return with_value(text, ("fingers", name), {"touches": _point(candidates[int(np.argmax(clear))])})


def removed(text: str, place: Place) -> str:
    """The text without something."""
    return without(text, place.path[:2] if place.kind == "contact" and place.path[0] == "fingers" else place.path)


def _palm_places(task: Task) -> Iterator[Place]:
    start, *waypoints = task.palm.waypoints
    yield Place(("palm",), "palm", "palm", start[1], start[2])
    for number, (at, position, rotation) in enumerate(waypoints):
        yield Place(("palm", "motion", number), "waypoint", f"palm at {at:g} s", position, rotation)


def _goal_places(task: Task) -> Iterator[Place]:
    for number, goal in enumerate(task.motion):
        name = "start" if number == 0 else f"goal {number} at {goal.at:g} s"
        if goal.tool_at is not None:
            where = np.array(goal.tool_at)
            yield Place(("motion", number), "tool goal", f"tool, {name}", where, np.eye(3))
        else:
            kind = "joint goal" if goal.on_joint else "goal"
            where = np.array(task.goal_poses()[number][1], float)
            yield Place(("motion", number), kind, f"object, {name}", where, goal.rotation.matrix)


def _contact_places(task: Task) -> Iterator[Place]:
    origin, turn = _start(task)
    placed = {name: each.point for name, each in task.fingers.items() if each.is_placed}
    found = [
        Place(("fingers", name, "touches"), "contact", f"contact {name}", np.array(at, float), turn)
        for name, at in placed.items()
    ]
    if task.ground is not None:
        at = np.array(task.ground.touches)
        found.append(Place(("ground", "touches"), "contact", "contact with the ground", at, turn))
    for each in found:
        yield replace(each, position=origin + turn @ each.position)


def _start(task: Task) -> tuple[np.ndarray, np.ndarray]:
    """Position (3,), m, and rotation (3, 3) of the object at the first goal."""
    _, position, _ = task.goal_poses()[0]
    return np.asarray(position, float), task.motion[0].rotation.matrix


def _angle(rotation: np.ndarray) -> float:
    """How far a rotation matrix turns, rad."""
    skew = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    return float(np.arctan2(np.linalg.norm(skew), np.trace(rotation) - 1))


def _point(position: np.ndarray) -> list[float]:
    return [_rounded(value, 5) for value in vector(np.asarray(position))]


def _direction(axis: np.ndarray) -> list[float]:
    return [_rounded(value, 4) for value in vector(np.asarray(axis))]


def _rounded(value: float, digits: int) -> float:
    rounded = round(float(value), digits)
    return int(rounded) if rounded.is_integer() else rounded
