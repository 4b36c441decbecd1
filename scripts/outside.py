"""Let other programs load and play solved designs, and print tables of what they say.

    python scripts/outside.py results/gallery/* --json docs/benchmarks

For every result folder with a scene: how far the object moves in two seconds of MuJoCo at the keyframe ``start`` with
that keyframe's commands held; where ``examples/play.py`` ends against the replay; whether MuJoCo and Drake drop it,
unperturbed and in five perturbed replays; what Pinocchio, MuJoCo, yourdfpy and Drake make of ``hand.urdf``; what
simcheck and mjcf-doctor find.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
from outside_models import disagreement
from scipy.spatial.transform import Rotation
from shared import options_of, table_text
from tables import add_json, write_record

from casadi_hands.export.design import Design
from casadi_hands.verify import replay, replay_many

PLAYER = Path(__file__).parents[1] / "examples" / "play.py"
PERTURBED = 5
HEAD = ("task", "joints", "held 2 s, mm", "player − replay", "models differ by", "checkers: errors, warnings")
ENGINES_HEAD = ("task", "MuJoCo: mean", "Drake: mean", "MuJoCo drops", "Drake drops", "agree")


def main() -> None:
    """Write both tables."""
    parser = options_of(__doc__)
    parser.add_argument("folders", metavar="DIR", nargs="+", type=Path, help="result folders")
    parser.add_argument("--out", type=Path, help="Markdown file for the tables")
    parser.add_argument("--jobs", type=int, default=1, help="processes for the replays")
    add_json(parser)
    given = parser.parse_args()
    rows, engines, same = [], [], []
    for folder in given.folders:
        if not (folder / "scene.xml").is_file():
            print(f"{folder}: no scene", file=sys.stderr)
            continue
        design = Design.load(folder)
        assert design.hand is not None
        joints = "+".join(str(len(finger.links)) for finger in design.hand.fingers)
        played = {
            name: [replay(folder, engine=name), *replay_many(folder, PERTURBED, 0, given.jobs, name)]
            for name in ("mujoco", "drake")
        }
        rows.append(
            (
                design.task.name,
                joints,
                f"{1e3 * zero_order_hold(folder):.2f}",
                apart(folder, design),
                *loaded(folder, design),
            )
        )
        first, second = ([each.dropped for each in those] for those in played.values())
        agree = [a == b for a, b in zip(first, second, strict=True)]
        same += agree
        means = [f"{1e3 * each.position_mean:.2g} mm · {each.angle_mean:.2g}°" for each, *_ in played.values()]
        engines.append((design.task.name, *means, marks(first), marks(second), f"{sum(agree)}/{len(agree)}"))
        print(" | ".join((*rows[-1], *engines[-1][1:])), flush=True)
    write_record(given.json, "outside", HEAD, rows)
    write_record(given.json, "engines", ENGINES_HEAD, engines)
    share = 100 * np.mean(same)
    text = (
        f"{table_text(HEAD, rows)}\n{table_text(ENGINES_HEAD, engines)}\n"
        f"The engines agree on hold or drop in {sum(same)} of {len(same)} replays, {share:.1f} %.\n"
    )
    print(text)
    if given.out is not None:
        given.out.write_text(text, encoding="utf-8")


def zero_order_hold(folder: Path) -> float:
    """How far the object moves, m, in two seconds at the keyframe ``start``, by MuJoCo alone."""
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    start = data.body("object").xpos.copy()
    for _ in range(round(2.0 / model.opt.timestep)):
        mujoco.mj_step(model, data)
    return float(np.linalg.norm(data.body("object").xpos - start))


def apart(folder: Path, design: Design) -> str:
    """How far the player's end is from the replay's, by their errors against the plan."""
    said = subprocess.run([sys.executable, str(PLAYER), str(folder)], capture_output=True, text=True, check=True).stdout
    pose = np.array([float(word) for word in said.split()[1:8]])
    motion, nominal = design.motion, replay(folder)
    assert motion is not None
    away = float(np.linalg.norm(pose[:3] - motion.object_position[-1]))
    planned, turned = (Rotation.from_quat(q, scalar_first=True) for q in (motion.object_orientation[-1], pose[3:]))
    angle = float(np.rad2deg((planned.inv() * turned).magnitude()))
    return f"{1e3 * (away - nominal.position_final):.1g} mm · {angle - nominal.angle_final:.1g}°"


def loaded(folder: Path, design: Design) -> tuple[str, str]:
    """The largest relative difference of what four libraries make of the hand, and what two checkers find."""
    return f"{disagreement(folder, design):.1g}", checked(folder)


def checked(folder: Path) -> str:
    """Errors and warnings of simcheck and mjcf-doctor over ``hand.urdf`` and ``scene.xml``."""
    files = [str(folder / name) for name in ("hand.urdf", "scene.xml")]
    levels = []
    # In a scene simcheck frees all that has no joint, a mocap body too, which MuJoCo then refuses: its base is fixed.
    for file, base in zip(files, ([], ["--fixed-base"]), strict=True):
        command = ["simcheck", "check", file, *base, "--json", "-"]
        found = json.loads(subprocess.run(command, capture_output=True, text=True, check=False).stdout)
        levels += [kind for kind in ("error", "warning") for _ in range(found["counts"][kind])]
    for file in files:
        said = subprocess.run(["mjcf-doctor", "check", file], capture_output=True, text=True, check=False).stdout
        levels += ["error"] * said.count("ERROR") + ["warning"] * said.count("WARN")
    return f"{levels.count('error')}, {levels.count('warning')}"


def marks(dropped: list[bool]) -> str:
    """One letter a replay, the one as planned first: h for held, D for dropped."""
    return "".join("D" if each else "h" for each in dropped)


if __name__ == "__main__":
    main()
