"""A wheel as pip builds it: it installs and runs where there is a compiler and where there is none."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TASK = """\
object: {mass: 0.1, shapes: [{sphere: {center: [0, 0, 0], radius: 0.03}}]}
palm: {position: [0, 0, 0.12], facing: [0, 0, -1]}
motion: [{at: 0, position: [0, 0, 0]}, {at: 0.6, position: [0, 0, 0.005]}]
fingers: {a: {touches: [0.03, 0, 0]}, b: {touches: [-0.015, 0.026, 0]}, c: {touches: [-0.015, -0.026, 0]}}
friction: 0.8
search: {trials: 1, recombinations: 1, max_joints: 1}
"""
SOLVE = "from casadi_hands.cli import main; import sys, casadi_hands; sys.argv[0] = 'casadi-hands'; main()"
INTERPRETED = "no C compiler found: kernels are interpreted, which is several times slower"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", str(folder), str(ROOT)]
    subprocess.run(command, check=True, timeout=1200)
    (found,) = folder.glob("*.whl")
    return found


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the package from the wheel, and no sources; what it needs is that of this environment."""
    folder = tmp_path_factory.mktemp("installed")
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", str(folder), str(wheel)]
    subprocess.run(command, check=True, timeout=300)
    return folder


def run(installed: Path, folder: Path, *words: str, compiler: bool) -> subprocess.CompletedProcess[str]:
    """The command of the wheel, with compilers in the path or without."""
    inside = {name: value for name, value in os.environ.items() if name not in ("CC", "PYTHONPATH")}
    empty = folder / "bin"
    empty.mkdir(exist_ok=True)
    inside |= {"PYTHONPATH": str(installed), "CASADI_HANDS_CACHE": str(folder / "cache"), "OMP_NUM_THREADS": "1"}
    if not compiler:
        inside["PATH"] = str(empty)
    command = [sys.executable, "-c", SOLVE, *words]
    return subprocess.run(command, capture_output=True, text=True, env=inside, cwd=folder, timeout=600, check=False)


@pytest.mark.slow
def test_a_wheel_has_its_notices_and_no_sources_of_the_extension(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    licences = {name.partition("dist-info/licenses/")[2] for name in names if "dist-info/licenses/" in name}
    assert {"LICENSE", "THIRD_PARTY.md", "casadi_hands/export/report/vendor/uPlot.LICENSE"} <= licences
    assert any(name.startswith("casadi_hands/kinematics/_extension.") for name in names)
    assert not [name for name in names if name.endswith((".cpp", ".hpp", "CMakeLists.txt"))]


@pytest.mark.slow
@pytest.mark.parametrize("compiler", [True, False], ids=["with a compiler", "without one"])
def test_a_wheel_runs(installed: Path, tmp_path: Path, compiler: bool) -> None:
    (tmp_path / "task.yaml").write_text(TASK, encoding="utf-8")
    words = ("solve", "task.yaml", "--out", "out", "--jobs", "2", "--until", "synthesis")
    where = run(installed, tmp_path, "--help", compiler=compiler)
    assert where.returncode == 0
    done = run(installed, tmp_path, *words, compiler=compiler)
    said = " ".join((done.stdout + done.stderr).split())
    assert done.returncode == 0, said
    assert "Traceback" not in said
    assert said.count(INTERPRETED) == (not compiler), said
    assert (tmp_path / "out" / "viewer.html").is_file()
    assert bool(list((tmp_path / "cache").glob("**/*.so"))) is compiler
