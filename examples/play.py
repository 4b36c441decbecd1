"""Play a result folder in MuJoCo, with numpy and mujoco alone: python play.py DIR."""

import sys

import mujoco
import numpy as np

folder = sys.argv[1]
motion = dict(np.load(f"{folder}/motion.npz"))
model = mujoco.MjModel.from_xml_path(f"{folder}/scene.xml")
data = mujoco.MjData(model)
mujoco.mj_resetDataKeyframe(model, data, 0)  # the keyframe "start"
motion["commands"] = motion.get("motor_positions", motion["joint_commands"])  # of motors that share joints, if any do
told = ("commands", "base_position", "base_orientation", "external_force", "external_torque")
for step in range(-500, round(motion["time"][-1] / model.opt.timestep)):  # half a second holds the start
    t = step * model.opt.timestep
    now = {name: [np.interp(t, motion["time"], x) for x in motion[name].T] for name in told}
    data.ctrl[:] = now["commands"]
    data.body("object").xfrc_applied[:] = now["external_force"] + now["external_torque"]
    if model.nmocap:  # a palm that moves
        data.mocap_pos[0], data.mocap_quat[0] = now["base_position"], now["base_orientation"]
    mujoco.mj_step(model, data)
print("object", *data.body("object").xpos, *data.body("object").xquat, "planned", *motion["object_position"][-1])
