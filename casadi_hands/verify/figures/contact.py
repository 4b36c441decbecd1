"""Are the contacts where the file says, do they hold still, and can friction bear their forces?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.verify.bodies import body_distance
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.report import Figure, worse
from casadi_hands.verify.trajectory import DENSITY, Trajectory

Placements = dict[str, tuple[np.ndarray, np.ndarray]]


def active_contacts(folder: Folder) -> Iterator[tuple[int, int]]:
    """Yield (sample, contact) for every contact that is active at a sample."""
    yield from ((int(k), int(c)) for k, c in np.argwhere(folder.motion.contact_active))


def active_runs(folder: Folder, path: Trajectory, contact: int) -> list[tuple[int, int]]:
    """Return (first, last) samples of every stretch from touch to lift; active from first until last.

    A contact that lets go and stays where it was has not been lifted, however short or long that is.
    """
    active = folder.motion.contact_active[:, contact].astype(int)
    edges = np.diff(np.concatenate([[0], active, [0]]))
    end = len(folder.motion.time) - 1
    runs: list[tuple[int, int]] = []
    for first, last in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
        run = int(first), min(int(last), end)
        if runs and not _parts(folder, path, contact, runs[-1][1], run[0]):
            run = runs.pop()[0], run[1]
        runs.append(run)
    return runs


def _parts(folder: Folder, path: Trajectory, contact: int, lift: int, touch: int) -> bool:
    """Whether the bodies of a contact are apart at some moment between two samples."""
    link, other = folder.motion.contact_link[contact], folder.partner(contact)
    middle = (lift + touch) * DENSITY // 2
    # It is most likely halfway.
    moments = sorted(range(lift * DENSITY, touch * DENSITY), key=lambda i: abs(i - middle))
    return any(
        body_distance(folder.object, path.at("object", i), other, path.at(link, i)) > folder.task.limits.gap
        for i in moments
    )


def surface_normals(folder: Folder, placed: Placements, k: int, c: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the outward unit normals (3,), (3,) of object and link at a stored contact, world."""
    motion = folder.motion
    on_object = folder.object.normal(motion.contact_point_object[k, c])
    on_link = folder.partner(c).normal(motion.contact_point_link[k, c])
    return placed["object"][0][k] @ on_object, placed[motion.contact_link[c]][0][k] @ on_link


def friction_figures(folder: Folder, placed: Placements) -> list[Figure]:
    """Return friction excess and pull over the weight, and the share of friction in use, on either surface."""
    excess = (-np.inf, "no contact is active")
    pull = (-np.inf, "no contact is active")
    use = (0.0, "no contact is active")
    for scenario, forces, rows in folder.scenarios():
        for k, c in active_contacts(folder):
            if not rows[k]:
                continue
            force, friction = forces[k, c], folder.friction(c)
            on_object, on_link = surface_normals(folder, placed, k, c)
            for side, into_object in (("object", -on_object), ("finger", on_link)):
                normal = float(force @ into_object)
                tangential = float(np.linalg.norm(force - normal * into_object))
                contact = f"at contact '{folder.motion.contact_names[c]}' at {folder.motion.time[k]:.3g} s"
                at = f"{contact}, {side}'s surface{scenario}"
                over = (tangential - friction * max(normal, 0.0)) / folder.weight
                excess = worse(excess, (over, f"tangential force exceeds friction by {{value}} {at}"))
                pull = worse(pull, (-normal / folder.weight, f"the object is pulled with {{value}} {at}"))
                if tangential > 0.0:
                    share = tangential / (friction * normal) if normal > 0.0 else np.inf
                    use = worse(use, (share, f"{{value}} of the friction is in use {at}"))
    limits = folder.task.limits
    return [
        Figure("friction_excess", excess[0], limits.friction_excess, "weight", excess[1]),
        Figure("friction_use", use[0], None, "share", use[1]),
        Figure("pull", pull[0], limits.pull, "weight", pull[1]),
    ]


def gap_at_samples(folder: Folder, placed: Placements) -> Figure:
    """Return how far a contact is from being one: stored points off the surfaces or apart, or bodies apart, m."""
    motion = folder.motion
    worst = (0.0, "no contact is active")
    for k, c in active_contacts(folder):
        link, on_object, on_link = (
            motion.contact_link[c],
            motion.contact_point_object[k, c],
            motion.contact_point_link[k, c],
        )
        rotation, position = placed["object"][0][k], placed["object"][1][k]
        link_placed = placed[link][0][k], placed[link][1][k]
        apart = float(np.linalg.norm(rotation @ on_object + position - link_placed[0] @ on_link - link_placed[1]))
        other = folder.partner(c)
        cases = (
            (abs(folder.object.surface_distance(on_object)), "is {value} off the object's surface"),
            (abs(other.surface_distance(on_link)), f"is {{value}} off the surface of {folder.call(link)}"),
            (apart, f"is at two places {{value}} apart on the object and on {folder.call(link)}"),
            (body_distance(folder.object, (rotation, position), other, link_placed), "has a gap of {value}"),
        )
        for value, words in cases:
            worst = worse(worst, (value, f"contact '{motion.contact_names[c]}' {words} at {motion.time[k]:.3g} s"))
    return Figure("gap", worst[0], folder.task.limits.gap, "m", worst[1])


def gap_between_samples(folder: Folder, path: Trajectory) -> Figure:
    """Return the largest distance of the two bodies of a contact while it is active, between samples too, m."""
    motion = folder.motion
    worst = (0.0, "no contact opens between samples")
    gaps = np.zeros(len(motion.time) - 1)
    for c, name in enumerate(motion.contact_names):
        link = motion.contact_link[c]
        other = folder.partner(c)
        for i in map(int, np.flatnonzero(motion.contact_active[path.interval, c])):
            if i % DENSITY == 0:
                continue
            distance = body_distance(folder.object, path.at("object", i), other, path.at(link, i))
            gaps[path.interval[i]] = max(gaps[path.interval[i]], distance)
            worst = worse(worst, (distance, f"contact '{name}' has a gap of {{value}} at {path.time[i]:.4g} s"))
    return Figure("gap_between", worst[0], folder.task.limits.gap_between, "m", worst[1], by_interval=gaps)


def slip_figure(folder: Folder, path: Trajectory) -> Figure:
    """Return the longest way that object and link slide over each other in one contact interval, m.

    A contact that rolls travels equally far on both surfaces. How much farther it travels on one is the tangential
    motion between the two material points that touch, summed over the interval: object and link each carry the contact
    point of every short dense step rigidly from the step's start to its end, and the difference is slip.
    """
    motion = folder.motion
    worst = (0.0, "no contact slips")
    runs = [np.zeros(len(motion.time) - 1)]
    for c, name in enumerate(motion.contact_names):
        steps = _slip_steps(folder, path, c)
        for first, last in active_runs(folder, path, c):
            slip = float(np.sum(steps[first:last]))
            words = f"contact '{name}' slips {{value}} between {motion.time[first]:.3g} s and {motion.time[last]:.3g} s"
            worst = worse(worst, (slip, words))
            runs.append(np.zeros_like(steps))
            runs[-1][first:last] = steps[first:last]
    return Figure("slip", worst[0], folder.task.limits.slip, "m", worst[1], by_interval=np.array(runs))


def spin_figure(folder: Folder, path: Trajectory) -> Figure:
    """Return the largest turn of object against link about a contact's normal in one contact interval, deg.

    Point contacts allow it; a soft fingertip does not quite, so it is the first thing a real motion gets wrong.
    """
    motion = folder.motion
    worst = (0.0, "no contact spins about its normal")
    for c, name in enumerate(motion.contact_names):
        rotation, _ = path.placed["object"]
        relative = Rotation.from_matrix(rotation).inv() * Rotation.from_matrix(path.placed[motion.contact_link[c]][0])
        turns = (relative[:-1] * relative[1:].inv()).as_rotvec()
        for first, last in active_runs(folder, path, c):
            inside = range(first * DENSITY, last * DENSITY)
            spun = [float(turns[i] @ folder.object.normal(_contact_point(folder, path, c, i)[0])) for i in inside]
            angle = float(np.rad2deg(np.max(np.abs(np.cumsum(spun)), initial=0.0)))
            words = f"contact '{name}' spins {{value}} about its normal between {motion.time[first]:.3g} s and"
            worst = worse(worst, (angle, f"{words} {motion.time[last]:.3g} s"))
    return Figure("spin", worst[0], None, "deg", worst[1])


def _contact_point(folder: Folder, path: Trajectory, contact: int, i: int) -> tuple[np.ndarray, int]:
    """Return the contact on the object's surface at dense time ``i``, object frame (3,), and its interval."""
    k = int(path.interval[i])
    time = folder.motion.time
    fraction = (path.time[i] - time[k]) / (time[k + 1] - time[k])
    chord = (1 - fraction) * folder.motion.contact_point_object[k, contact]
    return folder.object.project(chord + fraction * folder.motion.contact_point_object[k + 1, contact]), k


def _slip_steps(folder: Folder, path: Trajectory, contact: int) -> np.ndarray:
    """Return the slip of one contact from each sample to the next, (S - 1,) m, whether active or not."""
    slip = np.zeros(len(folder.motion.time) - 1)
    for k, moved in slides(folder, path, contact):
        slip[k] += float(np.linalg.norm(moved))
    return slip


def slides(folder: Folder, path: Trajectory, contact: int) -> Iterator[tuple[int, np.ndarray]]:
    """Yield, of every dense step, its interval and how far (3,) m, world, the object slides over the other body."""
    link = folder.motion.contact_link[contact]
    # Every other dense time is the middle of a step; taking the contact point there cancels second-order errors.
    for middle in range(1, len(path.time) - 1, 2):
        point, k = _contact_point(folder, path, contact, middle)
        rotation, position = path.at("object", middle)
        world = rotation @ point + position
        moved = _carried(path, "object", world, middle) - _carried(path, link, world, middle)
        normal = rotation @ folder.object.normal(point)
        yield k, moved - (moved @ normal) * normal


def _carried(path: Trajectory, body: str, world: np.ndarray, middle: int) -> np.ndarray:
    """Return by how much (3,) the body carries the material point at ``world`` over the step around ``middle``."""
    rotation, position = path.at(body, middle)
    local = rotation.T @ (world - position)
    before, after = path.at(body, middle - 1), path.at(body, middle + 1)
    moved: np.ndarray = (after[0] - before[0]) @ local + after[1] - before[1]
    return moved
