"""What the structure bears: forces and moments on bearings, stress in links, and how far fingers bend.

Statics at every sample: contacts push back on their links, and links have their weight. A link is a round bar from its
joint to the next one, or to its tip; the largest stress at a section is von Mises', of the axial force and the bending
moment on one side of the bar, and of torsion: √(σ² + 3 τ²), σ = N/(π r²) + 4 M/(π r³), τ = 2 T/(π r³). The tip bends
away as the curvatures M/(E I), T/(G J) and the strain N/(E A) along all links add up (Euler and Bernoulli), the joints
held and the palm still. Left out: what tendons pull, what it takes to accelerate links, and shear of short bars.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from casadi_hands.verify.figures.contact import Placements
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.report import Figure, worse

POISSON = 0.35
"""Of plastics (0.33 of aluminium): the shear modulus is E / (2 (1 + this))."""


@dataclass(frozen=True)
class Bar:
    """A link as a round bar, at ``S`` samples, world frame.

    Attributes:
        link, joint: their names.
        root, tip: (S, 3) m.
        along: (S, 3) unit vector from root to tip; zero where it has no length.
        axis: (S, 3) unit vector of the joint at its root.
        length, radius: m.
    """

    link: str
    joint: str
    root: np.ndarray
    tip: np.ndarray
    along: np.ndarray
    axis: np.ndarray
    length: float
    radius: float

    def stress(self, force: np.ndarray, moment: np.ndarray) -> np.ndarray:
        """Return von Mises' stress (S,), Pa, at a section that bears a force (S, 3), N, and a moment (S, 3), N·m."""
        pulled, twist = (np.abs(np.sum(load * self.along, axis=1)) for load in (force, moment))
        bent = np.linalg.norm(moment - np.sum(moment * self.along, axis=1)[:, None] * self.along, axis=1)
        cube = np.pi * self.radius**3
        normal = pulled * self.radius / cube + 4 * bent / cube
        stress: np.ndarray = np.hypot(normal, np.sqrt(3) * 2 * twist / cube)
        return stress

    def curvature(self, force: np.ndarray, moment: np.ndarray, stiffness: float) -> tuple[np.ndarray, np.ndarray]:
        """Return how a section turns, rad/m, and stretches along the bar, per m: (S, 3) each.

        Args:
            force: (S, 3) N.
            moment: (S, 3) N·m.
            stiffness: Young's modulus, Pa.
        """
        area, inertia = np.pi * self.radius**2, np.pi * self.radius**4 / 4
        pulled, twist = (np.sum(load * self.along, axis=1)[:, None] * self.along for load in (force, moment))
        turn = (moment - twist) / (stiffness * inertia) + twist * (1 + POISSON) / (stiffness * inertia)
        return turn, pulled / (stiffness * area)


@dataclass(frozen=True)
class Load:
    """What acts on a bar at a point.

    Attributes:
        bar: its index in the finger.
        point: (S, 3) m, world.
        force: (S, 3) N.
        moment: (S, 3) N·m.
        station: (S,) m from the bar's root along it, within it.
    """

    bar: int
    point: np.ndarray
    force: np.ndarray
    moment: np.ndarray
    station: np.ndarray


def structure_figures(folder: Folder, placed: Placements) -> list[Figure]:
    """Return the largest force and moment on a bearing, stress in a link and deflection of a tip, over the motion."""
    limits, time = folder.task.limits, folder.motion.time
    force, moment, stress, bent = ((0.0, "nothing loads the hand") for _ in range(4))
    for scenario, forces, rows in folder.scenarios():
        if not rows.any():
            continue
        for bars in finger_bars(folder, placed):
            loads = finger_loads(folder, placed, bars, forces)
            for i, bar in enumerate(bars):
                pushed, turned = bearing_loads(bars, loads, i)
                for value, words in ((pushed, "is pushed with"), (turned, "is bent across its axis with")):
                    k = _largest(value, rows)
                    where = f"at {time[k]:.3g} s{scenario}"
                    found = float(value[k]), f"the bearing of joint {bar.joint} {words} {{value}} {where}"
                    if value is pushed:
                        force = worse(force, found)
                    else:
                        moment = worse(moment, found)
                values = link_stress(bars, loads, i)
                k = _largest(values, rows)
                words = f"{folder.call(bar.link)} has a stress of {{value}} at {time[k]:.3g} s{scenario}"
                stress = worse(stress, (float(values[k]), words))
            values = np.linalg.norm(tip_deflection(bars, loads, folder.task.hand.material.stiffness), axis=1)
            k = _largest(values, rows)
            words = f"the end of {folder.call(bars[-1].link)} bends away by {{value}} at {time[k]:.3g} s{scenario}"
            bent = worse(bent, (float(values[k]), words))
    return [
        Figure("bearing_force", force[0], limits.bearing_force, "N", force[1]),
        Figure("bearing_moment", moment[0], limits.bearing_moment, "N·m", moment[1]),
        Figure("link_stress", stress[0], limits.link_stress, "Pa", stress[1]),
        Figure("tip_deflection", bent[0], limits.tip_deflection, "m", bent[1]),
    ]


def _largest(values: np.ndarray, rows: np.ndarray) -> int:
    """Return the sample (of those in ``rows``) with the largest of (S,) values."""
    return int(np.argmax(np.where(rows, values, -np.inf)))


def finger_bars(folder: Folder, placed: Placements) -> Iterator[list[Bar]]:
    """Yield the bars of each finger, from the palm outwards; of one that forks, those up to each end."""
    hung = {joint.child: joint for joint in folder.joints.values()}
    parents = {joint.parent for joint in folder.joints.values()}
    for end in folder.links:
        if end == "palm" or end in parents:
            continue
        names = [end]
        while hung[names[0]].parent != "palm":
            names.insert(0, hung[names[0]].parent)
        bars = []
        for name, following in zip(names, [*names[1:], None], strict=True):
            rotation, root = placed[name]
            shape = folder.links[name].capsules
            end_point = hung[following].position if following else shape[0].end if shape else np.zeros(3)
            length = float(np.linalg.norm(end_point))
            along = rotation @ (end_point / length if length else end_point)
            axis = hung[name].axis / np.linalg.norm(hung[name].axis)
            radius = shape[0].radius if shape else folder.task.hand.link_radius
            tip = root + rotation @ end_point
            bars.append(Bar(name, hung[name].name, root, tip, along, rotation @ axis, length, radius))
        yield bars


def finger_loads(folder: Folder, placed: Placements, bars: list[Bar], forces: np.ndarray) -> list[Load]:
    """Return what loads a finger: its contacts, pressed with ``forces`` (S, C, 3) on the object, N, and its weight."""
    motion, loads = folder.motion, []
    moments = np.zeros_like(forces) if motion.contact_moment is None else motion.contact_moment
    index = {bar.link: i for i, bar in enumerate(bars)}

    def load(i: int, local: np.ndarray, force: np.ndarray, moment: np.ndarray) -> Load:
        rotation, position = placed[bars[i].link]
        point = np.einsum("sij,sj->si", rotation, np.broadcast_to(local, position.shape)) + position
        station = np.clip(np.sum((point - bars[i].root) * bars[i].along, axis=1), 0.0, bars[i].length)
        return Load(i, point, force, moment, station)

    for c, link in enumerate(motion.contact_link):
        if link in index:
            acts = motion.contact_active[:, c, None].astype(float)
            pushed = -acts * forces[:, c], -acts * moments[:, c]
            loads.append(load(index[link], motion.contact_point_link[:, c], *pushed))
    for i, bar in enumerate(bars):
        body = folder.links[bar.link]
        weight = np.tile(body.mass * folder.gravity, (len(motion.time), 1))
        loads.append(load(i, body.center_of_mass, weight, np.zeros_like(weight)))
    return loads


def beyond(loads: list[Load], i: int, station: np.ndarray | float, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return force (S, 3), N, and moment (S, 3), N·m, about points, of all that acts on a finger beyond a section.

    Args:
        loads: of the finger.
        i: the bar with the section.
        station: (S,) m from the bar's root, of the section; what acts there counts.
        at: (S, 3) m, the points.
    """
    force, moment = np.zeros_like(at), np.zeros_like(at)
    for load in loads:
        if load.bar < i:
            continue
        counts = np.ones(len(at)) if load.bar > i else (load.station >= station).astype(float)
        force += counts[:, None] * load.force
        moment += counts[:, None] * (np.cross(load.point - at, load.force) + load.moment)
    return force, moment


def bearing_loads(bars: list[Bar], loads: list[Load], i: int) -> tuple[np.ndarray, np.ndarray]:
    """Return force (S,), N, and moment across the axis (S,), N·m, that the bearing at the root of a bar bears."""
    force, moment = beyond(loads, i, 0.0, bars[i].root)
    across = moment - np.sum(moment * bars[i].axis, axis=1)[:, None] * bars[i].axis
    return np.linalg.norm(force, axis=1), np.linalg.norm(across, axis=1)


def link_stress(bars: list[Bar], loads: list[Load], i: int) -> np.ndarray:
    """Return the largest stress (S,), Pa, anywhere along a bar.

    Between loads moments are linear along it, and the stress is a convex function of them: largest at an end.
    """
    bar = bars[i]
    worst = bar.stress(*beyond(loads, i, 0.0, bar.root))
    for first, last in _pieces(bar, loads, i):
        for station in (first, last):
            at = bar.root + station[:, None] * bar.along
            worst = np.maximum(worst, bar.stress(*beyond(loads, i, 0.5 * (first + last), at)))
    return worst


def tip_deflection(bars: list[Bar], loads: list[Load], stiffness: float) -> np.ndarray:
    """Return how a finger's end moves (S, 3), m, world, as its bars bend, twist and stretch.

    Args:
        bars: of the finger.
        loads: on it.
        stiffness: Young's modulus, Pa.
    """
    end, moved = bars[-1].tip, np.zeros_like(bars[-1].tip)
    for i, bar in enumerate(bars):
        for first, last in _pieces(bar, loads, i):
            half = 0.5 * (last - first)
            for node in (-1.0, 1.0):  # Gauss's two points: exact, as curvature and arm are linear between loads
                at = bar.root + (first + half * (1 + node / np.sqrt(3)))[:, None] * bar.along
                turn, stretch = bar.curvature(*beyond(loads, i, 0.5 * (first + last), at), stiffness)
                moved = moved + half[:, None] * (np.cross(turn, end - at) + stretch)
    return moved


def _pieces(bar: Bar, loads: list[Load], i: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield (S,) stations, m, between which nothing acts on a bar."""
    samples = len(bar.root)
    within = [load.station for load in loads if load.bar == i]
    stations = np.sort([np.zeros(samples), *within, np.full(samples, bar.length)], axis=0)
    yield from pairwise(stations)
