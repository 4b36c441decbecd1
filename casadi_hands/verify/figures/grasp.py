"""The planned grasp as its files have it: where fingers and ground touch the object, and what their forces do.

Object and joints are moved a little, and contact points are the closest points there. Where a link lies along the
object, as on a face, nearest points are anywhere on a line: its contact stays where it is planned, and it does not tip.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from casadi_hands.verify.figures.closest import closest_to_capsule, level_directions, lowest_points
from casadi_hands.verify.figures.mount import Mount
from casadi_hands.verify.figures.torsion import most_torsion, tip_radius
from casadi_hands.verify.held import held
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.shapes import Shape

TWIST = np.deg2rad(5.0)
"""Angle of a contact's spin at which torsional friction has given all it has: it counts as a spring until then."""
ALONG = 2.5e-3
"""rad: a link lies along a surface if both are turned less from each other, over the link's radius, too."""
NEARBY, WIDE = 0.1, 0.5
"""Of the link's radius: on one side of a contact, so that the link lies there; on both, so that it cannot tip."""


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
class Lying:
    """Contacts of links that lie along the object.

    Attributes:
        at_all: (S, C): near the contact, on one side at least; the contact is where the plan has it.
        flat: (S, C): far enough on both sides for the link not to tip.
    """

    at_all: np.ndarray
    flat: np.ndarray


class Grasp:
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
                level = self.level[placed.sample[rows], contact]
                at, out = lowest_points(shape, seen, planned, level), -seen
            else:
                start, end = (each[rows] for each in self._axis(placed, contact))
                lies, share = (each[placed.sample[rows], contact][:, None] for each in (self.lying.at_all, self.share))
                there = start + share * (end - start)
                start, end = np.where(lies, there, start), np.where(lies, there, end)
                at, out = closest_to_capsule(shape, start, end, folder.links[link].capsules[0].radius)
            points[rows] = np.einsum("nij,nj->ni", turn, at) + position
            normals[rows] = np.einsum("nij,nj->ni", turn, out)
        return points, normals

    def _axis(self, placed: Placements, contact: int) -> tuple[np.ndarray, np.ndarray]:
        """Return both ends (N, 3) of the axis of a contact's link in placements, m, the object's frame."""
        link = self.folder.motion.contact_link[contact]
        capsule, (axes, origin) = self.folder.links[link].capsules[0], placed.links[link]
        start, end = (
            np.einsum("nji,nj->ni", placed.turn, axes @ tip + origin - placed.position)
            for tip in (capsule.start, capsule.end)
        )
        return start, end

    @cached_property
    def tips(self) -> dict[tuple[int, int], np.ndarray]:
        """Directions (n, 3), palm frame, about which the object cannot tip on the ground, by sample and contact."""
        motion, found = self.folder.motion, {}
        for c in np.flatnonzero(np.array(motion.contact_link) == "ground"):
            for k in np.flatnonzero(motion.contact_active[:, c]):
                shape = self.folder.object.nearest(motion.contact_point_object[k, c])
                found[int(k), int(c)] = level_directions(shape, self.turn[k].T @ self.up[k]) @ self.turn[k].T
        return found

    @cached_property
    def level(self) -> np.ndarray:
        """Where (S, C) the object stands on a line or a face in the plan."""
        found = np.zeros(self.folder.motion.contact_active.shape, bool)
        for place, directions in self.tips.items():
            found[place] = len(directions) > 0
        return found

    @cached_property
    def share(self) -> np.ndarray:
        """How far along its link's axis (S, C) each contact is in the plan, 0 to 1."""
        motion = self.folder.motion
        found = np.zeros(motion.contact_active.shape)
        for c, link in enumerate(motion.contact_link):
            if link != "ground":
                capsule = self.folder.links[link].capsules[0]
                along = capsule.end - capsule.start
                found[:, c] = (motion.contact_point_link[:, c] - capsule.start) @ along / max(along @ along, 1e-300)
        return np.clip(found, 0.0, 1.0)

    @cached_property
    def lying(self) -> Lying:
        """Which contacts are of links that lie along the object, as on its faces."""
        folder, motion = self.folder, self.folder.motion
        at_all, flat = np.zeros((2, *motion.contact_active.shape), bool)
        for c, link in enumerate(motion.contact_link):
            if link == "ground":
                continue
            start, end = self._axis(self.planned, c)
            capsule = folder.links[link].capsules[0]
            for k in np.flatnonzero(motion.contact_active[:, c]):
                shape = folder.object.nearest(motion.contact_point_object[k, c])
                near, wide = (
                    straight(shape, start[k], end[k], self.share[k, c], step * capsule.radius, capsule.radius)
                    for step in (NEARBY, WIDE)
                )
                at_all[k, c], flat[k, c] = any(near), all(wide)
        return Lying(at_all, flat)

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

    def rows(self, k: int, sticks: bool = True) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return at a sample A (n, 6 + J), how contacts spin (C, 6 + J), and how stiffly they resist that (C,).

        Args:
            k: the sample.
            sticks: whether the object rolls on the ground, and does not tip on its lines and faces; or else slides and
                rocks on it.
        """
        motion, jacobian = self.folder.motion, self.planned.jacobian[k]
        active = np.flatnonzero(motion.contact_active[k])
        grasp, spins, stiff = [], [], []
        centre = self._centre(np.array([k]), self.position[[k]])[0]
        if self.mount is not None:
            held_back = self.mount.held_back(k)
            grasp.append(np.hstack([held_back, np.zeros((len(held_back), jacobian.shape[1]))]))
        for c in active:
            point, normal = (values[k] for values in self.first[c])
            slips = motion.contact_link[c] == "ground" and not sticks
            ways = normal[None] if slips else np.eye(3)
            grasp.append(ways @ np.hstack([np.eye(3), -pin.skew(point - centre), -self._moved(k, int(c))]))
            spins.append(np.concatenate([np.zeros(3), normal, -(normal @ jacobian[3:]) * self.moves[c]]))
            stiff.append(self._left(k, int(c)) / TWIST)
            if self.lying.flat[k, c]:
                link = self.planned.links[motion.contact_link[c]][0][k]
                capsule = self.folder.links[motion.contact_link[c]].capsules[0]
                across = np.cross(normal, link @ (capsule.end - capsule.start))
                across *= self.folder.length / max(float(np.linalg.norm(across)), 1e-300)
                grasp.append(np.concatenate([np.zeros(3), across, -(across @ jacobian[3:]) * self.moves[c]])[None])
            if motion.contact_link[c] == "ground" and sticks:
                tips = self.tips[k, int(c)] * self.folder.length
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


def straight(
    shape: Shape, start: np.ndarray, end: np.ndarray, share: float, step: float, radius: float
) -> tuple[bool, bool]:
    """Return on which sides of a point of an axis, before and after it, a shape's surface goes along it for a step.

    Args:
        shape: in its own frame.
        start: (3,) of the axis, m, that frame.
        end: (3,), likewise.
        share: of the way, where the point is.
        step: m; a side counts where at least half of it is on the axis.
        radius: of the link, m.
    """
    length = float(np.linalg.norm(end - start))
    if length == 0.0:
        return False, False
    found = []
    for sign in (-1.0, 1.0):
        there = min(max(share + sign * step / length, 0.0), 1.0)
        run = abs(there - share) * length
        places = np.array([share, 0.5 * (share + there), there])
        here, half, beyond = shape.distance(start + places[:, None] * (end - start))
        # A tilt of the link by so much carries the nearest point farther than its radius.
        bends = abs(here - 2.0 * half + beyond) > ALONG / radius * run**2 / 4.0
        found.append(bool(run >= 0.5 * step and abs(beyond - here) < ALONG * run and not bends))
    return found[0], found[1]
