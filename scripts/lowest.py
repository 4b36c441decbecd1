"""Run the fast tests with the lowest version of every dependency that pyproject.toml allows, in a fresh environment."""

from __future__ import annotations

import subprocess
import sys
from argparse import ArgumentParser
from pathlib import Path
from tempfile import TemporaryDirectory

from environments import ROOT, fresh, install, installed, lowest, normal, project


def main() -> int:
    """Build the environment, print what is in it and run the tests.

    Returns:
        The exit status of pytest.
    """
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("tests", nargs="*", default=["tests"], help="files or folders of tests; default: all")
    parser.add_argument("--python", default=sys.executable, help="interpreter of the environment; default: this one")
    parser.add_argument("--jobs", type=int, default=2, help="processes of pytest; default: 2")
    parser.add_argument("--keep", type=Path, help="folder for the environment; default: a temporary one")
    options = parser.parse_args()

    pinned = lowest(project()["project"]["dependencies"])
    with TemporaryDirectory() as folder:
        python = fresh(options.keep or Path(folder) / "venv", options.python)
        # Editable: Python in this folder sees the sources first, and only what is installed has the compiled part.
        install(python, ["-e", ".[test]"], pinned, Path(folder) / "lowest.txt")
        versions = installed(python)
        for name in pinned:
            print(f"{name}=={versions[normal(name)]}", flush=True)
        tests = ["-m", "pytest", "-q", "-x", "-n", str(options.jobs), *options.tests]
        return subprocess.run([python, *tests], cwd=ROOT, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
