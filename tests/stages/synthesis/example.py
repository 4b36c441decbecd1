"""A target and fingers with closed forms: a ball held from two sides above a palm that looks up."""

from __future__ import annotations

import numpy as np

from casadi_hands.kinematics.morphology import FingerSeed
from casadi_hands.problem.floating_motion import Floating
from casadi_hands.problem.si import build_model
from casadi_hands.stages.synthesis.stage import Synthesised
from casadi_hands.stages.synthesis.target import Target, target_of
from casadi_hands.task import Task, parse_task
from tests.stages.example import STAND, made_up_solution

BALL = """
object: {mass: 0.1, shapes: [{sphere: {center: [0, 0, 0], radius: 0.03}}]}
palm: {radius: 0.06, position: [0, 0, 0], facing: [0, 0, 1], up: [1, 0, 0]}
motion: [{at: 0, position: [0, 0, 0.09]}, {at: 0.6, position: [0, 0.015, 0.09]}]
fingers: {left: {touches: [0, -0.03, 0]}, right: {touches: [0, 0.03, 0]}}
friction: 0.5
keyframes_between: 1
"""
SQUEEZE, LIFT = 2.0, 0.5


def ball_task() -> Task:
    return parse_task(BALL)


def ball_target(squeeze: float = SQUEEZE) -> Target:
    """Two fingers squeeze a ball and lift half its weight each; it moves 1.5 cm sideways."""
    model = build_model(ball_task())
    keyframes, samples = len(model.schedule.keyframes), len(model.schedule.samples)
    pose = np.zeros((keyframes, 6))
    pose[:, :3] = model.goal_positions[0]
    pose[:, 1] = np.linspace(0, model.goal_positions[1][1], keyframes)
    force = np.array([[0, squeeze, LIFT], [0, -squeeze, LIFT]])
    floating = Floating(
        pose=pose,
        point=np.tile(model.patches, (keyframes, 1, 1)),
        force=np.tile(force, (samples, 1, 1)),
        active=np.ones((keyframes, 2), bool),
        invariant=np.ones((keyframes, 2)),
        threshold=0.1,
        solution=made_up_solution({}),
        runs=(),
        model=model,
    )
    return target_of(model, floating)


def foot(target: Target) -> float:
    """Height of a finger's first joint, lengths."""
    return STAND * target.model.link_radius


def pointing(target: Target, contact: int, axes: list[list[float]]) -> FingerSeed:
    """A straight upright finger whose pole is at its contact at every keyframe, as the contact is at the first.

    Its joints' axes are given; lengths are equal. With the contact moving, only the first keyframe is met.
    """
    joints = len(axes)
    x, y, z = target.points[0, contact]
    lengths = np.full(joints, (z - foot(target) - target.model.link_radius) / joints)
    frames = []
    for axis in axes:
        unit = np.array(axis) / np.linalg.norm(axis)
        helper = np.eye(3)[np.argmin(np.abs(unit))]
        across = np.cross(helper, unit) / np.linalg.norm(np.cross(helper, unit))
        frames.append(np.column_stack([across, np.cross(unit, across), unit]))
    return FingerSeed(
        base=np.array([x, y]),
        lengths=lengths,
        frames=np.array(frames),
        axes=np.zeros((joints, 2)),
        bends=np.zeros((joints, 2)),
        angles=np.zeros((len(target.times), joints)),
        tips=np.zeros((1, 2)),
    )


def hand(fingers: list[FingerSeed], contacts: tuple[int, ...], objective: float = 1.0, **terms: float) -> Synthesised:
    """A solve's result, made up."""
    values = {"tip_target": 0.0, "null_space": 0.0, **terms}
    solution = made_up_solution({}, objective, **values)
    return Synthesised(tuple(fingers), contacts, solution, (("anneal 2", solution),))
