"""Gaits: who lets go when, and takes the object anew where, so that the others hold it however far it turns."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice, pairwise

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from casadi_hands.problem.model import Model
from casadi_hands.problem.regrasp import Regrasp
from casadi_hands.stages.floating.gate import can_hold, needed_wrenches
from casadi_hands.stages.floating.regrasp import FARTHEST, angle_between, turns_seen

Array = NDArray[np.float64]
ROLLED = np.radians(200)  # that an object turns, seen from the palm: fingers of three joints can roll along with less
_BEHIND = np.radians([75.0, 50.0, 25.0, 0.0])  # that a contact may touch behind where it first took the object
_STILL = np.radians(3)  # that it turns between two keyframes: none need let go
_LIFT = 0.5  # cost of a lift; of a contact that has travelled by FARTHEST, at one keyframe: 1
_WIDTH = 40  # ways that are gone on with
_FRICTION = 0.8  # share of it that those who hold may use


@dataclass(frozen=True)
class _Way:
    """What is planned up to a keyframe.

    Attributes:
        cost: of it.
        ahead: least cost of the lifts that must follow.
        patches: (C, 3) of the contacts at each keyframe so far, object frame.
        lifts: the contact that is lifted from each keyframe but the last to the next, or -1.
    """

    cost: float
    ahead: float
    patches: tuple[Array, ...]
    lifts: tuple[int, ...] = ()

    @property
    def rank(self) -> float:
        """What it costs at least."""
        return self.cost + self.ahead


def gait(model: Model, pose: Array) -> Regrasp | None:
    """Plan by a beam search who lifts when and where to: at most one contact between two keyframes.

    A contact that has travelled around the object, seen from the palm, lets go and touches again behind where it first
    took it. The others can hold the object meanwhile, with ``_FRICTION`` of the friction; fingertips keep off each
    other. Few lifts and little travel are best.

    Args:
        model: the task.
        pose: (N, 6) of the object at the keyframes.

    Returns:
        The plan, or None where there is none.
    """
    search = _Search(model, pose)
    ways = [_Way(0.0, 0.0, (model.keyframe_patches[0],))]
    for k in range(len(pose) - 1):
        found = sorted((step for way in ways for step in search.steps(way, k)), key=lambda way: way.rank)
        ways = list(islice((way for way in found if search.holds(way, k)), _WIDTH))
    if not ways or set(ways[0].lifts) == {-1}:
        return None
    lifts = np.array([*ways[0].lifts, -1])
    return Regrasp(lifts[:, None] == np.arange(len(model.touched)), np.array(ways[0].patches))


def farthest_turn(model: Model, pose: Array) -> float:
    """How far the object turns from its first orientation, seen from the palm, rad; turns of more than one count."""
    turns = turns_seen(model, pose)
    steps = np.array([np.zeros(3), *(pin.log3(b @ a.T) for a, b in pairwise(turns))])
    return float(np.linalg.norm(np.cumsum(steps, axis=0), axis=1).max())


class _Search:
    def __init__(self, model: Model, pose: Array) -> None:
        self.model, self.turns, self.needed = model, turns_seen(model, pose), needed_wrenches(model, pose)
        self.homes = [self.turns[0] @ patch for patch in model.keyframe_patches[0]]
        steps = [pin.log3(b @ a.T) for a, b in pairwise(self.turns)]
        self.sizes = np.array([*(np.linalg.norm(step) for step in steps), 0.0])
        self.axes = [
            step / size if size > _STILL else np.zeros(3) for step, size in zip(steps, self.sizes, strict=False)
        ]
        self.axes.append(np.zeros(3))

    def steps(self, way: _Way, k: int) -> Iterator[_Way]:
        """What may follow up to keyframe k + 1, whether or not it can be held; nothing travels too far."""
        contacts, patches = range(self.model.contacts), way.patches[-1]
        yield from self._to(way, k, -1, patches)
        # The last keyframe is too late to touch again, the first too early to let go.
        if k == 0 or k >= len(self.turns) - 2:
            return
        turn, axis = self.turns[k + 1], self.axes[k + 1]
        for c in contacts:
            if angle_between(turn @ patches[c], self.homes[c]) < _BEHIND[-2]:
                continue
            for behind in _BEHIND if axis.any() else _BEHIND[-1:]:
                moved = patches.copy()
                taken = pin.exp3(-behind * axis) @ self.homes[c]
                moved[c] = self.model.touched[c].on_surface(turn.T @ taken)
                yield from self._to(way, k, c, moved)

    def holds(self, way: _Way, k: int) -> bool:
        """Whether those that touch can hold the object from keyframe k to the next."""
        active = np.arange(len(self.model.touched)) != way.lifts[-1]
        return all(
            can_hold(self.model, way.patches[k], active, self.needed[i], pivots=True, share=_FRICTION)
            for i in (k, k + 1)
        )

    def _to(self, way: _Way, k: int, lifted: int, patches: Array) -> Iterator[_Way]:
        """The way to keyframe k + 1 with these patches there, if none is too far or in another's place."""
        turn, axis, left = self.turns[k + 1], self.axes[k + 1], float(self.sizes[k + 1 :].sum())
        fingers = range(self.model.contacts)
        at = [turn @ patches[c] for c in fingers]
        travel = np.array([angle_between(point, home) for point, home in zip(at, self.homes, strict=False)])
        if travel.max() > FARTHEST or self._crowded(patches):
            return
        signs = [np.sign(np.cross(home, point) @ axis) for point, home in zip(at, self.homes, strict=False)]
        room = FARTHEST - np.array(signs) * travel
        # Of a contact near the axis of the turn, which hardly travels, none of that is missing.
        far = [np.linalg.norm(np.cross(point, axis)) > np.linalg.norm(point) / 2 for point in at]
        missing = np.where(far, np.maximum(left - room, 0.0), 0.0)
        ahead = _LIFT * float((missing / (FARTHEST + _BEHIND[0])).sum())
        cost = way.cost + float(((travel / FARTHEST) ** 2).sum()) + _LIFT * (lifted >= 0)
        yield _Way(cost, ahead, (*way.patches, patches), (*way.lifts, lifted))

    def _crowded(self, patches: Array) -> bool:
        """Whether fingertips at these points are in each other."""
        radius, fingers = self.model.tip_radius, self.model.contacts
        tips = [p + radius * self.model.touched[c].outward(p) for c, p in enumerate(patches[:fingers])]
        apart = [float(np.linalg.norm(a - b)) for i, a in enumerate(tips) for b in tips[:i]]
        return min(apart, default=np.inf) < 2 * radius + self.model.clearance
