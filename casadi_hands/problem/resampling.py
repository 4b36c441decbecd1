"""A task and a motion of it at other samples, or for a homotopy parameter: easier problems to begin with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from casadi_hands.geometry.contact_points import on_bodies
from casadi_hands.motion import Schedule, catmull_rom, continuous, linear, nearest_exponential, zero_order_hold
from casadi_hands.problem.coupling import Coupling
from casadi_hands.problem.exerted import planned
from casadi_hands.problem.hand_motion import WholeHand, turned
from casadi_hands.problem.model import Model
from casadi_hands.problem.palm_motion import carried_by_palm, goals_seen_from_palm, stands
from casadi_hands.problem.scenario import Scenario

Array = NDArray[np.float64]


def resampled_model(model: Model, schedule: Schedule) -> Model:
    """The task with other samples between the same keyframes.

    A disturbance lasts to the next of its own samples; of those that act before the next knot a knot has the largest.
    """
    was, now = model.schedule.samples, schedule.samples
    first = zero_order_hold(was, now)
    end = np.append(np.searchsorted(was, now[1:] - 1e-9), len(was))

    plan = planned(now, model.exerted)

    def coarser(scenario: Scenario) -> Scenario:
        size = np.linalg.norm(np.hstack([scenario.force, scenario.torque]), axis=1)
        return scenario.at(np.array([i + np.argmax(size[i : max(i + 1, j)]) for i, j in zip(first, end, strict=True)]))

    palm = model.palm_path.at(now)
    return replace(
        model,
        schedule=schedule,
        palm_position=palm[:, :3],
        palm_quaternion=palm[:, 3:],
        scenarios=(plan, *([] if model.disturbance is None else [coarser(model.disturbance).plus(plan)])),
    )


def resampled(hand: WholeHand, before: Model, after: Model) -> WholeHand:
    """A motion at the samples of the same task with others.

    All moves on smooth curves, but fingers on straight ones next to a touch or a lift: they turn abruptly there, and a
    smooth curve would swing them through the object's surface. On a palm that the task moves, curves are as it sees
    them: it goes its own way, with what the hand adds to it.
    """
    was, now = before.schedule.samples, after.schedule.samples
    between, straight = catmull_rom(was, now), linear(was, now)
    interval = np.searchsorted(was, now, side="right") - 1

    def joints(contact: int, angles: Array) -> Array:
        switches = np.flatnonzero(np.diff(hand.active[:, contact])) + 1
        abrupt = np.isin(interval, [switches - 1, switches])
        return np.asarray(np.where(abrupt[:, None], straight, between) @ angles)

    moves = not stands(before)
    if moves:
        # Seen from a palm that only does what the hand adds to its way.
        path, finer = before.palm_path.at(was), before.palm_path.at(now)
        turns = zip(hand.palm_quaternion, path[:, 3:], strict=True)
        position = hand.palm_position - path[:, :3]
        vectors = np.array([pin.log3(_matrix(ours) @ _matrix(given).T) for ours, given in turns])
        hand = on_palm(hand, position + path[0, :3], _turned(vectors, np.tile(path[0, 3:], (len(was), 1))))
    quaternion = between @ continuous(hand.palm_quaternion)
    smooth = replace(
        hand,
        angles=tuple(map(joints, hand.contacts, hand.angles)),
        palm_position=between @ hand.palm_position,
        palm_quaternion=quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True),
        position=between @ hand.position,
        vector=between @ hand.vector,
        point=np.tensordot(between, hand.point, axes=1),
        force=np.tensordot(straight, hand.force, axes=1),
        active=hand.active[zero_order_hold(was, now)],
        disturbed=None,
        on_joint=None,
        torsion=None if hand.torsion is None else straight @ hand.torsion,
        coupling=_on_samples(hand.coupling, between),
    )
    if not moves:
        return smooth
    return on_palm(smooth, between @ position + finer[:, :3], _turned(between @ vectors, finer[:, 3:]))


def _on_samples(coupling: Coupling | None, weights: Array) -> Coupling | None:
    return None if coupling is None else replace(coupling, positions=weights @ coupling.positions)


def on_palm(hand: WholeHand, palm_position: Array, palm_quaternion: Array) -> WholeHand:
    """A motion whose palm goes another way, (S, 3) and (S, 4): what it holds goes along."""
    position, vector = hand.position.copy(), hand.vector.copy()
    for k, (was, now) in enumerate(zip(hand.palm_quaternion, palm_quaternion, strict=True)):
        turn = _matrix(now) @ _matrix(was).T
        position[k] = palm_position[k] + turn @ (hand.position[k] - hand.palm_position[k])
        vector[k] = nearest_exponential(turn @ pin.exp3(hand.vector[k]), hand.vector[k] + pin.log3(turn))
    palm = {"palm_position": palm_position, "palm_quaternion": palm_quaternion}
    return replace(hand, position=position, vector=vector, **palm)  # type: ignore[arg-type]


def _turned(vectors: Array, quaternions: Array) -> Array:
    return np.array([turned(q, v) for q, v in zip(quaternions, vectors, strict=True)])


def _matrix(quaternion: Array) -> Array:
    return np.asarray(pin.Quaternion(*quaternion).matrix())


def shortened(model: Model, homotopy: float) -> Model:
    """The task for a homotopy parameter: that part of what leads from its first goal to each of the others.

    No contact is planned to move but as the task says. A palm moves as far as ever; scaled is what the object moves as
    seen from it, of an attached one how far its joint moves.
    """
    regrasp = model.regrasp if model.regrasp is not None and model.regrasp.asked else None
    if model.attachment is not None:
        scaled = model.attachment.towards(homotopy)
        at = scaled.poses(scaled.goals)
        return replace(model, attachment=scaled, goal_positions=at[:, :3], goal_vectors=at[:, 3:], regrasp=regrasp)
    seen = goals_seen_from_palm(model)
    goals = carried_by_palm(model, seen[0] + homotopy * (seen - seen[0]), model.schedule.goal_samples)
    return replace(model, goal_positions=goals[:, :3], goal_vectors=goals[:, 3:], regrasp=regrasp)


def extrapolated(model: Model, first: WholeHand, second: WholeHand, by: float) -> WholeHand:
    """The second motion and ``by`` times what it differs by from the first, of one hand, contacts on the surface."""

    def beyond(a: Array, b: Array) -> Array:
        return b + by * (b - a)

    points = beyond(first.point, second.point)
    return replace(
        second,
        angles=tuple(beyond(a, b) for a, b in zip(first.angles, second.angles, strict=True)),
        position=beyond(first.position, second.position),
        vector=beyond(first.vector, second.vector),
        point=np.array([on_bodies(p, model.touched) for p in points]),
    )


def at_rest(model: Model, hand: WholeHand) -> WholeHand:
    """A motion that stays where the given one starts; on a palm that moves it stays so as seen from there."""

    def still(values: Array) -> Array:
        return np.repeat(values[:1], len(values), axis=0)

    moving = replace(model, palm_position=hand.palm_position, palm_quaternion=hand.palm_quaternion)
    pose = np.hstack([still(hand.position), still(hand.vector)])
    pose = carried_by_palm(moving, pose, np.arange(len(pose)))
    return replace(
        hand,
        angles=tuple(still(angles) for angles in hand.angles),
        position=pose[:, :3],
        vector=pose[:, 3:],
        point=still(hand.point),
    )
