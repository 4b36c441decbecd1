"""Lengths not in metres, masses not in kilograms, angles not in degrees: what is so for certain, and likely."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from casadi_hands.task.problem import Problem, Question
from casadi_hands.task.task import Task

# kg/m³: less than the lightest solids and gases, and ten times that of the densest metals; shapes need not be what the
# object is inside. Below 1 it is lighter than air, above 25000 than any metal.
_LIGHTEST, _DENSEST = 0.1, 2e5
_AIR, _METAL = 1.0, 2.5e4
_LARGE, _HUGE = 1.5, 10.0  # m: larger than what hands hold; than any of them
_FAR, _AWAY = 1.5, 20.0  # m of palm and object
_TINY = 0.005  # m: the shape may stand for a tip of something larger
_STRONG = 100.0  # m/s²
_LENGTHS = {"millimetres": 1e-3, "centimetres": 1e-2, "inches": 0.0254}
_MASSES = {"": 1.0, " and grams": 1e-3}
_LIKELY_DENSITY, _LIKELY_SIZE = (100.0, 2e4), (0.003, 0.5)  # of what hands hold


def wrong_units(task: Task) -> Iterator[Problem]:
    """Lengths and masses that make an object of no matter there is, or of no size that a hand holds."""
    density, size, far = _density(task), _size(task), _distance(task)
    mass, path = task.object.mass, ("object", "shapes")
    units = "lengths in m, masses in kg"
    if (density < _LIGHTEST and size > 1.05) or size > _HUGE:
        given = f"an object {size:.3g} m long of {mass:.3g} kg, {density:.2g} kg/m³"
        least = f", of {_LIGHTEST:g} kg/m³ and more" if density < _LIGHTEST else f", of {_HUGE:g} m at most"
        yield Problem(path, given, f"{units}{least}; {_asked(task)}")
    elif density > _DENSEST and size > _TINY:
        given = f"{mass:.3g} kg for an object {size:.3g} m long, {density:.2g} kg/m³"
        allowed = f"masses in kg, of {_DENSEST:g} kg/m³ and less; is this one in grams?"
        yield Problem(("object", "mass"), given, allowed)
    elif far > _AWAY:
        given = f"a palm {far:.3g} m from its object, which is {size:.3g} m long"
        yield Problem(("palm", "position"), given, f"{units}, and a palm near its object; {_asked_of(far)}")


def doubtful_units(task: Task) -> Iterator[Question]:
    """What is likely in another unit than the file's, and what it was taken for."""
    density, size, far = _density(task), _size(task), _distance(task)
    if size > _LARGE:
        yield Question(("object", "shapes"), f"the object is {size:.3g} m long; {_asked(task)}")
    elif density < _AIR:
        what = f"{task.object.mass:.3g} kg for an object {size:.3g} m long is lighter than air, {density:.2g} kg/m³"
        yield Question(("object", "mass"), f"{what}; {_asked(task)}")
    elif density > _METAL:
        what = f"{task.object.mass:.3g} kg for an object {size:.3g} m long is denser than metals, {density:.2g} kg/m³"
        yield Question(("object", "mass"), f"{what}; is the mass in grams?")
    if size <= _LARGE and far > max(_FAR, 2 * size):
        what = f"the palm is {far:.3g} m from the object, {far / size:.0f} times its length"
        yield Question(("palm", "position"), f"{what}; {_asked_of(far)}")
    # What hand they belong to: the defaults of these follow from lengths that are asked about themselves.
    palm, hand = task.palm, task.hand
    usual = max(_LARGE, 2 * (far + size))
    for path, length, most in (
        (("palm", "radius"), palm.radius, usual),
        (("hand", "link_radius"), hand.link_radius, max(usual, palm.radius)),
        (("fingertip", "radius"), task.fingertip.radius, max(usual, palm.radius)),
        (("hand", "link_length"), hand.link_length[1], usual + 2 * palm.radius),
    ):
        if length > most:
            yield Question(path, f"this is {length:.3g} m, for an object {size:.3g} m long; {_asked_of(length)}")
    yield from _other_units(task)


def _other_units(task: Task) -> Iterator[Question]:
    gravity = np.array(task.gravity)
    if np.linalg.norm(gravity) > _STRONG:
        what = f"gravity of {np.linalg.norm(gravity):.4g} m/s²; is it in mm/s² or cm/s²?"
        yield Question(("gravity",), what)
    elif gravity[2] > 0:
        yield Question(("gravity",), "gravity points up, and world z is up; is its sign wrong?")
    if max(map(abs, task.hand.joint_limits)) <= 2 * math.pi:
        what = f"joints turn by {task.hand.joint_limits[1] - task.hand.joint_limits[0]:.3g}°; are these radians?"
        yield Question(("hand", "joint_limits"), what)
    for number, goal in enumerate(task.motion):
        degrees = goal.rotation.degrees
        parts = abs(degrees) / (math.pi / 12)
        if 0.5 < parts < 24.5 and abs(parts - round(parts)) < 0.008 and degrees != round(degrees, 1):
            what = f"a turn of {degrees:g}° is {round(parts) * 15}° in radians; is it in radians?"
            yield Question(("motion", number, "rotation"), what)


def _density(task: Task) -> float:
    return task.object.mass / float(sum(shape.body.volume for shape in task.object.shapes))


def _size(task: Task) -> float:
    return 2 * task.object.characteristic_length


def _distance(task: Task) -> float:
    """Of the object's centre, at the goal where it is most, from the nearest place the palm passes, m."""
    if task.palm.auto:  # which stands nowhere yet
        return 0.0
    places = np.array([position for _, position, _ in task.palm.waypoints])
    return max(float(np.linalg.norm(places - goal, axis=1).min()) for _, goal, _ in task.goal_poses())


def _asked(task: Task) -> str:
    """Which units would make the object one that hands hold, as a question."""
    size, density, readings = _size(task), _density(task), []
    for length, metres in _LENGTHS.items():
        for mass, kilograms in _MASSES.items():
            likely = _LIKELY_DENSITY[0] <= density * kilograms / metres**3 <= _LIKELY_DENSITY[1]
            if likely and _LIKELY_SIZE[0] <= size * metres <= _LIKELY_SIZE[1]:
                readings.append(f"{length}{mass}")
    return f"is the file in {', or '.join(readings)}?" if readings else "is the file in millimetres (or centimetres)?"


def _asked_of(length: float) -> str:
    """Which unit a length, m, is likely in, as a question."""
    unit = "millimetres" if length > _AWAY else "millimetres (or centimetres, or inches)"
    return f"is the file in {unit}?"
