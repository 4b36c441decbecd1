"""From a task to a folder: every stage alone, tasks that cannot be done, and (slow) a whole task of the thesis."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from ruamel.yaml import YAML
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from casadi_hands import Design, load_task, solve
from casadi_hands.cli.app import app
from casadi_hands.errors import SolveError
from casadi_hands.kinematics import finger_kinematics
from casadi_hands.pipeline import STAGES, Progress
from casadi_hands.pipeline.judge import Judge
from casadi_hands.task import Task, parse_task
from casadi_hands.task.limits import Limits
from casadi_hands.verify import audit
from tests.pipeline.replayed import replayed
from tests.problem.test_model import scaled
from tests.stages.synthesis import example

PROBLEMS = Path(__file__).parents[1] / "problems"
CAPSULE = PROBLEMS / "horizontal_translation.yaml"
ALWAYS = {"result.json", "task.yaml", "motion.npz", "motion.csv", "object.urdf"}
OF_A_HAND = {"hand.urdf", "scene.xml", "viewer.html", "report.html"}
# Two fingers carry a ball 1.5 cm to the side, above a palm that looks up.
BALL = f"name: ball{example.BALL}search: {{trials: 3, recombinations: 2, max_joints: 2}}\n"
RADIUS = 0.13 * 0.06  # of its fingers' links, m
FOOT = 1.05 * RADIUS  # of the first joints above the palm's face, m
LIMITS_IN_METRES = ("goal_position", "gap", "gap_between", "slip", "penetration")


def files(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


@pytest.mark.parametrize("stage", STAGES[:-1])
def test_a_solve_stops_where_it_is_told_and_leaves_a_folder(stage: str, tmp_path: Path) -> None:
    news: list[Progress] = []
    design = solve(parse_task(BALL), jobs=1, until=stage, out=tmp_path, progress=news.append)
    done = STAGES[: STAGES.index(stage) + 1]
    assert tuple(dict.fromkeys(word.stage for word in news)) == done
    assert [word.elapsed for word in news] == sorted(word.elapsed for word in news)
    loaded = Design.load(tmp_path)
    assert (loaded.status, loaded.reason) == (design.status, design.reason)
    assert set(loaded.costs) == set(done)
    assert {run["stage"] for run in loaded.stages} == set(done)
    assert set(loaded.seconds) == {*done, "total"}
    assert (loaded.hand is None) == (stage == "floating")
    assert (loaded.motion is None) == (stage == "synthesis")
    if stage == "whole_hand":
        assert files(tmp_path) >= ALWAYS | OF_A_HAND
        assert loaded.certificate == audit(tmp_path).as_certificate()
    else:
        assert loaded.reason == f"stopped after the stage {stage}, as asked"


def test_an_unknown_stage_is_refused() -> None:
    with pytest.raises(SolveError, match="until: given 'refined'; allowed: floating, synthesis, whole_hand, refine"):
        solve(parse_task(BALL), until="refined")


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("seed", -1, "seed: given -1; allowed: an integer of at least 0"),
        ("seed", 1.5, "seed: given 1.5; allowed: an integer"),
        ("jobs", 0, "jobs: given 0; allowed: an integer of at least 1"),
    ],
)
def test_numbers_that_cannot_be_are_refused(name: str, value: Any, words: str, tmp_path: Path) -> None:
    """A seed of -1 left a folder that nothing could read."""
    with pytest.raises(SolveError, match=words):
        solve(parse_task(BALL), out=tmp_path / "out", **{name: value})
    assert not (tmp_path / "out").exists()


@pytest.fixture(scope="module")
def carried(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("carried")
    # Two fingers of two joints each, or with less friction, hold the ball no better than the replay's limits.
    text = BALL.replace("max_joints: 2", "max_joints: 3").replace("friction: 0.5", "friction: 0.8")
    solve(parse_task(text), jobs=1, out=folder)
    return folder


def test_a_small_task_is_certified_from_its_files(carried: Path) -> None:
    design, verdict = Design.load(carried), audit(carried)
    assert files(carried) == ALWAYS | OF_A_HAND
    assert verdict.reasons == []
    assert verdict.certified
    assert (design.status, design.reason) == ("certified", "")
    assert design.certificate == verdict.as_certificate()
    assert set(design.seconds) == {*STAGES, "total"}
    assert sum(design.seconds[stage] for stage in STAGES) == pytest.approx(design.seconds["total"], rel=0.5)
    for stage in STAGES:
        objective = [run["objective"] for run in design.stages if run["stage"] == stage]
        total = sum(term["value"] for term in design.costs[stage].values())
        assert any(total == pytest.approx(value, rel=1e-6) for value in objective), stage


def test_a_task_as_solved_solves_to_the_same_motion(carried: Path, tmp_path: Path) -> None:
    solve(load_task(carried / "task.yaml"), jobs=1, out=tmp_path)
    assert (tmp_path / "motion.npz").read_bytes() == (carried / "motion.npz").read_bytes()


def check_kinematics(folder: Path) -> None:
    """The exported hand, in Pinocchio, has its fingertips where the tool's own kinematics has them."""
    model = pin.buildModelFromUrdf(str(folder / "hand.urdf"))
    data, motion = model.createData(), np.load(folder / "motion.npz")
    hand = Design.load(folder).hand
    assert hand is not None
    names = motion["joint_names"].tolist()
    order = [model.joints[model.getJointId(name)].idx_q for name in names]
    for angles in motion["joint_angles"]:
        q = np.zeros(model.nq)
        q[order] = angles
        pin.framesForwardKinematics(model, data, q)
        for i, finger in enumerate(hand.fingers):
            own = [angles[names.index(f"finger{i}_joint{j}")] for j in range(len(finger.links))]
            lengths, axes = [link.length for link in finger.links], np.array([link.axis for link in finger.links]).T
            turns = np.hstack([pin.exp3(np.array([*link.bend, 0.0])) for link in finger.links])
            found = finger_kinematics(len(own))(finger.base, turns, axes, lengths, own, np.zeros(3))
            tip = np.asarray(found[2]).ravel()
            last = data.oMf[model.getFrameId(f"finger{i}_link{len(own) - 1}")]
            np.testing.assert_allclose(last.act(np.array([0, 0, lengths[-1]])), tip, atol=1e-9)


def test_the_exported_hand_has_its_fingertips_where_the_tool_has_them(carried: Path) -> None:
    check_kinematics(carried)


# What cannot be done ends with a reason, and keeps what was computed.


def changed(*changes: str) -> str:
    """The ball's task with texts replaced (``old -> new``) or added."""
    text = BALL
    for change in changes:
        old, _, new = change.partition(" -> ")
        text = text.replace(old, new) if new else text + old + "\n"
    return text


def told_of(design: Design, pattern: str) -> re.Match[str]:
    """The match of a pattern at the start of the reason why a design is not certified."""
    assert design.status in ("feasible", "failed")
    told = re.match(pattern, design.reason)
    assert told is not None, design.reason
    return told


def farthest_contact(text: str, contact: int) -> float:
    """Larger distance, m, at the two goals of a floating contact and the disc of 6 cm on which fingers stand."""
    motion = solve(parse_task(text), jobs=1, until="floating").motion
    assert motion is not None
    at = Rotation.from_quat(motion.object_orientation, scalar_first=True)
    # The palm of this task faces up with its frame along the world's, at the origin.
    points = (motion.object_position + at.apply(motion.contact_point_object[:, contact]))[[0, -1]]
    return float(np.hypot(np.maximum(np.hypot(points[:, 0], points[:, 1]) - 0.06, 0), points[:, 2] - FOOT).max())


def test_a_contact_out_of_reach_at_the_start_fails_the_task_at_once() -> None:
    # Two links of 2 cm do not span 9 cm: from (0, 60, 8.19) mm to (0, 30, 90) mm.
    design = solve(parse_task(changed("hand: {link_length: [0.016, 0.02]}")), jobs=1)
    assert design.status == "failed"
    assert design.stages == []
    far = 1e3 * np.hypot(0.03, 0.09 - FOOT)
    for finger in ("left", "right"):
        assert f"finger '{finger}' cannot reach its contact at goal 1 (0 s): that is {far:.4g} mm from" in design.reason
    assert (
        design.reason.count(f"a finger of 2 links of at most 20 mm each reaches {40 + 1e3 * RADIUS:.4g} mm; try") == 2
    )


def test_a_contact_out_of_reach_fails_the_task(tmp_path: Path) -> None:
    # A second goal 19 cm from the palm for fingers of 10 cm.
    link, names = 0.05, ("goal 2 (0.6 s)",)
    text = changed("hand: {link_radius: 0.0078, link_length: [0.016, 0.05]}", "[0, 0.015, 0.09] -> [0, 0.17, 0.09]")
    (tmp_path / "task.yaml").write_text(text)
    result = CliRunner().invoke(
        app, ["solve", str(tmp_path / "task.yaml"), "--out", str(tmp_path / "out"), "--jobs", "1"]
    )
    assert result.exit_code == 1
    design = Design.load(tmp_path / "out")
    assert design.status == "failed"
    assert design.certificate["gap"]["value"] > 0.03 - FOOT
    assert not design.certificate["gap"]["holds"]
    assert files(tmp_path / "out") == ALWAYS | OF_A_HAND
    pattern = (
        r"finger '(left|right)' cannot reach (.*?) with 2 joints: its contact is ([\d.]+) mm beyond links of at most "
        rf"{1e3 * link:.1f} mm each; try longer links \(hand\.link_length\), a palm nearer by or a nearer goal"
    )
    told = re.findall(pattern, design.reason)
    assert ". ".join(match[0] for match in re.finditer(pattern, design.reason)) == design.reason
    assert [finger for finger, _, _ in told] == ["left", "right"]
    for contact, (_, when, beyond) in enumerate(told):
        assert when in names
        wanted = farthest_contact(text, contact) - 2 * link - RADIUS
        assert float(beyond) == pytest.approx(1e3 * wanted, abs=0.5)


def test_motors_too_weak_are_named_with_what_they_must_give(tmp_path: Path) -> None:
    design = solve(parse_task(changed("actuator: {torque: 0.002, speed: 5}")), jobs=1, out=tmp_path)
    told = told_of(
        design,
        r"joint finger([01])_joint([01]) of finger '(left|right)' needs ([\d.]+) N·m at .* however .*, and the motors "
        r"give 0\.002 N·m; try stronger motors \(actuator\.torque\)",
    )
    assert ["left", "right"][int(told[1])] == told[3]
    # Each finger bears half the weight by friction of 0.5, 8 cm up from its joint, or by as much as it may press more:
    # of a hand that is not certified at most 20 weights.
    assert 0.01 < float(told[4]) < 20 * 0.08
    assert not {"torque", "unsupplied_force"} & {
        name for name, figure in design.certificate.items() if not figure["holds"] and figure["where"] in design.reason
    }
    assert files(tmp_path) == ALWAYS | OF_A_HAND
    assert Design.load(tmp_path).reason == design.reason
    # All that was tried is in the record and in its times, whichever design is returned.
    for stage in ("synthesis", "whole_hand", "refine"):
        assert sum(run["seconds"] for run in design.stages if run["stage"] == stage) <= design.seconds[stage]
    assert sum(run["what"] == "hand" for run in design.stages if run["stage"] == "whole_hand") >= 1
    assert sum(design.seconds[stage] for stage in STAGES) <= design.seconds["total"]


def test_motors_too_slow_are_named_first() -> None:
    text = changed("actuator: {torque: 1, speed: 0.1}")
    told = told_of(
        solve(parse_task(text), jobs=1),
        r"joint finger[01]_joint[01] of finger '(left|right)' turns with ([\d.]+) rad/s at .* in the motion found, "
        r"and the motors give 0\.1 rad/s; try faster motors",
    )
    # 15 mm in 0.6 s, at 1.5 times the mean in the middle, on a lever of 12 cm at most.
    assert float(told[2]) > 0.015 / 0.6 / 0.12


def test_fingers_with_too_few_joints_are_named() -> None:
    design = solve(parse_task(changed("max_joints: 2 -> max_joints: 1")), jobs=1)
    assert design.status in ("feasible", "failed")
    sentences = design.reason.split(". ")
    assert len(sentences) <= 4
    for finger in ("left", "right"):
        assert any(
            re.match(rf"finger '{finger}' cannot press as its contact needs with 1 joint: no joint actuates", sentence)
            for sentence in sentences
        ), design.reason
    assert all("; try " in sentence or "more limit" in sentence for sentence in sentences)


# Figure 3.6b as it is, from the thesis's pages.


@pytest.fixture(scope="module")
def translated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("translated")
    solve(load_task(CAPSULE), jobs=1, out=folder)
    return folder


@pytest.mark.slow
def test_an_edited_task_is_certified_from_the_earlier_result_by_refining_alone(carried: Path, tmp_path: Path) -> None:
    # The second goal 5 mm farther, a heavier ball and another friction.
    text = changed("[0, 0.015, 0.09] -> [0, 0.02, 0.09]", "mass: 0.1 -> mass: 0.12", "friction: 0.5 -> friction: 0.55")
    design = solve(parse_task(text), jobs=1, out=tmp_path, start=carried)
    assert design.status == "certified", design.reason
    assert audit(tmp_path).certified
    assert {run["stage"] for run in design.stages} == {"refine"}
    assert {run["started_from"] for run in design.stages} == {str(carried)}
    assert set(design.seconds) == {"refine", "total"}
    before = Design.load(carried)
    assert design.hand is not None
    assert before.hand is not None
    assert design.hand.joint_names == before.hand.joint_names
    assert design.motion is not None
    assert np.linalg.norm(design.motion.object_position[-1] - [0, 0.02, 0.09]) <= design.task.limits.goal_position
    again = tmp_path / "again"
    solve(parse_task(text), jobs=2, out=again, start=carried)
    assert (again / "motion.npz").read_bytes() == (tmp_path / "motion.npz").read_bytes()


@pytest.mark.slow
def test_a_capsule_s_translation_is_certified_with_two_joints_a_finger(translated: Path) -> None:
    design, verdict = Design.load(translated), audit(translated)
    assert verdict.reasons == []
    assert verdict.certified
    assert design.status == "certified"
    assert design.hand is not None
    assert [len(finger.links) for finger in design.hand.fingers] == [2, 2, 2]
    check_kinematics(translated)


@pytest.mark.slow
def test_two_jobs_give_the_very_motion_of_one(translated: Path, tmp_path: Path) -> None:
    solve(load_task(CAPSULE), jobs=2, out=tmp_path)
    assert (tmp_path / "motion.npz").read_bytes() == (translated / "motion.npz").read_bytes()


def ten_times_larger() -> Task:
    data = YAML(typ="safe").load(CAPSULE)
    data["gravity"] = [0, 0, -9.81]
    data["limits"] = {name: 10 * getattr(Limits(), name) for name in LIMITS_IN_METRES}
    return parse_task(json.dumps(scaled(data, 10.0)))


@pytest.mark.slow
def test_ten_times_larger_gives_the_same_hand_ten_times_larger(
    translated: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Links ten times larger are a thousand times heavier, beside an object that is not: replays are not similar.
    monkeypatch.setattr(Judge, "replayed", lambda self, design, jobs=1: replayed(design, 0))
    design = solve(ten_times_larger(), jobs=1, out=tmp_path)
    small = Design.load(translated)
    assert small.hand is not None
    assert design.hand is not None
    assert (design.status, design.reason) == ("certified", "")
    for one, other in zip(small.hand.fingers, design.hand.fingers, strict=True):
        np.testing.assert_allclose(np.array(other.base), 10 * np.array(one.base), rtol=1e-6, atol=1e-9)
        axes = [np.array([link.axis for link in finger.links]) for finger in (one, other)]
        np.testing.assert_allclose(axes[1], axes[0], atol=1e-6)
        lengths = [np.array([link.length for link in finger.links]) for finger in (one, other)]
        np.testing.assert_allclose(lengths[1], 10 * lengths[0], rtol=1e-6)
    motions = [np.load(folder / "motion.npz") for folder in (translated, tmp_path)]
    np.testing.assert_allclose(motions[1]["object_position"], 10 * motions[0]["object_position"], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(motions[1]["joint_angles"], motions[0]["joint_angles"], atol=1e-6)


@pytest.mark.slow
def test_almost_no_friction_is_named_with_what_would_do(tmp_path: Path) -> None:
    text = CAPSULE.read_text().replace("friction: 0.6", "friction: 0.05")
    task = parse_task(text + "search: {trials: 2, recombinations: 1, max_joints: 2}\n")
    design = solve(task, jobs=1, out=tmp_path)
    # The thumb, alone on its side, bears half the weight: it presses with 0.5 / 0.05 weights, with 2 at 0.25.
    told = told_of(
        design,
        r"at .* the contacts hold the object with friction 0\.05 only if they press with ([\d.]+) weights and more; "
        r"try friction of ([\d.]+) or more, with which 2 weights would do",
    )
    assert float(told[1]) == pytest.approx(10, rel=0.05)
    assert float(told[2]) == pytest.approx(0.25, rel=0.05)
    assert "finger '" not in design.reason.split(". ")[0]
    assert files(tmp_path) == ALWAYS | OF_A_HAND
