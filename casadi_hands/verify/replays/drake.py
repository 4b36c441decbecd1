"""Drake as the replay's second engine: the same hand, commands and object, in physics written by others.

Masses, inertias, joints and their limits come from ``hand.urdf`` and ``object.urdf`` through Drake's own parser; gains,
rotor inertia and torque limits of the motors from ``scene.xml``; shapes are the URDF's with each cylinder and its two
end spheres joined to a capsule, since overlapping shapes would press twice. Gravity, friction and ground are the
task's.

What means the same as in ``scene.xml``:

- *Motors*: position and damping gains, implicit in the step; torque limits; rotor inertia; a hand that carries its own
  weight.
- *Shared motors* are where they are told to be: what their springs pull at, and how fast, follows from their positions
  alone. In ``scene.xml`` motors are bodies, a hundred times as stiff as the springs.
- *Friction*: Coulomb's, with the task's coefficient where the object touches the hand, and the ground's where it
  touches the ground.
- *Palm*: goes where the plan says with the plan's velocity, whatever pushes it.
- *Collisions*: all, but of neighbours in a chain and of the palm with first links.

What does not:

- *Contacts* are patches of pressure that grow with depth (Drake's hydroelastic contact), not points: Drake's points
  have no torsional friction, and what two fingertips hold would spin freely. MuJoCo's contacts in ``scene.xml`` give
  like rubber under the planned forces, and are as stiff as the masses behind them are heavy; these know no mass. The
  pressure's gradient is such that six times the object's weight, or three times the largest planned force if that is
  more, makes a patch of 0.375 of the fingertip's radius.
- *Torsional friction* is what such a patch has by itself, (8/15)·μ·radius of the patch: as much as MuJoCo's at the
  force just named where the task has a rubber fingertip's, and with the fourth root of the force less below it, usually
  0.6 to 1 of MuJoCo's. It is no number that could be given: whatever else the task says of torsion is not played, and
  neither are perturbations of it (`can_play`), which are refused.
- *Damping* in contacts is Hunt and Crossley's, with a relaxation time of 0.02 s at that patch's depth. It never
  pulls.
- *The ground* is rigid, and a patch on it resists twisting; in ``scene.xml`` nothing does there.
- *Stiction* creeps by some 0.01 mm/s; in ``scene.xml`` a pass of MuJoCo's own takes that back.
- *Surfaces* are triangles, which leave the true shape by up to 0.1 of that patch's depth.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.errors import DesignError, HandsError
from casadi_hands.verify.figures.dynamics import object_rotation
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.replays.drake_scene import Motor, Shapes, load_drake, read_mechanics, read_motors, transform
from casadi_hands.verify.replays.engine import one_line
from casadi_hands.verify.replays.perturb import Perturbation
from casadi_hands.verify.replays.plan import Plan
from casadi_hands.verify.replays.simulation import RELEASE, SQUEEZE, SUPPORT, Observer

STEP = 2e-3
"""s; half of it changes the object's path by about 0.1 mm at most."""

STICTION = 1e-5
"""m/s at which stiction creeps under half of the force that it holds, about."""

HEAVY = 1e6
"""Of the object's mass: the palm's, where it moves. Only the force on it has to know."""


class DrakeSimulation:
    """Drake's model and state of a result folder, perturbed.

    Attributes:
        step: s.
    """

    step = STEP

    def __init__(self, folder: Folder, perturbation: Perturbation) -> None:
        """Build the scene and put everything at its start.

        Raises:
            DesignError: a file is missing, unreadable, or not of this hand.
            HandsError: Drake is not installed or cannot be loaded, or cannot be told of the perturbation.
        """
        if perturbation.torsion != 1.0:
            raise HandsError("Drake's contacts are patches, with their own torsional friction: leave its factor at 1")
        self._drake = drake = load_drake()
        self._names, self._drive = folder.motion.joint_names, folder.drive
        motors, self._moves = read_motors(folder, perturbation)
        self._perturbation = perturbation
        self._late = round(perturbation.delay / STEP)
        self._bias = np.asarray(perturbation.joint_bias or np.zeros(len(self._names)))
        builder = drake.systems.framework.DiagramBuilder()
        config = drake.multibody.plant.MultibodyPlantConfig(
            time_step=STEP,
            stiction_tolerance=STICTION,
            contact_model="hydroelastic_with_fallback",
            discrete_contact_approximation="lagged",
            use_sampled_output_ports=False,
        )
        self._plant, self._graph = drake.multibody.plant.AddMultibodyPlant(config, builder)
        # The warning is about deformable bodies touching the ground, of which there are none.
        with _quiet():
            self._add_bodies(folder)
            self._add_motors(motors)
            Shapes(drake, self._plant, folder, perturbation.friction).add(self._hand, self._item)
            self._plant.Finalize()
            diagram = builder.Build()
            self._simulator = drake.systems.analysis.Simulator(diagram)
        actuators = (self._plant.get_joint_actuator(k) for k in self._plant.GetJointActuatorIndices(self._hand))
        self._order = [self._names.index(actuator.joint().name()) for actuator in actuators]
        self._context = self._plant.GetMyMutableContextFromRoot(self._simulator.get_mutable_context())
        self._place(folder, perturbation)
        self._simulator.Initialize()
        self._steps = 0

    def _add_bodies(self, folder: Folder) -> None:
        """Parse the two URDF files, and weld a palm that stands still to the world."""
        parser = self._drake.multibody.parsing.Parser(self._plant)
        try:
            (self._hand,) = parser.AddModelsFromString(read_mechanics(folder, "hand.urdf"), "urdf")
            (self._item,) = parser.AddModelsFromString(read_mechanics(folder, "object.urdf"), "urdf")
        except (RuntimeError, ValueError) as error:
            raise DesignError(f"{folder.path}: Drake cannot read its URDF files: {one_line(error)}") from None
        self._palm = self._plant.GetBodyByName("palm", self._hand)
        self._object = self._plant.GetBodyByName("object", self._item)
        self._plant.mutable_gravity_field().set_gravity_vector(folder.gravity)
        self._plant.set_gravity_enabled(self._hand, False)
        turn = Rotation.from_quat(folder.motion.base_orientation[0], scalar_first=True)
        self._base = transform(self._drake, turn, folder.motion.base_position[0])
        if not self._moves:
            self._plant.WeldFrames(self._plant.world_frame(), self._palm.body_frame(), self._base)

    def _add_motors(self, motors: dict[str, Motor]) -> None:
        """Give every joint its motor, by way of the URDF's transmission where there is one."""
        plant = self._plant
        # Of the hand alone, the indices are known only once the plant is finalized.
        made = [plant.get_joint_actuator(k) for k in plant.GetJointActuatorIndices()]
        driven = {actuator.joint().name(): actuator for actuator in made}
        for name in self._names:
            motor, joint = motors[name], plant.GetJointByName(name, self._hand)
            actuator = driven.get(name) or plant.AddJointActuator(name, joint, motor.effort)
            actuator.set_effort_limit(motor.effort)
            actuator.set_default_gear_ratio(1.0)
            actuator.set_default_rotor_inertia(motor.armature)
            gains = self._drake.multibody.tree.PdControllerGains(p=motor.stiffness, d=motor.damping)
            actuator.set_controller_gains(gains)

    def _place(self, folder: Folder, perturbation: Perturbation) -> None:
        """Put everything at the motion's first sample, the object off it and heavier as the perturbation says."""
        plant, context, make = self._plant, self._context, self._drake.multibody.tree.SpatialInertia
        for name, angle in zip(self._names, folder.motion.joint_angles[0] + self._bias, strict=True):
            plant.GetJointByName(name, self._hand).set_angle(context, angle)
        turn = Rotation.from_rotvec(perturbation.start_turn) * object_rotation(folder)[0]
        self._home = turn, folder.motion.object_position[0] + np.asarray(perturbation.start_shift)
        self._displaced = perturbation.displaced
        plant.SetFreeBodyPose(context, self._object, transform(self._drake, *self._home))
        body = self._object.CalcSpatialInertiaInBodyFrame(context)
        self._mass = perturbation.mass * body.get_mass()
        scaled = make(self._mass, body.get_com(), body.get_unit_inertia())
        self._object.SetSpatialInertiaInBodyFrame(context, scaled)
        self._center = np.asarray(body.get_com())
        about_center = scaled.Shift(self._center).CalcRotationalInertia()
        self._inertia = np.asarray(about_center.CopyToFullMatrix3())
        self._unborne = list(self._make_links_heavier(folder, perturbation.link_mass))
        if self._moves:
            palm = make.SolidSphereWithMass(HEAVY * self._mass, folder.length)
            self._palm.SetSpatialInertiaInBodyFrame(context, palm)
            self._palm_inertia = float(palm.CalcRotationalInertia().get_moments()[0])
            plant.SetFreeBodyPose(context, self._palm, self._base)

    def _make_links_heavier(self, folder: Folder, factor: float) -> Iterator[Any]:
        """Yield what links then weigh beyond the plan, which is what the hand carries."""
        if factor == 1.0:
            return
        for name in folder.links:
            if name != "palm":
                link = self._plant.GetBodyByName(name, self._hand)
                inertia, mass = link.CalcSpatialInertiaInBodyFrame(self._context), link.get_mass(self._context)
                center, unit = np.asarray(inertia.get_com()), inertia.get_unit_inertia()
                scaled = self._drake.multibody.tree.SpatialInertia(factor * mass, center, unit)
                link.SetSpatialInertiaInBodyFrame(self._context, scaled)
                yield self._wrench(link, center, (factor - 1.0) * mass * folder.gravity, np.zeros(3))

    def object_pose(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the object's position (3,) and quaternion (4,) [w, x, y, z], world."""
        pose = self._plant.GetFreeBodyPose(self._context, self._object)
        return np.asarray(pose.translation()), np.asarray(pose.rotation().ToQuaternion().wxyz())

    def touches(self, link: str) -> bool:
        """Whether the object touches any link of the contact's finger (or the ground)."""
        finger, own = link.partition("_link")[0], self._object.index()
        query = self._plant.get_geometry_query_input_port().Eval(self._context)
        kind = self._drake.geometry.HydroelasticContactRepresentation.kPolygon
        surfaces, points = query.ComputeContactSurfacesWithFallback(kind)
        pairs = [(each.id_M(), each.id_N()) for each in surfaces] + [(each.id_A, each.id_B) for each in points]
        for pair in pairs:
            bodies = [self._plant.GetBodyFromFrameId(self._graph.model_inspector().GetFrameId(each)) for each in pair]
            names = {
                "ground" if body.index() == self._plant.world_body().index() else body.name().partition("_link")[0]
                for body in bodies
                if body.index() != own
            }
            if len(names) == 1 and finger in names and any(body.index() == own for body in bodies):
                return True
        return False

    def settle(self, plan: Plan, observer: Observer | None) -> None:
        """Squeeze at the start pose; an object off its place is held there by a soft support, which then lets go."""
        for i in range(round((SQUEEZE + RELEASE) / self.step)):
            force, torque, squeeze = np.zeros(3), np.zeros(3), 1.0
            if self._displaced:
                time = i * self.step
                # Springs of joints that share motors press in full at once.
                squeeze = min(time / SQUEEZE, 1.0) if self._drive is None else 1.0
                force, torque = self._support(1.0 - max(0.0, time - SQUEEZE) / RELEASE)
                # What the fingers do not bear yet: on its springs alone the object would sag and be gripped there.
                force = force - (1.0 - squeeze) * self._mass * self._plant.gravity_field().gravity_vector()
            self._follow(plan, 0, 0, squeeze, plan.external_force[0] + force, plan.external_torque[0] + torque)
            self._advance(observer)

    def _support(self, share: float) -> tuple[np.ndarray, np.ndarray]:
        """Return a share of the spring force and torque that hold the object at its start."""
        pose = self._plant.GetFreeBodyPose(self._context, self._object)
        turn, (home_turn, home) = Rotation.from_matrix(pose.rotation().matrix()), self._home
        velocity = self._plant.EvalBodySpatialVelocityInWorld(self._context, self._object)
        # About every axis by its own inertia: a thin object would be shaken by what serves its length.
        inertia = turn.as_matrix() @ self._inertia @ turn.as_matrix().T
        off, turned = pose.translation() - home, (turn * home_turn.inv()).as_rotvec()
        force = self._mass * (-(SUPPORT**2) * off - 2 * SUPPORT * velocity.translational())
        torque = inertia @ (-(SUPPORT**2) * turned - 2 * SUPPORT * velocity.rotational())
        return share * force, share * torque

    def play(self, plan: Plan, i: int, push: np.ndarray, observer: Observer | None) -> None:
        """Drive the hand as planned for a step, and make it; ``push`` (3,) is a force on the object, N, world."""
        force, torque = plan.external_force[i] + push, plan.external_torque[i]
        self._follow(plan, i, min(i + 1, len(plan) - 1), 1.0, force, torque)
        self._advance(observer)

    def _follow(
        self, plan: Plan, i: int, following: int, squeeze: float, force: np.ndarray, torque: np.ndarray
    ) -> None:
        """Set the motors' set points, with a share of what they are ahead of planned angles, and a step's wrenches."""
        told = max(i - self._late, 0)
        targets, rates = plan.commands[told] + self._bias, np.zeros(len(self._names))
        if self._drive is None:
            targets = plan.angles[told] + self._bias + squeeze * plan.ahead(told, self._perturbation)
        elif plan.motors is not None and i > self._late:
            # A spring's damper is between the joint and what its motors turn.
            rates = self._drive.ratios @ (plan.motors[told] - plan.motors[told - 1]) / self.step
        desired = np.concatenate([targets[self._order], rates[self._order]])
        self._plant.get_desired_state_input_port(self._hand).FixValue(self._context, desired)
        wrenches = [self._wrench(self._object, self._center, force, torque), *self._unborne]
        if self._moves:
            turn = Rotation.from_quat(plan.palm_quaternion[following], scalar_first=True)
            wrenches.append(self._carry(turn, plan.palm_position[following]))
        self._plant.get_applied_spatial_force_input_port().FixValue(self._context, wrenches)

    def _carry(self, turn: Rotation, position: np.ndarray) -> Any:
        """Return the wrench that brings the palm to a pose within a step: fingers feel how it accelerates."""
        pose = self._plant.GetFreeBodyPose(self._context, self._palm)
        velocity = self._plant.EvalBodySpatialVelocityInWorld(self._context, self._palm)
        turned = (turn * Rotation.from_matrix(pose.rotation().matrix()).inv()).as_rotvec()
        gain = (position - pose.translation()) / self.step - velocity.translational()
        spin_up = turned / self.step - velocity.rotational()
        force, torque = HEAVY * self._mass * gain / self.step, self._palm_inertia * spin_up / self.step
        return self._wrench(self._palm, np.zeros(3), force, torque)

    def _wrench(self, body: Any, at: np.ndarray, force: np.ndarray, torque: np.ndarray) -> Any:
        """Return a force and torque, world, at a point of a body, body frame."""
        wrench = self._drake.multibody.plant.ExternallyAppliedSpatialForce()
        wrench.body_index, wrench.p_BoBq_B = body.index(), at
        wrench.F_Bq_W = self._drake.multibody.math.SpatialForce(tau=torque, f=force)
        return wrench

    def _advance(self, observer: Observer | None) -> None:
        self._steps += 1
        try:
            self._simulator.AdvanceTo(self._steps * self.step)
        except RuntimeError as error:
            raise HandsError(
                f"Drake gave up {self._steps * self.step:.3f} s into the replay: {one_line(error)}; try --engine mujoco"
            ) from None
        if observer is not None:
            observer(self._plant, self._context)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep Drake's warnings off the terminal."""
    logger = logging.getLogger("drake")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        yield
    finally:
        logger.setLevel(level)
