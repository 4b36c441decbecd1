"""The files as programs see them that check robots before they are simulated."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from casadi_hands.export.design import Design
from casadi_hands.export.folder import save_design
from tests.export.example import example_design, example_motion

pytest.importorskip("simcheck", reason="needs simcheck, of the test extra")
pytest.importorskip("mjcf_doctor", reason="needs mjcf-doctor, of the test extra")


def still() -> Design:
    return example_design()


def moving() -> Design:
    """A palm that moves, and the least motors that a hand has whose motion asks nothing of them."""
    design = example_design()
    assert design.hand is not None
    hand = replace(design.hand, effort=0.01 * 0.1 * 9.81 * 0.06, velocity=0.01)
    return replace(design, hand=hand, motion=example_motion(palm_shift=(0.0, 0.02, 0.05)))


@pytest.fixture(scope="module", params=[still, moving])
def folder(request, tmp_path_factory) -> Path:
    directory: Path = tmp_path_factory.mktemp("design")
    save_design(request.param(), directory, page=False)
    return directory


def said(module: str, *arguments: str, at: Path) -> str:
    command = [sys.executable, "-m", module, *arguments]
    done = subprocess.run(command, cwd=at, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def checked(folder: Path, *arguments: str) -> dict:
    options = ("--no-config", "--no-cache", "--engines", "mujoco", "--fail-on", "never", "--json", "-")
    return json.loads(said("simcheck", "check", *arguments, *options, at=folder))


def complaints(report: dict) -> set[str]:
    """Ids of the checks that found an error or a warning."""
    return {
        result["id"]
        for result in report["results"]
        if any(finding["severity"] in ("error", "warning") for finding in result["findings"])
    }


# The example's joints turn by half a turn either way, so that its fingers may well meet its palm.
WIDE = {"kinematics.pass_through"}


@pytest.mark.parametrize(("file", "known"), [("hand.urdf", WIDE), ("object.urdf", set()), ("scene.xml", set())])
def test_simcheck_finds_no_errors_and_no_warnings(folder, file, known):
    # Told nothing it takes the free object of the scene for the robot's base, and would drop the robot.
    report = checked(folder, file, *(["--fixed-base"] if file == "scene.xml" else []))
    assert report["counts"]["error"] == 0
    assert complaints(report) <= known
    assert report["stats"]["kind"] == ("object" if file == "object.urdf" else "robot")


@pytest.mark.parametrize(
    ("right", "wrong", "check"),
    [
        ('effort="', 'effort="0" was="', "joints.drive"),
        ('velocity="', 'velocity="0" was="', "joints.drive"),
        ('mass value="', 'mass value="-', "inertia.mass"),
    ],
)
def test_simcheck_would_have_found(folder, right, wrong, check):
    text = (folder / "hand.urdf").read_text()
    (folder / "spoilt.urdf").write_text(text.replace(right, wrong))
    assert check in complaints(checked(folder, "spoilt.urdf"))


@pytest.mark.parametrize("file", ["hand.urdf", "object.urdf", "scene.xml"])
def test_mjcf_doctor_finds_no_errors_and_no_warnings(folder, file):
    text = said("mjcf_doctor", "check", file, "--json", at=folder)
    (report,) = json.loads(text[text.index("[\n") :])
    assert report["file"] == file
    assert (report["errors"], report["warnings"]) == (0, 0), report["findings"]
