"""A task in a screenful: how the program understands the file."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from casadi_hands.diagnosis.impossible import findings
from casadi_hands.placement.place import Proposal, propose
from casadi_hands.problem.si import build_model
from casadi_hands.task import FingerSpec, Goal, Task
from casadi_hands.task.attached import Attached
from casadi_hands.task.palm_place import standing


def check_summary(
    task: Task, questions: Sequence[str] = (), proposal: Proposal | None = None
) -> tuple[RenderableType, bool]:
    """What `check` prints: every quantity with its unit, lengths in mm, defaults filled in; and why no hand can do it.

    Args:
        task: as loaded.
        questions: about what its file may mean otherwise, a line each.
        proposal: of contacts, where some have no place; found by default.

    Returns:
        That, and whether some hand might do the task.
    """
    if proposal is None and not task.is_placed:
        proposal = propose(task)
    stood = task  # the palm was, before contacts were
    if proposal is not None and proposal.sets:
        task = proposal.sets[0].in_task(task)
    model = build_model(task)
    table = Table.grid(padding=(0, 2))
    for name, text in _lines(task, stood, model.force_limit):
        table.add_row(Text(name, style="bold"), Text(text))
    title = Text.assemble((task.name, "bold"), f": {' '.join(task.about.split())}" if task.about else "")
    found = findings(task, model)
    told = [Text(f"is this meant? {question}") for question in questions]
    told += [Text(f"{'no hand can do this' if each.certain else 'may fail'}: {each.reason.text}") for each in found]
    placed, possible = [], not any(each.certain for each in found)
    if proposal is not None:
        placed = placement_summary(proposal)
        possible &= bool(proposal.sets)
        told += [] if proposal.sets else [Text(f"no hand can do this: {proposal.reason}")]
    return Group(title, table, *placed, *told), possible


def placement_summary(proposal: Proposal) -> list[RenderableType]:
    """The sets of contacts that the program found, best first."""
    if not proposal.sets:
        return []
    table = Table(box=None, padding=(0, 2), pad_edge=False)
    for name in ("set", "grip", "reach", "stiffness", "off side-on", "contacts, mm"):
        table.add_column(name, overflow="fold")
    for number, each in enumerate(proposal.sets, start=1):
        points = ", ".join(f"{name} {_numbers([1e3 * x for x in point])}" for name, point in each.points.items())
        figures = [f"{each.grip:.2f}", f"{each.reach:.2f}", f"{each.wobble:.2f}", f"{each.worst_angle:.0f}°"]
        table.add_row(str(number), *figures, points)
    words = (
        f"contacts are placed among {proposal.candidates} points that fingers can touch, of {proposal.drawn} spread "
        f"over the object. Grip: weights that the hardest-pressed contact presses with at least, at 70 % of the "
        f"friction, so that springs in place of motors withstand {proposal.sets[0].withstands}. Reach: what being off "
        f"side-on to the palm, far from it, travelling far and on a curved surface costs. Stiffness: that the grasp "
        f"asks for so as not to turn over, by what joints have. Set 1 has the least of all together and is shown "
        f"above; `solve` tries fingers on each, and takes what needs the fewest joints"
    )
    return [Text(), Text(words), table]


def _lines(task: Task, stood: Task, force_limit: float) -> Iterator[tuple[str, str]]:
    yield "object", _object(task)
    for mesh in task.object.meshes or ():
        yield "", f"{mesh.file}: {mesh.sentence}"
    yield "", f"inertia, principal: {_numbers(np.linalg.eigvalsh(np.array(task.object.inertia)))} kg·m²"
    if task.object.attached is not None:
        yield "", _joint(task.object.attached)
    yield "palm", _palm(task)
    yield from _standing(stood)
    for i, (name, finger) in enumerate(task.fingers.items()):
        yield "" if i else "fingers", f"{name} {_touches(finger)}"
    most = f"{force_limit:g} weights ({force_limit * task.force_unit:.3g} N)"
    yield "", f"contact forces of at most {most} along each axis of the object"
    yield "links", _links(task)
    yield "", _joints(task)
    for i, goal in enumerate(task.motion):
        yield "" if i else "goals", f"{goal.at:g} s: {_goal(goal)}"
    samples = f"samples at most {task.time_step:g} s apart"
    yield "motion", f"{task.duration:g} s, {task.keyframes_between} keyframes between goals, {samples}"
    yield "world", _world(task)
    for each in task.perturbations:
        push = f"force {_numbers(each.force)} N, torque {_numbers(each.torque)} N·m"
        yield "disturbed", f"from {each.start:g} s to {each.end:g} s: {push}"
    search = task.search
    yield (
        "search",
        (
            f"{search.trials} trials a finger and joint count, {search.recombinations} recombinations, "
            f"at most {search.max_joints} joints a finger, seed {search.seed}"
        ),
    )
    usual = Task.model_validate(task.model_dump(by_alias=True, exclude_none=True, exclude={"limits"})).limits
    # Lengths of the object differ in the last digit where its points have been moved to its centre of mass.
    changed = {name: value for name, value in task.limits if not math.isclose(value, getattr(usual, name))}
    if changed:
        yield (
            "limits",
            "changed from their defaults: " + ", ".join(f"{name} {value:g}" for name, value in changed.items()),
        )


def _touches(finger: FingerSpec) -> str:
    where = (
        f"touches the object at {_mm(finger.point)}" if finger.is_placed else f"may touch the object {finger.touches}"
    )
    for each in finger.regrasps or ():
        where += f", lets go at {each.start:g} s, from {each.end:g} s at {_mm(each.touches)}"
    return where if finger.placed is None else f"{where}, placed by the program: {finger.placed}"


def _object(task: Task) -> str:
    kinds = Counter(shape.body.kind for shape in task.object.shapes)
    shapes = " and ".join(f"{count} {_plural(kind, count)}" for kind, count in sorted(kinds.items()))
    return f"{task.object.mass:g} kg; {shapes}, {2e3 * task.object.characteristic_length:.4g} mm at its longest"


def _joint(attached: Attached) -> str:
    joint, unit = attached.joint, "N·m" if attached.joint.turns else "N"
    place = f"about {_numbers(joint.direction)} at {_mm(joint.pivot.tolist())}"
    if not joint.turns:
        place = f"along {_numbers(joint.direction)}"
    elif joint.advance:
        place += f", {2e3 * np.pi * joint.advance:.4g} mm a turn"
    over = "rad" if joint.turns else "m"
    parts = [f"friction {joint.friction:g} {unit}"]
    parts += [f"stiffness {joint.stiffness:g} {unit}/{over}"] if joint.stiffness else []
    parts += [f"damping {joint.damping:g} {unit}·s/{over}"] if joint.damping else []
    return f"on a {attached.kind} {place}; {', '.join(parts)}"


def _palm(task: Task) -> str:
    palm = task.palm
    moves = "the program may move it" if palm.may_move else "moves as the task says" if palm.motion else "stands still"
    disc = f"disc of {1e3 * palm.radius:.4g} mm radius, {1e3 * palm.thickness:.4g} mm thick"
    return f"{disc}, at {_mm(palm.position)}, fingers point to {_numbers(palm.facing)}; {moves}"


def _standing(task: Task) -> Iterator[tuple[str, str]]:
    """Where a palm stands that the program placed, and what it keeps off."""
    if task.palm.placed:
        yield "", f"placed by the program: {standing(task)}"
    elif task.keep_out:
        gaps = standing(task).keep_out_gaps
        yield "", f"keeps off {', '.join(f'{name}, {1e3 * gap:.3g} mm away' for name, gap in gaps.items())}"


def _links(task: Task) -> str:
    hand, motor = task.hand, task.actuator
    low, high = (1e3 * length for length in hand.link_length)
    lower, upper = hand.joint_limits
    most = [f"{value:g} {unit}" for value, unit in ((motor.torque, "N·m"), (motor.speed, "rad/s")) if value]
    motors = f"motors of {motor.stiffness:g} N·m/rad, {'at most ' + ' and '.join(most) if most else 'without limits'}"
    if hand.drive.servo:
        motors = f"servos {hand.drive.servo}, {motors}"
    if task.motors != "independent":
        shared = "as few as will do" if task.motors == "fewest" else f"at most {task.motors} for all joints"
        motors = f"{motors}, {shared}"
    thick = f"radius {1e3 * hand.link_radius:.4g} mm"
    if task.fingertip.radius > hand.link_radius:
        thick += f", of the last {1e3 * task.fingertip.radius:.4g} mm"
    sizes = f"{thick}, {low:.4g} to {high:.4g} mm long"
    return f"{sizes}; joints {lower:g} to {upper:g} deg; {motors}"


def _joints(task: Task) -> str:
    """What joints and links may be like, and how fingertips resist a twist."""
    hand, tip = task.hand, task.fingertip
    least, largest = hand.axes.from_link
    tips = (
        f"fingertips resist a twist by {1e3 * tip.torsion:.3g} mm times their force"
        if tip.torsion
        else "hard fingertips"
    )
    axes = f"axes {least:g} to {largest:g} deg from their links, links bent by at most {hand.bend:g} deg"
    return f"{axes}; of {hand.density:g} kg/m³, {1e-6 * hand.material.strength:g} MPa; {tips}"


def _goal(goal: Goal) -> str:
    if goal.tool_at is not None:
        return f"tool at {_mm(goal.tool_at)}"
    turn = (
        f"turned {goal.rotation.degrees:g} deg about {_numbers(goal.rotation.axis)}"
        if goal.rotation.degrees
        else "upright"
    )
    pressed = ""
    if goal.exert is not None:
        pressed = f"; pressing with {_numbers(goal.exert.force)} N, {_numbers(goal.exert.torque)} N·m on the way"
    return f"{_mm(goal.position or (0.0, 0.0, 0.0))}, {turn}{pressed}"


def _world(task: Task) -> str:
    ground = (
        f"ground at {1e3 * task.ground.height:.4g} mm, friction {task.ground.friction:g}"
        if task.ground
        else "no ground"
    )
    gravity = f"gravity {_numbers(task.gravity)} m/s²" if any(task.gravity) else "no gravity"
    return f"{gravity}; friction {task.friction:g}; {ground}"


def _mm(point: Sequence[float]) -> str:
    return f"{_numbers([1e3 * value for value in point])} mm"


def _numbers(values: Sequence[float] | np.ndarray) -> str:
    # Adding 0 turns -0 into 0.
    return f"[{', '.join(f'{round(float(value), 12) + 0:.4g}' for value in values)}]"


def _plural(kind: str, count: int) -> str:
    """A shape's name, of one or of many."""
    one, many = {"box": ("box", "boxes"), "convex": ("polytope", "polytopes")}.get(kind, (kind, f"{kind}s"))
    return one if count == 1 else many
