"""The commands: what they print, where, and how they exit."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import webbrowser
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import casadi_hands
from casadi_hands.cli import main
from casadi_hands.cli.app import Stage, app
from casadi_hands.export.design import Design
from casadi_hands.export.mjcf import scene_mjcf
from casadi_hands.pipeline import Progress
from casadi_hands.pipeline.alternatives import Alternative
from casadi_hands.task import load_task
from casadi_hands.task.palm_place import standing
from casadi_hands.verify import Perturbation, Replay, Replays
from casadi_hands.verify.replays.replay import GoalError
from tests.export.example import TASK, example_design, example_task
from tests.pipeline.alternatives.example import certified, shifted, without_hand
from tests.verify.fixture import Scene, carried

PROBLEMS = Path(__file__).parents[2] / "problems"
CAPSULE = PROBLEMS / "horizontal_translation.yaml"


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return carried(tmp_path_factory.mktemp("task"))


def run(*arguments: Any) -> Any:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def solve_gives(monkeypatch: pytest.MonkeyPatch, outcome: Any) -> list[dict[str, Any]]:
    """Let solve return or raise ``outcome`` after some progress; the calls it gets."""
    calls: list[dict[str, Any]] = []

    def solve(task: Any, **settings: Any) -> Any:
        calls.append({"task": task, **settings})
        for stage, text, elapsed in (
            ("floating", "first", 0.0),
            ("floating", "too soon after the first", 1.0),
            ("floating", "six seconds later", 6.0),
            ("synthesis", "finger [thumb], 2 joints", 6.5),
        ):
            settings["progress"](Progress(stage, text, elapsed))
        if isinstance(outcome, BaseException):
            raise outcome
        return outcome

    monkeypatch.setattr("casadi_hands.pipeline.solve", solve)
    return calls


def test_help_names_every_command() -> None:
    text = run("--help").output
    assert all(name in text for name in ("solve", "check", "view", "audit", "replay", "fields", "--version"))


def test_version() -> None:
    assert run("--version").output == f"casadi-hands {casadi_hands.__version__}\n"


def test_nothing_heavy_is_imported_before_a_command_runs() -> None:
    code = (
        "import sys, casadi_hands, casadi_hands.cli.app;"
        "print([name for name in ('casadi', 'numpy', 'pinocchio') if name in sys.modules])"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout == "[]\n"


def test_public_names_are_what_they_say() -> None:
    assert casadi_hands.load_task is load_task
    assert casadi_hands.Design is Design
    assert set(casadi_hands.__all__) <= set(dir(casadi_hands))
    with pytest.raises(AttributeError, match="no attribute 'solv'"):
        casadi_hands.solv  # noqa: B018


def test_stages_are_those_of_the_pipeline() -> None:
    from casadi_hands.pipeline import STAGES

    assert tuple(Stage) == STAGES


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["check", "no.yaml"], "no.yaml: no such file"),
        (["solve", "no.yaml"], "no.yaml: no such file"),
        (["solve", str(CAPSULE), "--executor", "here:1"], "executor: given 'here:1'; allowed: dask://HOST:PORT"),
        (["audit", "no-folder"], "no-folder: not a directory"),
        (["view", "no-folder"], "no-folder: there is no such folder"),
    ],
)
def test_bad_input_is_one_message_and_exit_2(
    arguments: list[str], message: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["casadi-hands", *arguments])
    with pytest.raises(SystemExit) as exit_:
        main()
    out, err = capsys.readouterr()
    assert (exit_.value.code, out) == (2, "")
    assert err.startswith(f"casadi-hands: {message}")
    assert "Traceback" not in err


@pytest.mark.parametrize(
    "arguments",
    [
        ["solve"],
        ["solve", "t.yaml", "--until", "never"],
        ["solve", "t.yaml", "--seeds", "0"],
        ["solve", "t.yaml", "--from", "d", "--seeds", "2"],
        ["solve", "t.yaml", "--from", "d", "--until", "synthesis"],
        ["replay", "d", "--perturb", "-1"],
    ],
)
def test_wrong_arguments_exit_2(arguments: list[str]) -> None:
    assert run(*arguments).exit_code == 2


def test_check_says_how_a_task_is_understood() -> None:
    text = " ".join(run("check", PROBLEMS / "pick_up_and_rotate.yaml").output.split())
    task = load_task(PROBLEMS / "pick_up_and_rotate.yaml")
    assert f"{task.object.mass:g} kg; 1 capsule" in text
    assert "the program may move it" in text
    assert f"ground at {1e3 * task.ground.height:.4g} mm" in text  # type: ignore[union-attr]
    assert all(f"{name} touches the object at" in text for name in task.fingers)
    assert text.count(" s: [") == len(task.motion)


def test_check_says_how_hard_contacts_may_press() -> None:
    text = " ".join(run("check", PROBLEMS / "pill_turn.yaml").output.split())
    weight = load_task(PROBLEMS / "pill_turn.yaml").force_unit
    assert f"contact forces of at most 20 weights ({20 * weight:.3g} N) along each axis of the object" in text


@pytest.mark.parametrize(("motors", "words"), [("fewest", "as few as will do"), ("2", "at most 2 for all joints")])
def test_check_says_what_hands_may_be_like(motors: str, words: str, tmp_path: Path) -> None:
    path, text = tmp_path / "pill.yaml", (PROBLEMS / "pill_turn.yaml").read_text(encoding="utf-8")
    path.write_text(f"{text}\nmotors: {motors}\nhand: {{bend: 30, axes: {{from_link: [70, 85]}}}}\n", encoding="utf-8")
    said = " ".join(run("check", path).output.split())
    assert f"motors of 1 N·m/rad, without limits, {words} axes 70 to 85 deg from their links, links bent by" in said
    assert "by at most 30 deg; of 1240 kg/m³, 26 MPa; fingertips resist a twist by 0.637 mm times their force" in said
    # Points are moved to the centre of mass, by which lengths differ in their last digit.
    handle = PROBLEMS.parent / "examples" / "everyday" / "door_handle.yaml"
    assert "changed from their defaults" not in " ".join(run("check", handle).output.split())


@pytest.mark.parametrize("command", [("check",), ("solve", "--jobs", "1", "--out", "out")])
def test_what_no_hand_can_do_is_told_at_once_and_exits_1(
    command: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "away.yaml"
    text = (PROBLEMS / "pill_turn.yaml").read_text()
    path.write_text(text.replace("facing: [0, 0, -1]", "facing: [0, 0, 1]"))
    found = run(command[0], path, *command[1:])
    assert found.exit_code == 1
    assert "the object is behind the palm at every goal" in " ".join(found.output.split())


def test_check_prints_lengths_in_mm_and_principal_inertia(tmp_path: Path) -> None:
    path = tmp_path / "ball.yaml"
    path.write_text(
        """
object: {mass: 0.5, shapes: [{sphere: {center: [0, 0, 0], radius: 0.02}}]}
palm: {radius: 0.04, position: [0, 0, 0.1], facing: [0, 0, -1]}
motion: [{at: 0, position: [0, 0, 0]}, {at: 1.25, position: [0, 0, 0.01]}]
fingers: {one: {touches: [0.0205, 0, 0]}}
gravity: [0, 0, 0]
limits: {slip: 0.005}
"""
    )
    text = " ".join(run("check", path).output.split())
    # A solid sphere has 2/5 m r² = 8e-5 kg·m²; the contact moves onto its surface.
    for part in (
        "[8e-05, 8e-05, 8e-05] kg·m²",
        "40 mm at its longest",
        "one touches the object at [20, 0, 0] mm",
        "1.25 s: [0, 0, 10] mm, upright",
        "1.25 s, 2 keyframes between goals",
        "no gravity; friction 0.5; no ground",
        "slip 0.005",
    ):
        assert part in text


def test_solve_passes_its_options_on(task_file: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    calls = solve_gives(monkeypatch, example_design())
    run("solve", task_file, "--out", tmp_path / "out", "--seed", 4, "--jobs", 2, "--until", "whole_hand")
    call = calls[0]
    assert call["task"] == load_task(task_file)
    assert (call["seed"], call["jobs"], call["until"], call["out"]) == (4, 2, "whole_hand", tmp_path / "out")


def test_solve_starts_from_an_earlier_result(task_file: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    start = tmp_path / "alternatives" / "seed3"
    example_design().save(start)
    calls = solve_gives(monkeypatch, example_design())
    was_there: list[bool] = []
    made_up = casadi_hands.pipeline.solve
    monkeypatch.setattr(
        "casadi_hands.pipeline.solve",
        lambda *given, **named: (was_there.append((start / "result.json").exists()), made_up(*given, **named))[1],
    )
    run("solve", task_file, "--from", start, "--out", tmp_path, "--seed", 2, "--jobs", 1)
    (call,) = calls
    assert (call["start"], call["seed"], call["jobs"], call["until"]) == (start, 2, 1, "refine")
    # Alternatives of an earlier solve go, but not before one of them has been the start.
    assert was_there == [True]
    assert not start.exists()


def test_one_message_says_what_does_not_go_with_an_earlier_result(task_file: Path) -> None:
    found = run("solve", task_file, "--from", "there", "--seeds", 2, "--until", "floating")
    assert found.exit_code == 2
    assert "one hand is refined, to the end: give neither --seeds nor --until" in " ".join(
        found.stderr.replace("│", " ").split()
    )


def test_solve_writes_to_results_by_default(task_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = solve_gives(monkeypatch, example_design())
    run("solve", task_file)
    assert (calls[0]["out"], calls[0]["seed"], calls[0]["jobs"], calls[0]["until"]) == (
        Path("results/carry"),
        None,
        None,
        "refine",
    )


@pytest.mark.parametrize(("status", "code"), [("certified", 0), ("feasible", 0), ("failed", 1)])
def test_exit_status_of_solve(status: str, code: int, task_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    solve_gives(monkeypatch, replace(example_design(), status=status))
    assert run("solve", task_file).exit_code == code


def test_summary_of_a_solve(task_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    certificate = {
        "slip": {"value": 0.0142, "limit": 0.0002, "holds": False, "unit": "m", "where": "contact 'thumb'"},
        "spin": {"value": 7.5, "limit": None, "holds": True, "unit": "deg", "where": ""},
    }
    design = replace(example_design(), certificate=certificate, reason="contact 'thumb' slips [14.2 mm]")
    solve_gives(monkeypatch, design)
    lines = [line.split() for line in run("solve", task_file, "--out", "there").stdout.splitlines()]
    text = "\n".join(" ".join(words) for words in lines)
    assert ["slip", "14.2", "0.2", "mm", "missed"] in lines
    assert ["spin", "7.5", "deg"] in lines
    assert "move a capsule & back: feasible" in text
    assert "joints: thumb 2, index 2, middle 2; 6 in all" in text
    assert "contact 'thumb' slips [14.2 mm]" in text
    assert "casadi-hands view there" in text


def test_solve_of_the_first_stage_for_real(tmp_path: Path) -> None:
    found = run(
        "solve", PROBLEMS / "horizontal_translation.yaml", "--until", "floating", "--jobs", 1, "--out", tmp_path
    )
    assert found.exit_code == 0, found.output
    motion = Design.load(tmp_path).motion
    assert motion is not None
    # The goals of the task: 2.5 cm to either side of the palm.
    at = [float(np.interp(time, motion.time, motion.object_position[:, 1])) for time in (0.0, 1.0, 3.0, 4.0)]
    assert at == pytest.approx([0.0, 0.025, -0.025, 0.0], abs=1e-3)
    assert "casadi-hands view" in found.stdout


def test_several_seeds_are_listed_best_first(task_file: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    twin, other = certified(friction_use=0.6, torque=0.25), certified(shifted(0.03), friction_use=0.7)
    failed = replace(without_hand(), status="failed", reason="no grip at [2 s]")
    designs = {4: other, 5: certified(torque=0.125), 6: twin, 7: failed}
    seeds: list[int] = []

    def solve(task: Any, *, seed: int, out: Path, **settings: Any) -> Design:
        seeds.append(seed)
        designs[seed].save(out)
        return designs[seed]

    monkeypatch.setattr("casadi_hands.pipeline.alternatives.seeds.solve", solve)
    found = run("solve", task_file, "--seed", 4, "--seeds", 4, "--out", tmp_path / "out")
    assert (found.exit_code, seeds) == (0, [4, 5, 6, 7])
    text = " ".join(found.stdout.split())
    rows = (
        "5 certified 2+2+2 50 0.125 alternatives/seed5",
        "6 certified 2+2+2 40 0.25 dropped: like",
        "4 certified 2+2+2 30 0.1 alternatives/seed4",
        "7 failed no grip at [2 s]",
    )
    places = [text.index(row) for row in rows]
    assert places == sorted(places)
    assert Design.load(tmp_path / "out").certificate == designs[5].certificate


def test_seeds_begin_with_the_tasks(task_file: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    asked: list[Any] = []

    def explore(task: Any, *, seeds: Any, **settings: Any) -> list[Alternative]:
        asked.append((list(seeds), settings["jobs"], settings["until"], settings["out"]))
        return [Alternative(9, replace(example_design(), status="failed"), kept=False)]

    monkeypatch.setattr("casadi_hands.pipeline.alternatives.explore", explore)
    task_file.write_text(TASK + "search: {seed: 9}\n")
    found = run("solve", task_file, "--seeds", 3, "--jobs", 2, "--until", "whole_hand", "--out", tmp_path)
    assert asked == [([9, 10, 11], 2, "whole_hand", tmp_path)]
    assert found.exit_code == 1


def test_one_seed_leaves_no_alternatives_of_an_earlier_solve(
    task_file: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    example_design().save(tmp_path / "alternatives" / "seed3")
    solve_gives(monkeypatch, example_design())
    found = run("solve", task_file, "--out", tmp_path)
    assert not (tmp_path / "alternatives").exists()
    assert "Hands from all seeds" not in found.stdout


def test_progress_comes_in_lines_at_a_modest_rate(task_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    solve_gives(monkeypatch, example_design())
    lines = [" ".join(line.split()) for line in run("solve", task_file).stderr.splitlines()]
    assert lines == [
        "0:00 floating first",
        "0:06 floating six seconds later",
        "0:06 synthesis finger [thumb], 2 joints",
    ]


ENDLESS = """
import os
import sys
import casadi as ca
import casadi_hands.pipeline
from casadi_hands.cli import main
from casadi_hands.export.design import Design
from casadi_hands.export.place import owned
from casadi_hands.pipeline.keeper import Keeper
from casadi_hands.pipeline.unfinished import Unfinished

def solve(task, out, **settings):
    x = ca.SX.sym("x", 300)
    cost = ca.sumsqr(ca.sin(3 * x[1:]) - x[:-1] ** 2) + ca.sumsqr(ca.cos(10 * x))
    options = {"print_time": False, "ipopt.print_level": 0, "ipopt.max_iter": 1000, "ipopt.tol": 1e-30}
    options |= {"ipopt.acceptable_tol": 1e-30, "ipopt.hessian_approximation": "limited-memory"}
    solver = ca.nlpsol("solver", "ipopt", {"x": x, "f": cost}, options)
    with owned(out) as place:
        if "EARLIER" in os.environ:
            Keeper(out, before=Unfinished(place).wrote).keep(Design.load(os.environ["EARLIER"]))
        print("solving", flush=True)
        while True:
            solver(x0=ca.linspace(0, 30, 300))

casadi_hands.pipeline.solve = solve
sys.argv = ["casadi-hands", "solve", *sys.argv[1:]]
main()
"""


@pytest.mark.parametrize(
    ("there", "writes", "words"),
    [
        (False, False, "no stage was complete"),
        (True, False, "the result in {out} is an earlier one"),
        (True, True, "what was computed is in {out}, which is feasible"),
    ],
)
def test_interrupt_ends_a_solve_in_the_midst_of_ipopt(
    there: bool, writes: bool, words: str, task_file: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    if there:
        example_design().save(out)

    def heed_interrupts() -> None:
        # What a shell runs in the background ignores them, and hands that down.
        signal.signal(signal.SIGINT, signal.default_int_handler)

    command = [sys.executable, "-c", ENDLESS, str(task_file), "--out", str(out)]
    surroundings = {**os.environ, **({"EARLIER": str(out)} if writes else {})}
    with subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=surroundings,
        preexec_fn=heed_interrupts,
    ) as process:
        assert process.stdout
        assert process.stdout.readline() == "solving\n"
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=30)
    assert process.returncode == 130
    assert words.format(out=out) in err
    assert "Traceback" not in err


def test_audit_holds_or_names_what_does_not(scene: Scene, tmp_path: Path) -> None:
    good = run("audit", scene.write(tmp_path / "good"))
    assert good.exit_code == 0, good.output
    assert "missed" not in good.output
    scaled = scene.moved(contact_force=1.02 * scene.motion.contact_force)
    bad = run("audit", scaled.write(tmp_path / "bad"))
    assert bad.exit_code == 1
    rows = [line.split() for line in bad.output.splitlines()]
    assert any(row[:1] == ["residual"] and row[-1] == "missed" for row in rows)
    assert "that nothing exerts moves the object" in " ".join(bad.output.split())


def test_an_audit_without_replays_says_so(scene: Scene, tmp_path: Path) -> None:
    good = scene.write(tmp_path / "good")
    (good / "viewer.html").write_text("<h1>certified</h1>", encoding="utf-8")
    files = run("audit", good, "--replays", 0)
    assert files.exit_code == 0
    assert files.output.splitlines()[0].endswith(": the files hold; not replayed")
    assert "note: not looked at: viewer.html" in " ".join(files.output.split())
    assert run("audit", good).output.splitlines()[0].endswith(": certified")


def test_the_module_is_the_command() -> None:
    said = subprocess.run([sys.executable, "-m", "casadi_hands", "--help"], capture_output=True, text=True, check=True)
    assert "solve" in said.stdout


def test_audit_as_json(scene: Scene, tmp_path: Path) -> None:
    record = json.loads(run("audit", scene.write(tmp_path / "good"), "--json").stdout)
    assert (record["certified"], record["reasons"]) == (True, [])
    assert record["certificate"]["slip"]["limit"] == scene.task.limits.slip


def test_replay_prints_errors_and_drops(monkeypatch: pytest.MonkeyPatch) -> None:
    import casadi_hands.verify

    def outcome(millimetres: float, dropped: bool = False) -> Replay:
        errors = (1e-3 * millimetres, 2e-3 * millimetres, 3e-3 * millimetres, 0.5, 0.75, 0.25)
        goals = (GoalError(1e-3 * millimetres, 0.5),) * 3
        return Replay(*errors, dropped, ("thumb",) if dropped else (), Perturbation(), goals)

    many = [outcome(1.0), outcome(2.0), outcome(900.0, dropped=True), *[outcome(1.0)] * 17]
    asked: list[tuple[Any, ...]] = []

    def run_replays(*arguments: Any) -> Replays:
        asked.append(arguments)
        perturbed = {f"number {k}": each for k, each in enumerate(many[: arguments[1]])}
        return Replays("mujoco", example_task(), 1e-3, 7, nominal, perturbed)

    nominal = outcome(0.5)
    monkeypatch.setattr(casadi_hands.verify, "run_replays", run_replays)
    found = run("replay", "folder", "--perturb", 20, "--seed", 7, "--jobs", 2)
    rows = [" ".join(line.split()) for line in found.output.splitlines()]
    assert asked == [(Path("folder"), 20, 7, 2, "mujoco")]
    assert "as planned 0.5 1 1.5 0.5 0.75 0.25" in rows
    assert "19 perturbed, mean 1.05 2.11 3.16 0.5 0.75 0.25" in rows
    assert "19 perturbed, worst 2 4 6 0.5 0.75 0.25" in rows
    assert "from goal 3: 0.5 mm, 0.5 deg" in rows
    assert "perturbed: dropped in 1 of 20" in rows
    assert found.exit_code == 0
    # One in three is more than one in twenty; an object that is far from a goal is, too, and one that is dropped.
    found = run("replay", "folder", "--perturb", 3)
    assert found.exit_code == 1
    assert "1 of 3 perturbed replays drop the object (number 2), 33.3 %; limit 5 %" in " ".join(found.output.split())
    nominal = outcome(4.0)
    found = run("replay", "folder")
    assert found.exit_code == 1
    assert "in MuJoCo the object is 4 mm from goal 1 at 0 s; limit 3 mm" in found.output
    nominal = outcome(0.5, dropped=True)
    assert run("replay", "folder").exit_code == 1


def test_replay_plays_a_folder(scene: Scene, tmp_path: Path) -> None:
    folder = scene.write(tmp_path / "good")
    (folder / "scene.xml").write_text(scene_mjcf(scene.task, scene.hand, scene.motion))
    found = run("replay", folder)
    assert found.exit_code == 0, found.output
    expected = casadi_hands.replay(folder)
    assert f"as planned {1e3 * expected.position_mean:.3g} " in " ".join(found.output.split())


def test_view_opens_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    example_design().save(tmp_path)
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda address: opened.append(address) or True)
    assert run("view", tmp_path).exit_code == 0
    assert opened == [(tmp_path / "viewer.html").resolve().as_uri()]


def test_check_shows_the_contacts_that_it_finds(tmp_path: Path) -> None:
    path = tmp_path / "ball.yaml"
    path.write_text(
        """
object: {mass: 0.1, shapes: [{sphere: {center: [0, 0, 0], radius: 0.03}}]}
palm: {position: [0, 0, 0.3], facing: [0, 0, -1]}
motion: [{at: 0, position: [0, 0, 0.22]}, {at: 2, position: [0, 0, 0.2]}]
fingers: 3
"""
    )
    found = run("check", path)
    text = " ".join(found.output.split())
    assert found.exit_code == 0
    assert text.count(" touches the object at [") == text.count("placed by the program: anywhere") == 3
    assert "so that springs in place of motors withstand pushes of half the weight and torques along any axis" in text
    assert "set grip reach stiffness off side-on contacts, mm 1 " in text
    path.write_text(
        path.read_text().replace(
            "fingers: 3", "fingers: {a: {touches: {near: [0, 0, -0.03], within: 0.001}}, b: {touches: anywhere}}"
        )
    )
    found = run("check", path)
    assert found.exit_code == 1
    assert "no hand can do this: contact 'a' (within 1 mm of [0.0, 0.0, -0.03] m)" in " ".join(found.output.split())


def test_check_tells_where_the_palm_was_placed_and_draws_other_sets(tmp_path: Path) -> None:
    path, page = tmp_path / "ball.yaml", tmp_path / "ball.html"
    path.write_text(
        """
object: {mass: 0.1, shapes: [{sphere: {center: [0, 0, 0], radius: 0.03}}]}
palm: auto
motion: [{at: 0, position: [0, 0, 0.22]}, {at: 2, position: [0, 0, 0.2]}]
fingers: 3
"""
    )
    found = run("check", path, "--show", page)
    assert found.exit_code == 0
    # As `solve` and placement.json say it, of the palm before contacts are placed.
    assert f"placed by the program: {standing(load_task(path))}" in " ".join(found.output.split())
    assert "set 1 of" in page.read_text()
    assert "finger1 (2)" in page.read_text()
