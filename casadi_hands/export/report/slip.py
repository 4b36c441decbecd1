"""How far contacts slip over time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.interpolate import CubicSpline

from casadi_hands.export.page.timeline import Timeline
from casadi_hands.problem.motion import Motion


def slip_so_far(motion: Motion, timeline: Timeline) -> np.ndarray:
    """How far (S, C) every contact has slipped since it touched, m; not a number where it does not touch.

    At each sample, the speed of the object's material point at the contact relative to that of the other body; poses
    are differentiated by cubic splines over each touch, and the speeds added up by trapezoids.

    Args:
        motion: with the contacts.
        timeline: where its bodies are.
    """
    slip = np.full(motion.contact_active.shape, np.nan)
    for c, link in enumerate(motion.contact_link):
        body = timeline.palm @ timeline.links[link] if link in timeline.links else None
        for first, last in touches(motion.contact_active[:, c]):
            end = min(last + 1, len(motion.time) - 1)
            run = slice(first, last + 1)
            time, velocity = motion.time[run], np.zeros((last + 1 - first, 3))
            moving = [(timeline.object, motion.contact_point_object, 1.0)]
            if body is not None:
                moving.append((body, motion.contact_point_link, -1.0))
            for poses, points, sign in moving:
                rate = _rates(motion.time, poses, first, end)[: len(time)]
                velocity += sign * (np.einsum("sij,sj->si", rate[:, :3, :3], points[run, c]) + rate[:, :3, 3])
            speed = np.linalg.norm(velocity, axis=1)
            steps = (speed[1:] + speed[:-1]) / 2 * np.diff(time)
            slip[run, c] = np.concatenate([[0.0], np.cumsum(steps)])
    return slip


def touches(active: np.ndarray) -> Iterator[tuple[int, int]]:
    """First and last sample of every stretch over which a contact (S,) is active."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], active, [False]]).astype(int)))
    for first, after in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        yield first, after - 1


def _rates(time: np.ndarray, poses: np.ndarray, first: int, end: int) -> np.ndarray:
    """Derivatives of poses (S, 4, 4) from a sample to another, 1/s; motions start and end at rest."""
    if end == first:
        return np.zeros_like(poses[first : end + 1])
    at_rest = (1, np.zeros((4, 4)))
    bounds = (at_rest if first == 0 else "not-a-knot", at_rest if end == len(time) - 1 else "not-a-knot")
    spline = CubicSpline(time[first : end + 1], poses[first : end + 1], bc_type=bounds)
    return np.asarray(spline(time[first : end + 1], 1))
