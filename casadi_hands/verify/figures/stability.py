"""How stiff must the joints be for the planned grasp to hold itself?

Motors are springs. Where contacts roll, the object's twist and the joints' steps z = (v, ω, q') are bound by A z = 0,
A = [Gᵀ, -J], Z its null space. Along it the springs K pull back, and the contact forces f do what they do when points
roll and levers turn: the grasp holds itself where the symmetric part of

    Zᵀ_q K Z_q + Zᵀ_t K_t Z_t - d/ds (Zᵀ A(x(s))ᵀ f)

is positive definite (the grasp stiffness of Cutkosky and Kao, 1989, with its geometric part). K_t is the torsional
friction of soft fingertips: what is left of it, over the `TWIST` that uses it up. A at x(s) is measured: object and
joints are moved along Z, and contact points are the closest points there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

from casadi_hands.verify.figures.closest import closest_to_capsule, level_directions, lowest_points
from casadi_hands.verify.figures.mount import Mount
from casadi_hands.verify.figures.torsion import most_torsion, tip_radius
from casadi_hands.verify.held import held
from casadi_hands.verify.reading.folder import Folder

STEP = 2e-3
"""rad, and of the object's half extent: by which the grasp is moved to see what its forces do."""
TWIST = np.deg2rad(5.0)
"""Angle of a contact's spin at which torsional friction has given all it has: it counts as a spring until then."""
RANK = 1e-6
"""Of the largest singular value: below it a motion is free."""


@dataclass(frozen=True)
class Placements:
    """``N`` placements of object and joints, in the palm's frame; each is near a sample of the motion.

    Attributes:
        sample: (N,).
        position: (N, 3) m, of the object.
        turn: (N, 3, 3) palm <- object.
        links: name -> (N, 3, 3) and (N, 3) m, palm <- link.
        jacobian: (N, 6, J): velocity of what is at the palm's origin, then angular velocity, for each joint.
    """

    sample: np.ndarray
    position: np.ndarray
    turn: np.ndarray
    links: dict[str, tuple[np.ndarray, np.ndarray]]
    jacobian: np.ndarray


@dataclass(frozen=True)
class Mode:
    """What the grasp needs at one sample.

    Attributes:
        stiffness: least stiffness of every joint with which it holds itself, N·m/rad; not above 0 where it needs none.
        tips: the same where every joint is as stiff as is good for one stiffness of the fingertips, N/m.
        twist: (6,) of the object in the motion that needs it: m and rad, palm frame.
        free: torque over angle (N·m/rad) with which the object moves on between fingers that stay; 0 where it cannot.
    """

    stiffness: float
    tips: float
    twist: np.ndarray
    free: float


class Stability:
    """The grasp of a folder at all of its samples."""

    def __init__(self, folder: Folder) -> None:
        """Take the plan as seen from the palm."""
        self.folder, motion = folder, folder.motion
        palm = Rotation.from_quat(motion.base_orientation, scalar_first=True).inv()
        turn = palm * Rotation.from_quat(motion.object_orientation, scalar_first=True)
        self.turn, self.position = turn.as_matrix(), palm.apply(motion.object_position - motion.base_position)
        self.up = palm.apply([0.0, 0.0, 1.0])
        joint = held(folder)
        self.mount = None if joint is None else Mount.of(folder, joint, palm)
        contacts = range(len(motion.contact_names))
        moments = np.zeros_like(motion.contact_force) if motion.contact_moment is None else motion.contact_moment
        self.forces, self.moments = (
            np.stack([palm.apply(values[:, c]) for c in contacts], axis=1) for values in (motion.contact_force, moments)
        )
        columns = np.array(motion.joint_names)
        fingers = [link.partition("_link")[0] for link in motion.contact_link]
        # The last link is what touches, so all joints of a finger move its contact.
        self.moves = np.array([[name.startswith(f"{finger}_") for name in columns] for finger in fingers])

    def placed(self, sample: np.ndarray, shift: np.ndarray, turn: np.ndarray, joints: np.ndarray) -> Placements:
        """Return samples (N,) with the object moved by (N, 3) m and turned by (N, 3) rad, and joints by (N, J) rad."""
        folder, data = self.folder, self.folder.model.createData()
        columns = folder.joint_columns()
        angles = folder.motion.joint_angles[sample] + joints
        names = {link for link in folder.motion.contact_link if link != "ground"}
        frames = {name: folder.model.getFrameId(name) for name in sorted(names)}
        links = {name: (np.empty((len(sample), 3, 3)), np.empty((len(sample), 3))) for name in frames}
        jacobian = np.empty((len(sample), 6, angles.shape[1]))
        configuration = pin.neutral(folder.model)
        for n, row in enumerate(angles):
            configuration[columns] = row
            whole = pin.computeJointJacobians(folder.model, data, configuration)
            jacobian[n] = np.reshape(whole, (6, -1))[:, columns]
            for name, frame in frames.items():
                place = pin.updateFramePlacement(folder.model, data, frame)
                links[name][0][n], links[name][1][n] = place.rotation, place.translation
        rotation = Rotation.from_rotvec(turn).as_matrix() @ self.turn[sample]
        return Placements(sample, self.position[sample] + shift, rotation, links, jacobian)

    def touch(self, placed: Placements, contact: int) -> tuple[np.ndarray, np.ndarray]:
        """Return a contact's points (N, 3) m and the object's outward normals (N, 3), palm frame, of placements."""
        folder, link = self.folder, self.folder.motion.contact_link[contact]
        points, normals = np.empty_like(placed.position), np.empty_like(placed.position)
        shapes = [folder.object.nearest(point) for point in folder.motion.contact_point_object[:, contact]]
        for shape in {id(shape): shape for shape in shapes}.values():
            rows = np.array([shapes[k] is shape for k in placed.sample])
            turn, position = placed.turn[rows], placed.position[rows]
            if link == "ground":
                up = self.up[placed.sample[rows]]
                seen = np.einsum("nji,nj->ni", turn, up)
                planned = folder.motion.contact_point_object[placed.sample[rows], contact]
                at, out = lowest_points(shape, seen, planned), -seen
            else:
                capsule, (axes, origin) = folder.links[link].capsules[0], placed.links[link]
                start, end = (
                    np.einsum("nji,nj->ni", turn, axes[rows] @ tip + origin[rows] - position)
                    for tip in (capsule.start, capsule.end)
                )
                at, out = closest_to_capsule(shape, start, end, capsule.radius)
            points[rows] = np.einsum("nij,nj->ni", turn, at) + position
            normals[rows] = np.einsum("nij,nj->ni", turn, out)
        return points, normals

    def exerted(self, placed: Placements) -> np.ndarray:
        """Return A(x)ᵀ f (N, 6 + J): wrench on the object and torques on the joints, of forces as in the plan."""
        motion = self.folder.motion
        total = np.zeros((len(placed.sample), 6 + placed.jacobian.shape[2]))
        for c in range(len(motion.contact_names)):
            acts = motion.contact_active[placed.sample, c][:, None]
            point, normal = self.touch(placed, c)
            force = acts * self.forces[placed.sample, c]
            planned = self.moments[placed.sample, c]
            reach = self.first[c][1][placed.sample]
            moment = acts * np.sum(planned * reach, axis=1, keepdims=True) * normal
            total[:, :3] += force
            total[:, 3:6] += np.cross(point - self._centre(placed.sample, placed.position), force) + moment
            pressed = np.einsum("nij,ni->nj", placed.jacobian[:, :3], force)
            turned = np.einsum("nij,ni->nj", placed.jacobian[:, 3:], np.cross(point, force) + moment)
            total[:, 6:] -= (pressed + turned) * self.moves[c]
        if self.mount is not None:
            total[:, :6] += self.mount.loaded(placed.sample, placed.position)
        return total

    def _centre(self, sample: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Return what twists are about, (N, 3) m, palm frame: the object's centre of mass, or a point of its joint."""
        return position if self.mount is None else self.mount.pivot[sample]

    @cached_property
    def planned(self) -> Placements:
        """The samples as they are."""
        count, joints = self.folder.motion.joint_angles.shape
        return self.placed(np.arange(count), np.zeros((count, 3)), np.zeros((count, 3)), np.zeros((count, joints)))

    @cached_property
    def first(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Points and normals of all contacts at the samples."""
        return [self.touch(self.planned, c) for c in range(len(self.folder.motion.contact_names))]

    def rows(self, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return at a sample A (n, 6 + J), how contacts spin (C, 6 + J), and how stiffly they resist that (C,)."""
        motion, jacobian = self.folder.motion, self.planned.jacobian[k]
        active = np.flatnonzero(motion.contact_active[k])
        grasp, spins, stiff = [], [], []
        centre = self._centre(np.array([k]), self.position[[k]])[0]
        if self.mount is not None:
            held_back = self.mount.held_back(k)
            grasp.append(np.hstack([held_back, np.zeros((len(held_back), jacobian.shape[1]))]))
        for c in active:
            point, normal = (values[k] for values in self.first[c])
            grasp.append(np.hstack([np.eye(3), -pin.skew(point - centre), -self._moved(k, int(c))]))
            spins.append(np.concatenate([np.zeros(3), normal, -(normal @ jacobian[3:]) * self.moves[c]]))
            stiff.append(self._left(k, int(c)) / TWIST)
            if motion.contact_link[c] == "ground":
                shape = self.folder.object.nearest(motion.contact_point_object[k, c])
                tips = level_directions(shape, self.turn[k].T @ self.up[k]) @ self.turn[k].T * self.folder.length
                grasp.append(np.hstack([np.zeros_like(tips), tips, np.zeros((len(tips), jacobian.shape[1]))]))
        return np.vstack(grasp), np.array(spins), np.array(stiff)

    def _moved(self, k: int, c: int) -> np.ndarray:
        """Return the Jacobian (3, J) of a contact's point at a sample, as a point of the link."""
        jacobian = self.planned.jacobian[k]
        moved: np.ndarray = (jacobian[:3] - pin.skew(self.first[c][0][k]) @ jacobian[3:]) * self.moves[c]
        return moved

    def _left(self, k: int, c: int) -> float:
        """Return what is left of a contact's torsional friction, N·m."""
        normal = self.first[c][1][k]
        most = tip_radius(self.folder, c) * most_torsion(self.forces[k, c], normal, self.folder.friction(c))
        return max(most - abs(float(self.moments[k, c] @ normal)), 0.0)

    def modes(self) -> list[Mode]:
        """Return what the grasp needs at every sample."""
        motion, length = self.folder.motion, self.folder.length
        count, joints = motion.joint_angles.shape
        scale = np.concatenate([np.full(3, length), np.ones(3 + joints)])
        still = Mode(0.0, 0.0, np.zeros(6), 0.0)
        spaces, rows = [], []
        for k in range(count):
            if not motion.contact_active[k].any():
                spaces.append(np.zeros((6 + joints, 0)))
                rows.append((np.zeros((0, 6 + joints)), np.zeros(0)))
                continue
            grasp, spins, stiff = self.rows(k)
            _, sizes, right = np.linalg.svd(grasp * scale / length)
            spaces.append(scale[:, None] * right[int(np.sum(sizes > RANK * sizes[0])) :].T)
            rows.append((spins, stiff))
        sample = np.repeat(np.arange(count), [space.shape[1] for space in spaces])
        if not len(sample):
            return [still] * count
        ways = STEP * np.hstack(spaces).T
        arms = self.position[sample] - self._centre(sample, self.position[sample])
        shifts = ways[:, :3] + np.cross(ways[:, 3:6], arms) if self.mount is not None else ways[:, :3]
        there, back = (
            self.exerted(self.placed(sample, sign * shifts, sign * ways[:, 3:6], sign * ways[:, 6:]))
            for sign in (1.0, -1.0)
        )
        change = (there - back) / (2 * STEP)
        found = []
        for k, (space, (spins, stiff)) in enumerate(zip(spaces, rows, strict=True)):
            if not space.shape[1]:
                found.append(still)
                continue
            destabilising = space.T @ change[sample == k].T
            twisted = spins @ space
            needed = 0.5 * (destabilising + destabilising.T) - twisted.T @ (stiff[:, None] * twisted)
            if self.mount is not None:
                needed -= self.mount.sprung(k, space[:6])
            found.append(self._mode(k, space, needed))
        return found

    def _mode(self, k: int, space: np.ndarray, needed: np.ndarray) -> Mode:
        """Return what springs must make up for (d, d) along a null space (6 + J, d) at a sample."""
        moved = space[6:]
        free, springy = _split(moved.T @ moved)
        alone = 0.0
        if free.shape[1]:
            turned = space[3:6] @ free
            sizes = turned.T @ turned + RANK * np.eye(free.shape[1])  # of what only shifts the object nothing is asked
            alone = float(eigh(free.T @ needed @ free, sizes, eigvals_only=True)[-1])
        stiffness, way = _least(moved, needed, springy)
        levers = self._levers(k)
        tips, _ = _least(np.sqrt(levers)[:, None] * moved, needed, springy)
        return Mode(stiffness, tips, (space @ way)[:6], alone)

    def _levers(self, k: int) -> np.ndarray:
        """Return the square (J,), m², of each joint's lever at its finger's contact; of others' that of the longest."""
        levers = np.zeros(self.planned.jacobian.shape[2])
        for c in np.flatnonzero(self.folder.motion.contact_active[k]):
            levers = np.maximum(levers, np.sum(self._moved(k, int(c)) ** 2, axis=0))
        return np.where(levers > 0.0, levers, max(float(levers.max(initial=0.0)), 1e-12))


def _split(springs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return bases (d, a) and (d, b) of what moves no spring of (d, d), and of the rest."""
    values, vectors = np.linalg.eigh(springs)
    free = values < 1e-8 * max(float(values[-1]), 1e-300)
    return vectors[:, free], vectors[:, ~free]


def _least(moved: np.ndarray, needed: np.ndarray, springy: np.ndarray) -> tuple[float, np.ndarray]:
    """Return the least k with which k ``moved``ᵀ ``moved`` outweighs what is ``needed`` (d, d), and the motion (d,).

    That which asks for most, of those in ``springy`` (d, b).
    """
    if not springy.shape[1]:
        return 0.0, np.zeros(len(needed))
    values, vectors = np.linalg.eigh(springy.T @ moved.T @ moved @ springy)
    unit = springy @ (vectors / np.sqrt(np.maximum(values, 1e-300)))
    asked, ways = np.linalg.eigh(unit.T @ needed @ unit)
    return float(asked[-1]), unit @ ways[:, -1]
