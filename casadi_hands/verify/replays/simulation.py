"""The simulated world that a hand acts in, as MuJoCo has it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.errors import DesignError
from casadi_hands.verify.figures.dynamics import object_rotation
from casadi_hands.verify.held import held
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.replays.actuation import Actuation, OwnMotors, SharedMotors, bias
from casadi_hands.verify.replays.engine import load_mujoco
from casadi_hands.verify.replays.mounted import Mounted
from casadi_hands.verify.replays.perturb import Perturbation
from casadi_hands.verify.replays.plan import Plan

SQUEEZE, RELEASE = 0.3, 0.2
"""s before the motion, in which its first commands hold; an object off its place is held there, then let go."""

SUPPORT = 60.0
"""rad/s, natural frequency of the support that holds a displaced object, on its mass; critically damped."""


Observer = Callable[[Any, Any], None]
"""Called with MuJoCo's model and data after every step."""


class UnplayableError(DesignError):
    """MuJoCo does not take a scene.

    Attributes:
        words: why, in its own words, on one line.
    """

    def __init__(self, file: Path, error: ValueError) -> None:
        self.words = " ".join(str(error).removeprefix("Error: ").split())
        super().__init__(f"{file}: MuJoCo does not take it: {self.words}")


class Simulation:
    """MuJoCo's model and state of ``scene.xml``, perturbed.

    Attributes:
        step: s.
    """

    def __init__(self, folder: Folder, perturbation: Perturbation) -> None:
        """Load ``scene.xml`` and put everything at its start.

        Raises:
            DesignError: the scene is missing, unreadable, or not of this hand.
            HandsError: MuJoCo is not installed or cannot be loaded.
        """
        self._mujoco = mujoco = load_mujoco()
        file, scene = folder.path / "scene.xml", folder.scene
        if scene is None:
            raise DesignError(f"{file}: missing, so there is nothing to replay")
        if scene.strange:
            raise DesignError(f"{file}: {scene.strange[0]}")
        try:
            # What was read, so that MuJoCo is told nothing else.
            self.model = mujoco.MjModel.from_xml_string(scene.text)
        except ValueError as error:
            raise UnplayableError(file, error) from None
        self._find(folder, file)
        self._bias = bias(perturbation, len(folder.motion.joint_names))
        self._perturbation = perturbation
        self._perturb(perturbation)
        self.data = mujoco.MjData(self.model)
        mujoco.mj_setConst(self.model, self.data)
        self._place(folder, perturbation)
        self.step = float(self.model.opt.timestep)
        self._late = round(perturbation.delay / self.step)

    def _find(self, folder: Folder, file: Path) -> None:
        """Look up by name what the replay touches."""
        kinds, model = self._mujoco.mjtObj, self.model
        find = partial(self._mujoco.mj_name2id, model)
        self._object = find(kinds.mjOBJ_BODY, "object")
        self._links = {name: find(kinds.mjOBJ_BODY, name) for name in folder.links}
        self._links["ground"] = 0
        target = find(kinds.mjOBJ_BODY, "palm_target")
        self._mocap = int(model.body_mocapid[target]) if target >= 0 else -1
        joints = [find(kinds.mjOBJ_JOINT, name) for name in folder.motion.joint_names]
        if self._object < 0 or -1 in self._links.values() or -1 in joints:
            raise DesignError(f"{file}: it lacks the object, a link, a joint or an actuator of this hand")
        self._motors: Actuation
        if folder.drive is None:
            self._motors = OwnMotors(self._mujoco, model, folder, file)
        else:
            self._motors = SharedMotors(self._mujoco, model, folder, folder.drive, file)
        self._angles = [int(model.jnt_qposadr[joint]) for joint in joints]
        joint = held(folder)
        self._mounted = None if joint is None else Mounted(folder, joint, model, self._object)
        free = int(model.body_jntadr[self._object])
        self._pose, self._twist = int(model.jnt_qposadr[free]), int(model.jnt_dofadr[free])

    def _perturb(self, perturbation: Perturbation) -> None:
        """Change the model as the perturbation says."""
        model = self.model
        self._motors.perturb(model, perturbation)
        model.body_mass[self._object] *= perturbation.mass
        model.body_inertia[self._object] *= perturbation.mass
        model.geom_friction *= perturbation.friction
        model.geom_friction[:, 1] *= perturbation.torsion
        links = [body for name, body in self._links.items() if name not in ("palm", "ground")]
        model.body_mass[links] *= perturbation.link_mass
        model.body_inertia[links] *= perturbation.link_mass
        # What MuJoCo takes off a body is a share of its actual weight, and the hand knows the planned one.
        model.body_gravcomp[links] /= perturbation.link_mass

    def _place(self, folder: Folder, perturbation: Perturbation) -> None:
        """Put everything at the motion's first sample, the object off it as the perturbation says."""
        self._mujoco.mj_resetDataKeyframe(
            self.model, self.data, self._mujoco.mj_name2id(self.model, self._mujoco.mjtObj.mjOBJ_KEY, "start")
        )
        self.data.qpos[self._angles] = folder.motion.joint_angles[0] + self._bias
        if self._mounted is not None:
            self._home = self._mounted.place(self.data, perturbation)
            self._mujoco.mj_forward(self.model, self.data)
            return
        turn = Rotation.from_rotvec(perturbation.start_turn) * object_rotation(folder)[0]
        position = folder.motion.object_position[0] + np.asarray(perturbation.start_shift)
        self._home = position, turn.inv().as_quat(scalar_first=True)
        self.data.qpos[self._pose : self._pose + 3] = position
        self.data.qpos[self._pose + 3 : self._pose + 7] = turn.as_quat(scalar_first=True)
        self._mujoco.mj_forward(self.model, self.data)

    def object_pose(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the object's position (3,) and quaternion (4,) [w, x, y, z], world."""
        if self._mounted is not None:
            return self.data.xpos[self._object].copy(), self.data.xquat[self._object].copy()
        at = self._pose
        return self.data.qpos[at : at + 3], self.data.qpos[at + 3 : at + 7]

    def touches(self, link: str) -> bool:
        """Whether the object touches any link of the contact's finger (or the ground)."""
        finger = link.partition("_link")[0]
        bodies = {body for name, body in self._links.items() if name.partition("_link")[0] == finger}
        for contact in self.data.contact:
            pair = {int(self.model.geom_bodyid[geom]) for geom in contact.geom}
            if self._object in pair and pair & bodies:
                return True
        return False

    def settle(self, plan: Plan, observer: Observer | None) -> None:
        """Squeeze at the start pose; an object off its place is held there by a soft support, which then lets go."""
        told = np.maximum(np.arange(len(plan)) - self._late, 0)
        self._set_points, ahead = self._motors.set_points(plan, told, self._perturbation)
        displaced = self._perturbation.displaced
        ramps = displaced and self._motors.ramps
        for i in range(round((SQUEEZE + RELEASE) / self.step)):
            time = i * self.step
            share = 1.0 - max(0.0, time - SQUEEZE) / RELEASE if displaced else 0.0
            squeeze = min(time / SQUEEZE, 1.0) if ramps else 1.0
            force, torque = self._support(share) if share else (np.zeros(3), np.zeros(3))
            # What the fingers do not bear yet: on its springs alone the object would sag and be gripped there.
            unborne = -(1.0 - squeeze) * self.model.body_mass[self._object] * self.model.opt.gravity
            self._follow(plan, 0, self._set_points[0] - (1.0 - squeeze) * ahead[0])
            self._advance(plan.external_force[0] + force + unborne, plan.external_torque[0] + torque, observer)

    def _support(self, share: float) -> tuple[np.ndarray, np.ndarray]:
        """Return a share of the spring force and torque that hold the object at its start."""
        if self._mounted is not None:
            force, torque = self._mounted.support(self.data, self._perturbation.mass, SUPPORT)
            return share * force, share * torque
        mass, (position, quaternion) = self.model.body_mass[self._object], self.object_pose()
        # About every axis by its own inertia: a thin object would be shaken by what serves its length.
        axes = self._matrix(self._product(quaternion, self.model.body_iquat[self._object]))
        inertia = (axes * self.model.body_inertia[self._object]) @ axes.T
        velocity = self.data.qvel[self._twist : self._twist + 3]
        rate = self._matrix(quaternion) @ self.data.qvel[self._twist + 3 : self._twist + 6]
        home_position, back_home = self._home
        off, turned = position - home_position, np.empty(3)
        self._mujoco.mju_quat2Vel(turned, self._product(quaternion, back_home), 1.0)
        force = mass * (-(SUPPORT**2) * off - 2 * SUPPORT * velocity)
        torque = inertia @ (-(SUPPORT**2) * turned - 2 * SUPPORT * rate)
        return share * force, share * torque

    def _product(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Return the quaternion (4,) of the second turn followed by the first."""
        product = np.empty(4)
        self._mujoco.mju_mulQuat(product, first, second)
        return product

    def _matrix(self, quaternion: np.ndarray) -> np.ndarray:
        """Return the rotation (3, 3) of a quaternion (4,)."""
        matrix = np.empty(9)
        self._mujoco.mju_quat2Mat(matrix, quaternion)
        return matrix.reshape(3, 3)

    def play(self, plan: Plan, i: int, push: np.ndarray, observer: Observer | None) -> None:
        """Drive the hand as planned for a step, and make it; ``push`` (3,) is a force on the object, N, world."""
        self._follow(plan, i, self._set_points[i])
        self._advance(plan.external_force[i] + push, plan.external_torque[i], observer)

    def _follow(self, plan: Plan, i: int, set_points: np.ndarray) -> None:
        """Set the motors' set points (N,), rad, and the palm's target for a step."""
        self.data.ctrl[self._motors.indices] = set_points
        if self._mocap >= 0:
            self.data.mocap_pos[self._mocap] = plan.palm_position[i]
            self.data.mocap_quat[self._mocap] = plan.palm_quaternion[i]

    def _advance(self, force: np.ndarray, torque: np.ndarray, observer: Observer | None) -> None:
        self.data.xfrc_applied[self._object, :3] = force
        self.data.xfrc_applied[self._object, 3:] = torque
        self._mujoco.mj_step(self.model, self.data)
        if observer is not None:
            observer(self.model, self.data)
