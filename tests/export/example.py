"""A small design made by hand: three planar fingers of two joints hold a capsule and move it to and fro."""

from __future__ import annotations

import numpy as np

from casadi_hands.export.design import Design
from casadi_hands.problem.hand import Finger, Hand, Link
from casadi_hands.problem.motion import Motion
from casadi_hands.task import Task, parse_task

TASK = """
name: move a capsule & back
object:
  mass: 0.1
  shapes:
    - capsule: {start: [0, 0, -0.04], end: [0, 0, 0.04], radius: 0.02}
palm: {radius: 0.06, position: [0, 0, 0.3], facing: [1, 0, 0]}
motion:
  - {at: 0, position: [0.075, 0, 0.3]}
  - {at: 1, position: [0.115, 0, 0.3], rotation: {axis: [0, 0, 1], degrees: 30}}
  - {at: 2, position: [0.075, 0, 0.3]}
fingers:
  thumb: {touches: [0, 0.02, -0.01]}
  index: {touches: [0, -0.02, 0.02]}
  middle: {touches: [0, -0.02, -0.03]}
ground: {height: 0.2, friction: 0.8}
"""
LINK_RADIUS = 0.008
LENGTHS = (0.07, 0.08)
HEIGHT = 1.05 * LINK_RADIUS  # of the first joints, so that their balls clear the palm's face
BASES = {"thumb": (-0.01, -0.045, HEIGHT), "index": (0.02, 0.045, HEIGHT), "middle": (-0.03, 0.045, HEIGHT)}


def example_task() -> Task:
    """The task, with a turn at its middle goal and a ground."""
    return parse_task(TASK, "example.yaml")


def example_hand() -> Hand:
    """Fingers that bend in planes at right angles to the palm's x axis."""
    links = tuple(Link(length, LINK_RADIUS, (1.0, 0.0, 0.0)) for length in LENGTHS)
    fingers = tuple(Finger(name, base, links) for name, base in BASES.items())
    return Hand(0.06, 0.012, fingers, -np.pi, np.pi, 2.0, 6.0, 1150.0)


def example_motion(palm_shift: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Motion:
    """Twenty-one samples; by the end the palm has moved by `palm_shift` (m, world)."""
    time = np.linspace(0.0, 2.0, 21)
    swing = (1 - np.cos(np.pi * time)) / 2
    position = np.array([0.075, 0.0, 0.3]) + swing[:, None] * [0.04, 0.0, 0.0]
    half = np.radians(30) * swing / 2
    orientation = np.stack([np.cos(half), 0 * half, 0 * half, np.sin(half)], axis=1)
    base = np.array([0.0, 0.0, 0.3]) + (time / 2)[:, None] * np.array(palm_shift)
    # World <- palm: z faces world x, x is up; the quaternion of the turn by 120 degrees and a flip that does it.
    palm = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
    angles, force, on_object, on_link = [], [], [], []
    for k in range(len(time)):
        turn = np.array(
            [
                [np.cos(2 * half[k]), -np.sin(2 * half[k]), 0],
                [np.sin(2 * half[k]), np.cos(2 * half[k]), 0],
                [0, 0, 1],
            ]
        )
        row = []
        for name, finger_base in BASES.items():
            side = np.sign(finger_base[1])
            tip = palm.T @ (position[k] - [0.0, 0.0, 0.3]) + [finger_base[0], side * (0.02 + LINK_RADIUS), 0.0]
            row.append(_bend(tip[1] - finger_base[1], tip[2] - finger_base[2], side))
            normal = palm @ [0.0, -side, 0.0]
            force.append(normal * (1.2 if name == "thumb" else 0.6) + [0.0, 0.0, 0.327])
            on_object.append(turn.T @ (palm @ [finger_base[0], side * 0.02, 0.0]))
            first, second = row[-1]
            bend = np.array(
                [
                    [1, 0, 0],
                    [0, np.cos(first + second), -np.sin(first + second)],
                    [0, np.sin(first + second), np.cos(first + second)],
                ]
            )
            on_link.append([0.0, 0.0, LENGTHS[1]] + bend.T @ [0.0, -side * LINK_RADIUS, 0.0])
        angles.append(np.concatenate(row))
    count = len(time)
    return Motion(
        time=time,
        object_position=position,
        object_orientation=orientation,
        base_position=base,
        base_orientation=np.tile([0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)], (count, 1)),
        joint_angles=np.array(angles),
        joint_names=example_hand().joint_names,
        contact_names=tuple(BASES),
        contact_link=tuple(f"finger{i}_link1" for i in range(3)),
        contact_active=np.ones((count, 3), dtype=bool),
        contact_force=np.array(force).reshape(count, 3, 3),
        contact_point_object=np.array(on_object).reshape(count, 3, 3),
        contact_point_link=np.array(on_link).reshape(count, 3, 3),
        external_force=np.zeros((count, 3)),
        external_torque=np.zeros((count, 3)),
    )


def example_design() -> Design:
    """Hand and motion, with something in every other entry."""
    return Design(
        task=example_task(),
        status="feasible",
        reason="made by hand",
        hand=example_hand(),
        motion=example_motion(),
        costs={"whole_hand": {"torque": {"weight": 0.05, "value": 1.25}}},
        certificate={"slip": {"value": 0.01, "limit": 0.0002, "holds": False}},
        stages=[{"stage": "whole_hand", "seed": 3, "iterations": 17, "status": "Solve_Succeeded"}],
        seconds={"whole_hand": 1.5, "total": 1.5},
    )


def _bend(across: float, along: float, side: float) -> tuple[float, float]:
    """Angles of two joints about x that put the tip at (y, z) = (across, along) from the base, elbow outward."""
    first, second = LENGTHS
    cosine = (across**2 + along**2 - first**2 - second**2) / (2 * first * second)
    inner = side * np.arccos(cosine)
    outer = np.arctan2(-across, along) - np.arctan2(second * np.sin(inner), first + second * np.cos(inner))
    return float(outer), float(inner)
