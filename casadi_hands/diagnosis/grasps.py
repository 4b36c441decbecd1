"""Contacts that cannot hold the object at a goal or against a disturbance, whatever hand presses them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from casadi_hands.diagnosis.finding import WANDER, Finding, found, mm
from casadi_hands.diagnosis.moment import goal_at, moment
from casadi_hands.diagnosis.patches import nearby
from casadi_hands.geometry.contact_points import inward_normals
from casadi_hands.problem.loads import HELD, Acting, acting, cones
from casadi_hands.problem.model import Model, palm_from_world
from casadi_hands.statics.grasp import EDGES, friction_edges, torsion_edges
from casadi_hands.statics.programmes import least_missing, nonnegative_fit, opposes
from casadi_hands.task import Task

Array = NDArray[np.float64]
_MOST_FRICTION = 4.0  # beyond that of any fingertip
_FAR = np.radians(30)  # that an object's turn carries a contact, beyond which fingers may take it anew on the way
BETTER = "contacts that surround the object better or oppose each other"


def grasp_findings(task: Task, model: Model) -> Iterator[Finding]:
    """What the contacts cannot hold, by least squares and linear programmes over the forces in their friction cones."""
    if model.attachment is not None:  # which the world holds, and contacts need only move along its joint
        return
    if model.contacts == 1:
        single = list(_single(task, model))
        if single:
            yield from single
            return
    elif not np.any(model.gravity) and model.ground is None and not model.disturbance and _moves(model):
        yield from _one_sided(model)
    yield from _lost(task, model)


def _moves(model: Model) -> bool:
    poses = model.goal_poses
    return bool(np.abs(poses - poses[0]).max() > 1e-6)


def _single(task: Task, model: Model) -> Iterator[Finding]:
    """One finger can only push: it neither stops what nothing else does, nor carries what it lifts."""
    name = model.contact_names[0]
    if model.ground is None and not np.any(model.gravity) and not model.disturbance and _moves(model):
        what = (
            f"nothing stops the object: finger '{name}' is the only contact, a finger can only push, and the object "
            "must start and end at rest"
        )
        yield found(what, "a second finger that pushes from the other side (fingers), or gravity and a ground")
    if model.ground is not None and np.any(model.gravity) and not task.draws:
        lifted = [each for each in acting(model) if not each.grounded and not each.disturbed]
        if lifted:
            when = moment(model.schedule, float(model.schedule.samples[lifted[0].sample]))
            what = (
                f"finger '{name}' is the only contact at {when}, where the object is off the ground, and cannot hold it"
            )
            yield found(what, "two fingers or more (fingers), or goals on the ground")


def _one_sided(model: Model) -> Iterator[Finding]:
    """All contacts push to one side, so that the object never comes to rest again."""
    normals = inward_normals(model.patches, model.touched)
    if opposes(_wrenches(model.patches, normals, model.friction)[:3]):
        return
    near = [nearby(model, point) for point in model.patches]
    points, outward = (np.vstack([each[side] for each in near]) for side in (0, 1))
    certain = not opposes(_wrenches(points, -outward, model.friction)[:3])
    what = (
        "nothing stops the object: all fingers push it to one side (fingers), none pushes back, and it must start and "
        "end at rest"
    )
    yield found(what, BETTER, certain)


def _lost(task: Task, model: Model) -> Iterator[Finding]:
    """The load that contacts are farthest from bearing, and whether they are so wherever stages may move them."""
    missed = [(float(np.linalg.norm(_missing(model, each))), each) for each in acting(model)]
    for disturbed in (False, True):
        worst = max((m for m in missed if m[1].disturbed == disturbed), key=lambda m: m[0], default=None)
        if worst is None or worst[0] <= HELD:
            continue
        each = worst[1]
        time = float(model.schedule.samples[each.sample])
        # Of a drawing's object, and of one between goals, the task does not say how it stands.
        stands = not task.draws and (disturbed or goal_at(model.schedule, time) is not None)
        certain = stands and not _held_nearby(model, each)
        missing = _missing(model, each)
        where = f"wherever within {mm(model, WANDER)} of there they touch" if certain else "where they touch (touches)"
        what = (
            f"at {moment(model.schedule, time)} the fingers cannot hold the object against {_against(model, each)} "
            f"with friction {model.friction:g} (friction), however hard they press, {where}: "
            f"{wrench_words(model, missing)} missing"
        )
        least = _least_friction(model, each)
        advice = BETTER if least is None else f"friction of {least:.2g} or more, or {BETTER}"
        yield found(what, advice, certain)
        return


def _missing(model: Model, load: Acting, friction: float | None = None) -> Array:
    """(6,) wrench that contacts cannot make of a load where the task puts them."""
    points, mu, count = model.patches, model.frictions, model.contacts + load.grounded
    normals = inward_normals(points, model.touched)
    normals[model.contacts :] = load.turn[2]
    if friction is not None:
        mu[: model.contacts] = friction
    _, wrenches = cones(points[:count], normals[:count], mu[:count], model.torsion, model.contacts)
    return load.needed - wrenches @ nonnegative_fit(wrenches, load.needed)[0]


def _held_nearby(model: Model, load: Acting) -> bool:
    """Whether a load may be borne if each contact were at all places at once that it may be moved to."""
    places = [nearby(model, center) for i in range(model.contacts) for center in _centers(model, load, i)]
    points, outward = (np.vstack([place[side] for place in places]) for side in (0, 1))
    wrenches = [_wrenches(points, -outward, model.friction), torsion_edges(points, -outward, model.torsion)]
    if load.grounded:
        wrenches.append(_wrenches(model.patches[-1:], load.turn[2:], float(model.frictions[-1])))
    return least_missing(np.hstack(wrenches), load.needed, HELD) <= HELD


def _wrenches(points: Array, normals: Array, friction: float) -> Array:
    """(6, 8K) of unit normal forces on the edges of circumscribed friction cones at points (K, 3)."""
    edges = friction_edges(normals, np.full(len(points), friction / np.cos(np.pi / EDGES)))
    return np.vstack([edges, np.cross(np.repeat(points, EDGES, axis=0), edges.T).T])


def _centers(model: Model, load: Acting, contact: int) -> list[Array]:
    """Where a finger's contact may be by then: as put, or where its finger may have taken the object anew."""
    point, body = model.patches[contact], model.touched[contact]
    time = float(model.schedule.samples[load.sample])
    first = next(acting(model)).turn
    start, now = palm_from_world(model, 0.0)[0] @ first, palm_from_world(model, time)[0] @ load.turn
    anew = now.T @ start @ point
    if np.arctan2(np.linalg.norm(np.cross(anew, point)), anew @ point) < _FAR:
        return [point]
    return [point, body.on_surface(anew), body.on_surface(point + anew)]


def _least_friction(model: Model, load: Acting) -> float | None:
    """The least friction with which contacts bear a load where the task puts them, to a hundredth of it; or None."""

    def enough(friction: float) -> bool:
        return float(np.linalg.norm(_missing(model, load, friction))) <= HELD

    low, high = model.friction, _MOST_FRICTION
    if high <= low or not enough(high):
        return None
    while high - low > 0.01 * high:
        middle = (low + high) / 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high


def _against(model: Model, load: Acting) -> str:
    force, torque = float(np.linalg.norm(load.force)), float(np.linalg.norm(load.torque))
    parts = ["its weight"] if np.any(model.gravity) else []
    parts += [f"the task's force of {force * model.units.force:.3g} N"] if force else []
    parts += [f"the task's torque of {torque * model.units.torque:.3g} N·m"] if torque else []
    return " and ".join(parts)


def wrench_words(model: Model, wrench: Array) -> str:
    """How much force and torque a wrench (6,) has, in words."""
    force, torque = (float(np.linalg.norm(part)) for part in (wrench[:3], wrench[3:]))
    parts = [f"a force of {force:.2g} weights"] if force > HELD / 2 else []
    parts += [f"a torque of {1e3 * torque * model.units.torque:.3g} mN·m"] if torque > HELD / 2 else []
    return f"{' and '.join(parts)} {'are' if len(parts) > 1 else 'is'}"
