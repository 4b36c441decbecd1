"""Pictures of capsules and discs by ray casting in NumPy: no graphics card, no window, the same anywhere.

All vectors are in one world frame and one unit of length.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from camera import OVERSAMPLING, Camera

KEY_LIGHT = np.array([-0.35, 0.7, 0.8])
"""Towards the light: right, up and back to the viewer."""
_OUTLINE = 0.55  # of the colour that is left where one body ends before another
_FAR = 1e9


@dataclass(frozen=True)
class Capsule:
    """All points within ``radius`` of a segment; a sphere if both ends are one.

    Attributes:
        start, end: (3,).
        radius: of the capsule.
        color: RGB in 0..1.
        ends: RGB of both round ends; as ``color`` if None.
        checks: (4, 4) world <- frame whose octants are coloured and pale by turns; one colour if None.
        shades: whether it darkens others; what hardly stands out of another body need not.
    """

    start: np.ndarray
    end: np.ndarray
    radius: float
    color: tuple[float, float, float]
    ends: tuple[float, float, float] | None = None
    checks: np.ndarray | None = None
    shades: bool = True


@dataclass(frozen=True)
class Disc:
    """A solid disc.

    Attributes:
        pose: (4, 4) world <- disc; z is its axis, the origin in the middle of its upper face.
        radius, thickness: of the disc.
        color: RGB in 0..1.
    """

    pose: np.ndarray
    radius: float
    thickness: float
    color: tuple[float, float, float]


def draw(camera: Camera, bodies: list[Capsule | Disc], ground: float | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Draw solid bodies, with light, shadow and outlines, and shadows on the level ground.

    Args:
        camera: the view.
        bodies: what is seen.
        ground: its height; None for no ground.

    Returns:
        Picture (rows, columns, 4), RGBA in 0..1, oversampled, and distance (rows, columns) of what each ray meets.
    """
    rays = camera.rays
    distance = np.full(rays.shape[:2], _FAR)
    nearest = np.full(rays.shape[:2], -1)
    for k, body in enumerate(bodies):
        rows, columns = _window(camera, body)
        met = _meet(camera.position, rays[rows, columns], body)
        closer = met < distance[rows, columns]
        distance[rows, columns][closer] = met[closer]
        nearest[rows, columns][closer] = k
    picture = np.zeros((*distance.shape, 4))
    light = KEY_LIGHT / np.linalg.norm(KEY_LIGHT) @ camera.axes
    round_bodies = [body for body in bodies if isinstance(body, Capsule) and body.shades]
    for k, body in enumerate(bodies):
        mine = nearest == k
        points = camera.position + distance[mine][:, None] * rays[mine]
        normal, color = _surface(points, body)
        others = [other for other in round_bodies if other is not body]
        picture[mine, :3] = (
            _shade(color, normal, -rays[mine], light) * _openness(points, normal, light, others)[:, None]
        )
        picture[mine, 3] = 1.0
    edge = _edges(distance, nearest)
    picture[edge, :3] *= _OUTLINE
    if ground is not None:
        _draw_ground(picture, camera.position, rays, nearest, light, round_bodies, ground)
    return picture, distance


def overlay(
    picture: np.ndarray,
    distance: np.ndarray,
    camera: Camera,
    bodies: Sequence[Capsule | Disc],
    opacity: float,
    through: bool,
) -> None:
    """Draw translucent bodies over a picture, each pixel once.

    Args:
        picture: (rows, columns, 4) RGBA, changed in place.
        distance: (rows, columns) of what is in the picture.
        camera: that made the picture.
        bodies: what is added.
        opacity: share of their colour.
        through: whether solid bodies in front do not hide them.
    """
    rays, met_first = camera.rays, np.full(distance.shape, _FAR)
    color = np.zeros((*distance.shape, 3))
    for body in bodies:
        rows, columns = _window(camera, body)
        met = _meet(camera.position, rays[rows, columns], body)
        closer = met < met_first[rows, columns]
        met_first[rows, columns][closer] = met[closer]
        color[rows, columns][closer] = body.color
    shown = (met_first < _FAR) if through else (met_first < distance)
    below = picture[shown, 3:]
    alpha = opacity + (1 - opacity) * below
    picture[shown, :3] = (opacity * color[shown] + (1 - opacity) * below * picture[shown, :3]) / alpha
    picture[shown, 3:] = alpha


def _window(camera: Camera, body: Capsule | Disc) -> tuple[slice, slice]:
    """Rows and columns of the rays that can meet a body: those near its bounding spheres."""
    if isinstance(body, Capsule):
        centers, radius = np.array([body.start, body.end]), body.radius
    else:
        centers, radius = body.pose[None, :3, 3], float(np.hypot(body.radius, body.thickness))
    seen = (centers - camera.position) @ camera.axes.T
    width, height = (OVERSAMPLING * n for n in camera.size)
    middle = camera.focal * seen[:, :2] / -seen[:, 2:] - camera.offset
    reach = 1.2 * camera.focal * radius / -seen[:, 2].max()
    low, high = width * (middle.min(axis=0) - reach), width * (middle.max(axis=0) + reach)
    columns = np.clip([width / 2 + low[0], width / 2 + high[0] + 1], 0, width).astype(int)
    rows = np.clip([height / 2 - high[1], height / 2 - low[1] + 1], 0, height).astype(int)
    return slice(*rows), slice(*columns)


def _meet(origin: np.ndarray, rays: np.ndarray, body: Capsule | Disc) -> np.ndarray:
    """Distance along each ray (..., 3) to where it enters a body; very large where it misses."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return _meet_capsule(origin, rays, body) if isinstance(body, Capsule) else _meet_disc(origin, rays, body)


def _meet_capsule(origin: np.ndarray, rays: np.ndarray, body: Capsule) -> np.ndarray:
    axis, from_start, from_end = body.end - body.start, origin - body.start, origin - body.end
    length = float(axis @ axis)
    entered = np.full(rays.shape[:-1], _FAR)
    for offset in (from_start, from_end):
        half, rest = rays @ offset, offset @ offset - body.radius**2
        under = half**2 - rest
        entered = np.minimum(entered, np.where(under > 0, -half - np.sqrt(under), _FAR))
    along = rays @ axis
    a = length - along**2
    b = length * (rays @ from_start) - (axis @ from_start) * along
    c = length * (from_start @ from_start - body.radius**2) - (axis @ from_start) ** 2
    under = b**2 - a * c
    t = (-b - np.sqrt(under)) / a
    height = axis @ from_start + t * along
    on_side = (under > 0) & (a > 1e-12 * length) & (height > 0) & (height < length)
    # The cylinder lies outside the balls at its ends, where it is met at all.
    return np.where(on_side, t, entered)


def _meet_disc(origin: np.ndarray, rays: np.ndarray, body: Disc) -> np.ndarray:
    start, local = (origin - body.pose[:3, 3]) @ body.pose[:3, :3], rays @ body.pose[:3, :3]
    levels = (np.array([0.0, -body.thickness]) - start[2]) / local[..., 2:]
    a, b = (local[..., :2] ** 2).sum(axis=-1), local[..., :2] @ start[:2]
    root = np.sqrt(b**2 - a * (start[:2] @ start[:2] - body.radius**2))
    enter = np.maximum(levels.min(axis=-1), (-b - root) / a)
    leave = np.minimum(levels.max(axis=-1), (-b + root) / a)
    return np.where(enter < leave, enter, _FAR)


def _surface(points: np.ndarray, body: Capsule | Disc) -> tuple[np.ndarray, np.ndarray]:
    """Outward unit normals and colours, (P, 3) each, at points (P, 3) of a body's surface."""
    color = np.tile(body.color, (len(points), 1))
    if isinstance(body, Disc):
        local = (points - body.pose[:3, 3]) @ body.pose[:3, :3]
        rim = np.hypot(local[:, 0], local[:, 1]) - body.radius
        flat = np.where(local[:, 2] > -body.thickness / 2, 1.0, -1.0)
        on_face = np.minimum(np.abs(local[:, 2]), np.abs(local[:, 2] + body.thickness)) < np.abs(rim)
        across = np.where(on_face[:, None], 0.0, local * [1.0, 1.0, 0.0] / body.radius)
        return (across + np.outer(np.where(on_face, flat, 0.0), [0.0, 0.0, 1.0])) @ body.pose[:3, :3].T, color
    share, nearest = _on_axis(points, body)
    if body.ends is not None:
        color[(share <= 0) | (share >= 1)] = body.ends
    if body.checks is not None:
        local = (points - body.checks[:3, 3]) @ body.checks[:3, :3]
        pale = np.prod(np.where(local > 0, 1, -1), axis=1) > 0
        color[pale] = 0.25 * color[pale] + 0.72
    return (points - nearest) / body.radius, color


def _on_axis(points: np.ndarray, body: Capsule) -> tuple[np.ndarray, np.ndarray]:
    """Share (P,) of the way from start to end, clamped, and point (P, 3) of the axis nearest to each point."""
    axis = body.end - body.start
    share = np.clip((points - body.start) @ axis / max(float(axis @ axis), 1e-18), 0.0, 1.0)
    return share, body.start + share[:, None] * axis


def _shade(color: np.ndarray, normal: np.ndarray, to_eye: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Colours (P, 3) under a key light, a sky and a little gloss."""
    key = np.maximum(normal @ light, 0.0)
    sky = 0.5 + 0.5 * normal[:, 2]
    between = to_eye + light
    gloss = np.maximum((normal * between).sum(axis=1) / np.linalg.norm(between, axis=1), 0.0) ** 40
    shaded: np.ndarray = color * (0.5 + 0.2 * sky + 0.62 * key)[:, None] + 0.2 * gloss[:, None]
    return shaded


def _openness(points: np.ndarray, normal: np.ndarray, light: np.ndarray, others: list[Capsule]) -> np.ndarray:
    """How much light (P,) reaches points past other bodies: 1 for all, less in shadow and in corners."""
    lit, open_sky = np.ones(len(points)), np.ones(len(points))
    facing = np.maximum(normal @ light, 0.0)
    in_light = facing > 0
    lit_points = points[in_light]
    for other in others:
        to_other = _on_axis(points, other)[1] - points
        distance = np.maximum(np.sqrt(np.einsum("ij,ij->i", to_other, to_other)), other.radius)
        cosine = np.maximum(np.einsum("ij,ij->i", normal, to_other) / distance, 0.0)
        open_sky *= 1 - 0.6 * cosine * (other.radius / distance) ** 2
        # How near the ray to the light passes the other's axis, from the nearest of a few places along it.
        miss = np.full(len(lit_points), np.inf)
        for share in (0.0, 0.33, 0.67, 1.0) if (other.start != other.end).any() else (0.0,):
            beyond = other.start + share * (other.end - other.start) - lit_points
            ahead = beyond @ light
            aside = np.sqrt(np.maximum(np.einsum("ij,ij->i", beyond, beyond) - ahead**2, 0.0))
            miss = np.minimum(miss, np.where(ahead > 0.5 * other.radius, aside, np.inf))
        lit[in_light] = np.minimum(lit[in_light], 1 - np.clip(1.5 - miss / other.radius, 0.0, 1.0))
    openness: np.ndarray = open_sky * (1 - 0.4 * facing * (1 - lit))
    return openness


def _edges(distance: np.ndarray, nearest: np.ndarray) -> np.ndarray:
    """Where a body ends before another or before nothing: (rows, columns) bool."""
    edge = np.zeros(distance.shape, dtype=bool)
    for axis in (0, 1):
        for step in (1, -1):
            beside, other = np.roll(distance, step, axis), np.roll(nearest, step, axis)
            edge |= (nearest >= 0) & (nearest != other) & (beside - distance > 2e-3 * distance)
    return edge


def _draw_ground(
    picture: np.ndarray,
    eye: np.ndarray,
    rays: np.ndarray,
    nearest: np.ndarray,
    light: np.ndarray,
    bodies: list[Capsule],
    height: float,
) -> None:
    """Draw the ground where no body is, as a veil that fades with the distance from the bodies' middle."""
    middle = np.mean([(body.start + body.end) / 2 for body in bodies], axis=0) if bodies else np.zeros(3)
    with np.errstate(divide="ignore"):
        met = (height - eye[2]) / rays[..., 2]
    seen = (nearest < 0) & (met > 0)
    points = eye + met[seen][:, None] * rays[seen]
    size = float(np.linalg.norm(eye - middle)) / 5.0
    fade = np.exp(-((np.linalg.norm(points[:, :2] - middle[:2], axis=1) / size) ** 2) * 1.1)
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    dark = 1 - _openness(points, up, light, bodies)
    picture[seen, :3] = np.outer(1 - np.minimum(1.6 * dark, 0.85), [0.55, 0.58, 0.62])
    picture[seen, 3] = fade * (0.30 + 0.45 * dark)
