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
_FOAM = 20.0  # kg/m³: less than links are printed with
_MIGHTY = 200.0  # of the torque at which the object weighs on the whole hand
_LIMITED = ("goal_position", "penetration", "gap", "gap_between", "slip", "tip_deflection", "replay_position")
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
    thick = hand.link_radius > max(usual, palm.radius)  # then others are that follow from it
    for path, length, most in (
        (("palm", "radius"), palm.radius, usual),
        (("hand", "link_radius"), hand.link_radius, max(usual, palm.radius)),
        (("fingertip", "radius"), task.fingertip.radius, math.inf if thick else max(usual, palm.radius)),
        (("hand", "link_length"), hand.link_length[1], math.inf if thick else usual + 2 * palm.radius),
        (("object", "attached", "screw", "pitch"), _pitch(task), max(usual, size)),
        *((("limits", name), getattr(task.limits, name), max(usual, size)) for name in _LIMITED),
    ):
        if length > most:
            yield Question(path, f"this is {length:.3g} m, for an object {size:.3g} m long; {_asked_of(length)}")
    yield from _other_units(task)
    yield from _other_masses(task)


def _other_units(task: Task) -> Iterator[Question]:
    gravity = np.array(task.gravity)
    if np.linalg.norm(gravity) > _STRONG:
        what = f"gravity of {np.linalg.norm(gravity):.4g} m/s²; is it in mm/s² or cm/s²?"
        yield Question(("gravity",), what)
    elif gravity[2] > 0:
        yield Question(("gravity",), "gravity points up, and world z is up; is its sign wrong?")
    hand = task.hand
    if max(map(abs, hand.joint_limits)) <= 2 * math.pi:
        what = f"joints turn by {hand.joint_limits[1] - hand.joint_limits[0]:.3g}°; are these radians?"
        yield Question(("hand", "joint_limits"), what)
    if hand.axes.from_link[1] <= 0.5 * math.pi + 0.01:
        what = f"axes are within {hand.axes.from_link[1]:.3g}° of their links; are these radians?"
        yield Question(("hand", "axes", "from_link"), what)
    if (turn := _in_radians(hand.bend)) is not None:
        yield Question(("hand", "bend"), f"a bend of {hand.bend:g}° is {turn}° in radians; is it in radians?")
    for number, goal in enumerate(task.motion):
        degrees = goal.rotation.degrees
        if (turn := _in_radians(degrees)) is not None:
            what = f"a turn of {degrees:g}° is {turn}° in radians; is it in radians?"
            yield Question(("motion", number, "rotation" if task.object.attached is None else "angle"), what)
    for name in ("goal_angle", "replay_angle"):
        if (limit := getattr(task.limits, name)) > 180:
            yield Question(("limits", name), f"no object is more than 180° from a goal, so {limit:g}° is always kept")
    rubbing, radius = task.friction, task.fingertip.radius
    if task.fingertip.torsion > rubbing * radius:
        what = (
            f"{task.fingertip.torsion:.3g} m is more than a tip of {1e3 * radius:.3g} mm radius can have, its friction"
        )
        yield Question(("fingertip", "torsion"), f"{what} times its radius; it is a length in m, not a coefficient")


def _in_radians(degrees: float) -> int | None:
    """The turn in degrees, a multiple of 15, that this is likely in radians; None where it is not."""
    parts = abs(degrees) / (math.pi / 12)
    likely = 0.5 < parts < 24.5 and abs(parts - round(parts)) < 0.008 and degrees != round(degrees, 1)
    return round(parts) * 15 if likely else None


def _other_masses(task: Task) -> Iterator[Question]:
    """What has kilograms in it: inertia, density, torque."""
    most = task.object.mass * _reach(task) ** 2
    moments = np.linalg.eigvalsh(np.array(task.object.inertia))
    large = moments[-1] > 2 * most
    if large or moments[-1] < most / 300:
        than = f"more than that of all its mass at its corners, {most:.3g}"
        if not large:
            than = f"less than a hundredth of that of a rod as long, {most / 3:.3g}"
        what = f"{moments[-1]:.3g} kg·m² is {than} kg·m²; is it in other units, g·mm² say?"
        yield Question(("object", "inertia"), what)
    if task.hand.density < _FOAM:
        what = f"links of {task.hand.density:g} kg/m³ are lighter than foam; is it in g/cm³?"
        yield Question(("hand", "density"), what)
    torque, reach = task.actuator.torque, _size(task) + _distance(task) + task.palm.radius
    load = task.force_unit * reach
    if torque is not None and torque > max(_MIGHTY * load, 1.0):
        what = f"{torque:g} N·m, where the object weighs on the hand with {load:.2g} N·m; is it in N·cm or N·mm?"
        yield Question(("actuator", "torque"), what)


def _pitch(task: Task) -> float:
    """How far the object goes in a turn of its thread, m."""
    attached = task.object.attached
    return 0.0 if attached is None or attached.screw is None else abs(attached.screw.pitch)


def _reach(task: Task) -> float:
    """How far the farthest corner of the box around the object is from its centre of mass, m."""
    return float(np.linalg.norm(np.abs(task.object.bounding_box).max(axis=0)))


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
