"""What a refine problem is solved with: bounds, parameters, and the values that it starts from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from casadi_hands.geometry.bodies import Body, packed
from casadi_hands.kinematics.singularity import LEAST_MARGIN, MARGIN_SIZES, margin_directions
from casadi_hands.kinematics.symbols import morphology_sizes
from casadi_hands.motion import continuous
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.problem.placement import contact_jacobians, contact_spins
from casadi_hands.stages.object_motion.values import landing_bounds, most_turn, tool_path
from casadi_hands.stages.own_terms import own_values
from casadi_hands.stages.refine import attached, faces
from casadi_hands.stages.refine.coupling import start as coupling_start
from casadi_hands.stages.refine.declaration import HOLDING
from casadi_hands.stages.refine.initial_guess import along_joint, balanced, disturbance_wrenches, rates_and_wrenches
from casadi_hands.stages.refine.problem import RefineProblem
from casadi_hands.stages.refine.settings import SHARP
from casadi_hands.stages.refine.sliding import SLIP_SCALE, WHOLE
from casadi_hands.stages.refine.sliding import start as sliding_start
from casadi_hands.stages.refine.touching import force_ramp, longest_run, resting, runs

Array = NDArray[np.float64]
TOOL_TOLERANCE = 5e-3  # lengths, how far a drawing's tool may leave its path between goals
LIFTING_TIE = 2.0  # of a contact to where it was planned, where it lets go in order to touch elsewhere
SLIDING_TIE = 0.3  # of a contact to where it was planned to slide; it shall roll if it can
RESTING = 0.03  # lengths/s and rad/s at most, of an object that is planned to rest
RESTING_GRIP = 2.5  # times the lower bound on normal forces then, as torsion alone holds the object
ROUGHLY = 10.0  # times of what no joint may supply at knots may be so between them, where motions are interpolated
Bounds = dict[str, tuple[ArrayLike, ArrayLike]]


@dataclass(frozen=True)
class Margin:
    """How far inside its limits a motion must stay; exact motions can still balance on a fingertip.

    Attributes:
        friction: share of μ that may be used.
        normal_force: least normal force of an active contact, m·g.
        structural: largest component of a force that no joint actuates, m·g.
    """

    friction: float = 0.5
    normal_force: float = 1.0
    structural: float = 0.0075


class RefineValues:
    """The numbers of one structure's problem, for any motion to start from and any margin.

    Args:
        built: the problem.
        model: the task that it was built for, or one that differs in its goals only.
    """

    def __init__(self, built: RefineProblem, model: Model) -> None:
        self.built, self.structure, self.model, self.proximity = built, built.structure, model, built.proximity
        self.problem, self.disturbed, self.knots = built.problem, built.disturbed, built.knots
        # A contact that touches again bears nothing until it does: its force grows from zero.
        self._active = active = self.structure.active
        self.bearing = active & np.vstack([active[:1], active[:-1]])
        self.resting = resting(model)

    def constraint_bounds(self, margin: Margin) -> tuple[Bounds, Bounds]:
        """Bounds of constraints: those that hold in every solve, and those of the exact one.

        Contact and rolling are met within a small part of the task's limits. Where joints have one freedom less than
        the motion needs, or a motion in a plane meets some of them twice, equations would have no solver's solution.
        """
        structure, model, times = self.structure, self.model, self.model.schedule.samples
        firmer = max(margin.normal_force, min(RESTING_GRIP * margin.normal_force, model.force_limit / 2))
        pressing = np.where(self.resting, firmer, margin.normal_force)
        always: Bounds = {}
        exact: Bounds = {}
        for i, c in enumerate(structure.contacts):
            floor = (pressing * force_ramp(self.bearing[:, i], times))[structure.touching[:, i]]
            always[f"contact{c}.pressing"] = (floor[:, None], np.inf)
            # The point stays on the object's surface, where its force acts; the link may be a little off it.
            exact[f"contact{c}.on_link"] = (-model.gap_tolerance, model.gap_tolerance)
            slip = self._slip_allowed(i)
            if model.sliding:
                exact |= {f"slide{c}_{k}.path": (0.0, model.sliding) for k, _ in enumerate(runs(self._active[:-1, i]))}
                # What resists a disturbance has the cone's margin: no contact slides then.
                pushed = np.isin(np.flatnonzero(self._active[:-1, i]), [*self.disturbed, *self.disturbed - 1])
                slip = np.where(pushed[:, None], slip, np.inf)
            exact[f"rolling{c}.no_slip"] = (-slip, slip)
            for block, factor in (("contact", 1.0), ("disturbed_contact", 1.0), ("inter_knot", ROUGHLY)):
                if f"{block}{c}.structural" in self.problem.constraint_rows:
                    exact[f"{block}{c}.structural"] = (-factor * margin.structural, factor * margin.structural)
        if structure.grounded:
            slip = self._slip_allowed(-1)
            exact["ground_rolling.no_slip"] = (-slip, slip)
        if model.tool is not None:
            tolerance = np.full((self.knots, 3), TOOL_TOLERANCE)
            tolerance[model.schedule.goal_samples] = model.goal_tolerance[0]
            always["tool_point.on_path"] = (-tolerance, tolerance)
        return always, exact

    def singularity_margins(self, motion: WholeHand) -> tuple[dict[str, ArrayLike], Bounds]:
        """Parameters and bounds that keep fingers on their sides of singular poses, where they nearly always are."""
        structure = self.structure
        parameters: dict[str, ArrayLike] = {}
        bounds: Bounds = {}
        for i, (c, n) in enumerate(zip(structure.contacts, structure.joints, strict=True)):
            if n in MARGIN_SIZES:
                touching = structure.touching[:, i]
                direction = margin_directions(
                    contact_jacobians(self.model, motion, i), structure.active[:, i], touching
                )
                parameters[f"margin_direction{c}"] = direction
                kept = np.abs(direction[touching]).sum(axis=1) > 0
                bounds[f"contact{c}.singularity_margin"] = (np.where(kept, LEAST_MARGIN, -np.inf)[:, None], np.inf)
        return parameters, bounds

    def _slip_allowed(self, column: int) -> Array:
        """Share (K, 1) of the slip tolerance, by length, of each interval in which a contact touches."""
        lengths, active = np.diff(self.model.schedule.samples), self.structure.active[:-1, column]
        share = lengths[active] / longest_run(active, lengths)
        return np.asarray(self.model.slip_tolerance / np.sqrt(2) * share[:, None])

    def bounds(self) -> tuple[dict[str, Array], dict[str, Array]]:
        """Lower and upper bounds of variables: goals, rest at both ends, no force where there is no contact."""
        model, schedule = self.model, self.model.schedule
        count = len(schedule.samples)
        pose = np.tile([np.inf] * 3 + [most_turn(model)] * 3, (count, 1))
        low_pose, high_pose = -pose, pose
        if model.tool is None:
            goals = model.goal_poses
            at, tolerance = schedule.goal_samples, np.repeat(model.goal_tolerance, 3)
            low_pose[at], high_pose[at] = goals - tolerance, goals + tolerance
        rate = np.full((count, 6), np.inf)
        rate[self.resting] = RESTING
        rate[[0, *schedule.hold_samples, -1]] = 0.0
        most = model.force_limit
        bearing, active = (np.repeat(np.where(f, most, 0.0), 3, axis=1) for f in (self.bearing, self._active))
        # An attached object's rates follow from its joint's.
        upper = {"force": bearing} | ({"rate": rate} if model.attachment is None else {})
        if model.torsion:
            upper["torsion"] = np.where(self.bearing[:, : len(self.structure.contacts)], most, 0.0)
        if model.sliding:
            touching = self._active[:-1, : len(self.structure.contacts)]
            upper |= dict.fromkeys(("slip", "sticking"), np.where(touching.repeat(2, axis=1), np.inf, 0.0))
        if len(self.disturbed):
            # A disturbance may begin with a touch, and what resists it is no force that has to grow.
            upper["force_disturbed"] = active[self.disturbed]
        lower = {name: -bound for name, bound in upper.items()}
        joint_lower, joint_upper = attached.bounds(model)
        lower["point"], upper["point"] = landing_bounds(model, self.structure.columns)
        return {"pose": low_pose, **lower, **joint_lower}, {"pose": high_pose, **upper, **joint_upper}

    def start(self, motion: WholeHand, sharpness: int = 0) -> dict[str, Array]:
        """Values of all variables: the motion, with velocities and forces that nearly obey it.

        Args:
            motion: to begin with.
            sharpness: how many times the spin was lowered beyond which contacts count as spinning.
        """
        count, chosen = self.knots, self.structure.columns
        joint, freedom = self.model.attachment, None
        if joint is None:
            rates, wrenches = rates_and_wrenches(self.model, motion.position, motion.vector)
            moving = {"pose": np.hstack([motion.position, motion.vector]), "rate": rates}
        else:
            freedom = joint.twist
            moving, wrenches = along_joint(self.model, motion.position, motion.vector)
        points = motion.point[:, chosen]
        forces = balanced(points, motion.force[:, chosen], self.bearing, wrenches, freedom)
        values = {
            **moving,
            "point": points.reshape(count, -1),
            "force": forces.reshape(count, -1),
            "wrench": np.hstack([forces.sum(axis=1), np.cross(points, forces).sum(axis=1)]),
        }
        twist = np.zeros((count, 3))
        if self.model.torsion:
            values |= self._torsion(motion, forces, sharpness)
            twist = values["twist_torque"]
            values["wrench"][:, 3:] += twist
        if self.model.sliding:
            contacts = self.structure.contacts
            helpers = [_helpers(motion.point[:, c], self.model.touched[c]) for c in contacts]
            values |= sliding_start(self.model, motion, np.array(helpers), self._active)
        at, pushing, twisting = ((a[1:] + a[:-1]) / 2 for a in (points, forces, twist))
        values["middle_torque"] = np.cross(at, pushing).sum(axis=1) + twisting
        if len(k := self.disturbed):
            pushed = self.model.unborne(disturbance_wrenches(self.model, motion.vector)[k].T).T
            disturbed = balanced(points[k], forces[k], self._active[k], wrenches[k] - pushed, freedom)
            values["force_disturbed"] = disturbed.reshape(len(k), -1)
        for c, finger, angles in zip(self.structure.contacts, motion.fingers, motion.angles, strict=True):
            values[f"angles{c}"] = angles
            values |= {f"{name}{c}": getattr(finger, name).reshape(1, -1) for name in morphology_sizes(finger.joints)}
        if motion.coupling is not None:
            values |= coupling_start(self.built, motion.coupling)
        return values

    def spin_scale(self, sharpness: int = 0) -> float:
        """Rate of spin, rad/s, beyond which contacts count as spinning in the last solve, so many times sharpened."""
        return SHARP[min(sharpness + self.structure.pinched, len(SHARP) - 1)]

    def _torsion(self, motion: WholeHand, forces: Array, sharpness: int) -> dict[str, Array]:
        """Values of what fingertips' torsion is made of, beside contact forces (S, C, 3)."""
        model, contacts = self.model, list(self.structure.contacts)
        count, steps = len(contacts), np.diff(model.schedule.samples)
        torsion = np.zeros((self.knots, count))
        if motion.torsion is not None:
            torsion = np.where(self.bearing[:, :count], motion.torsion[:, contacts], 0.0)
        normals = np.array([[model.touched[c].outward(p) for p in motion.point[:, c]] for c in contacts])
        spins = np.array([contact_spins(model, motion, i, n) / steps for i, n in enumerate(normals)]).T
        pressing = -np.einsum("sfi,fsi->sf", forces[:, :count], normals)
        across = np.sum(forces[:, :count] ** 2, axis=2) - pressing**2
        most = np.sqrt(np.maximum(pressing**2 - across / model.friction**2, 1e-6))
        share = ((torsion / most)[1:] + (torsion / most)[:-1]) / 2
        fully = spins / np.sqrt(spins**2 + self.spin_scale(sharpness) ** 2)
        holding = np.clip((share + fully) / (1 - fully**2), -HOLDING, HOLDING)
        twist = model.torsion * np.einsum("sf,fsi->si", torsion, normals)
        return {"spin": spins, "torsion": torsion, "holding": holding, "twist_torque": twist}

    def parameters(self, motion: WholeHand, margin: Margin, wanted: WholeHand | None = None) -> dict[str, ArrayLike]:
        """Values of all parameters but the weights; costs hold a motion near to the wanted one, by default itself."""
        model, structure, wanted = self.model, self.structure, wanted or motion
        halves = structure.middles.weights()
        quaternion = halves @ continuous(motion.palm_quaternion)
        values: dict[str, ArrayLike] = {
            "reference": model.reference,
            "gravity": model.gravity,
            "inertial": model.units.inertial,
            "inertia": model.inertia.reshape(1, 9),
            "inverse": np.linalg.inv(model.inertia).reshape(1, 9),
            "hinge": model.hinge,
            "palm_radius": model.palm_radius,
            "ground_height": model.ground_height,
            "friction": margin.friction * model.friction,
            "bodies": packed(model.bodies),
            "step": np.diff(model.schedule.samples)[:, None],
            "palm_position": motion.palm_position,
            "palm_quaternion": motion.palm_quaternion,
            "palm_position_between": halves @ motion.palm_position,
            "palm_quaternion_between": quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True),
            "wanted_pose": np.hstack([wanted.position, wanted.vector]),
        }
        values |= self.proximity.idle | {"radius": model.link_radius, "tip_radius": model.tip_radius}
        if model.servo:
            values["servo_radius"] = model.servo
        values |= attached.parameters(model) | (model.strength.parameters if model.strength else {})
        if model.torsion:
            values |= {"torsion_radius": model.torsion, "sliding_friction": model.friction}
            values["spin_scale"] = self.spin_scale()
        if model.motors:
            values["stiffness"] = model.stiffness
        if model.sliding:
            values |= {"sliding_friction": model.friction, "cone_friction": WHOLE * model.friction}
            values |= {"slide_margin": margin.friction, "slip_scale": SLIP_SCALE / model.units.length}
        values |= own_values(self.problem, model) | faces.parameters(structure, motion)
        if model.disturbance is not None and len(self.disturbed):
            values["external_force"] = model.disturbance.force[self.disturbed]
            values["external_torque"] = model.disturbance.torque[self.disturbed]
        if model.tool is None:
            values["goals"] = model.goal_poses
        else:
            values["tool"], values["tool_path"] = model.tool, tool_path(model)
        if structure.grounded and model.ground is not None:
            values["ground_friction"] = margin.friction * model.frictions[-1]
        for c in structure.columns:
            values[f"wanted_point{c}"], values[f"wanted_force{c}"] = wanted.point[:, c], wanted.force[:, c]
            values[f"body{c}"] = model.touched[c].parameters
        for c, finger in zip(structure.contacts, wanted.fingers, strict=True):
            if finger.joints in MARGIN_SIZES:
                values[f"margin_direction{c}"] = 0.0
            values[f"frames{c}"] = finger.frames.transpose(0, 2, 1).reshape(1, -1)
            for name in morphology_sizes(finger.joints):
                values[f"wanted_{name}{c}"] = getattr(finger, name).reshape(1, -1)
            values[f"tie{c}"] = SLIDING_TIE if model.slides(c) else LIFTING_TIE if model.lifts(c) else 1.0
            values[f"helper{c}"] = _helpers(motion.point[:, c], model.touched[c])
        return values


def _helpers(points: Array, body: Body) -> Array:
    """Vectors (S, 3) well across the surface normal at each contact point, continuous along the motion."""
    helper, helpers = body.helper, []
    for point in points:
        normal = body.outward(point)
        across = helper - (helper @ normal) * normal
        if np.linalg.norm(across) < 0.5:
            across = np.eye(3)[np.argmin(np.abs(normal))]
            across = across - (across @ normal) * normal
        helper = across / np.linalg.norm(across)
        helpers.append(helper)
    return np.array(helpers)
