"""What four libraries make of one ``hand.urdf``: masses, inertias, the order of joints, fingertips along the motion."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
import yourdfpy
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from casadi_hands.export.design import Design

Facts = dict[str, np.ndarray]


def disagreement(folder: Path, design: Design) -> float:
    """The largest difference of any two of the libraries, over the size of what is compared.

    Raises:
        AssertionError: the order of joints differs, or Drake has other actuators than joints.
    """
    assert design.hand is not None
    assert design.motion is not None
    assert design.motion.joint_names == design.hand.joint_names
    file, angles = folder / "hand.urdf", design.motion.joint_angles
    links = [f"finger{i}_link{j}" for i, finger in enumerate(design.hand.fingers) for j in range(len(finger.links))]
    tips = {
        f"finger{i}_link{len(finger.links) - 1}": np.array([0, 0, finger.links[-1].length])
        for i, finger in enumerate(design.hand.fingers)
    }
    given = file, angles, list(design.hand.joint_names), links, tips
    found = [seen(*given) for seen in (_pin, _mujoco, _yourdfpy, _drake)]
    worst = 0.0
    for name, expected in found[0].items():
        size = float(np.abs(expected).max())
        worst = max(worst, *(float(np.abs(other[name] - expected).max()) / size for other in found[1:]))
    return worst


def _pin(file: Path, angles: np.ndarray, joints: list[str], links: list[str], tips: dict[str, np.ndarray]) -> Facts:
    model = pin.buildModelFromUrdf(str(file))
    assert list(model.names)[1:] == joints
    data, places = model.createData(), []
    for row in angles:
        pin.framesForwardKinematics(model, data, row)
        places.append([data.oMf[model.getFrameId(name)].act(point) for name, point in tips.items()])
    inertias = [model.inertias[model.getJointId(name)] for name in joints]
    return {
        "mass": np.array([each.mass for each in inertias]),
        "inertia": np.array([each.inertia for each in inertias]),
        "tips": np.array(places),
    }


def _mujoco(file: Path, angles: np.ndarray, joints: list[str], links: list[str], tips: dict[str, np.ndarray]) -> Facts:
    model = mujoco.MjModel.from_xml_path(str(file))
    assert [model.joint(k).name for k in range(model.njnt)] == joints
    data, places = mujoco.MjData(model), []
    for row in angles:
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        palm = data.body("palm")
        back = palm.xmat.reshape(3, 3).T
        at = [data.body(name).xpos + data.body(name).xmat.reshape(3, 3) @ point for name, point in tips.items()]
        places.append([back @ (point - palm.xpos) for point in at])
    inertias = []
    for name in links:
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, model.body(name).iquat)
        axes = turn.reshape(3, 3)
        inertias.append(axes @ np.diag(model.body(name).inertia) @ axes.T)
    return {
        "mass": np.array([model.body(name).mass[0] for name in links]),
        "inertia": np.array(inertias),
        "tips": np.array(places),
    }


def _yourdfpy(
    file: Path, angles: np.ndarray, joints: list[str], links: list[str], tips: dict[str, np.ndarray]
) -> Facts:
    robot = yourdfpy.URDF.load(str(file), load_meshes=False, build_scene_graph=True)
    assert robot.actuated_joint_names == joints
    places = []
    for row in angles:
        robot.update_cfg(row)
        places.append([(robot.get_transform(name, "palm") @ [*point, 1.0])[:3] for name, point in tips.items()])
    inertials = [robot.link_map[name].inertial for name in links]
    return {
        "mass": np.array([each.mass for each in inertials]),
        "inertia": np.array([each.inertia for each in inertials]),
        "tips": np.array(places),
    }


def _drake(file: Path, angles: np.ndarray, joints: list[str], links: list[str], tips: dict[str, np.ndarray]) -> Facts:
    plant = MultibodyPlant(0.0)
    (hand,) = Parser(plant).AddModels(file)
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("palm"))
    plant.Finalize()
    driven = [plant.get_joint(k).name() for k in plant.GetJointIndices(hand) if plant.get_joint(k).num_positions()]
    assert driven == joints
    assert plant.num_actuators() == len(joints)
    context, places = plant.CreateDefaultContext(), []
    given: dict[str, Any] = dict(tips)  # Drake's types name an array's number type where its shape belongs
    for row in angles:
        plant.SetPositions(context, row)
        places.append(
            [
                plant.CalcPointsPositions(context, plant.GetFrameByName(name), point, plant.world_frame()).ravel()
                for name, point in given.items()
            ]
        )
    inertias = [plant.GetBodyByName(name).default_spatial_inertia() for name in links]
    central = [each.Shift(each.get_com()).CalcRotationalInertia().CopyToFullMatrix3() for each in inertias]
    return {
        "mass": np.array([each.get_mass() for each in inertias]),
        "inertia": np.array(central),
        "tips": np.array(places),
    }
