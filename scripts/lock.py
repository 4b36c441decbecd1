"""Write .ci/requirements.lock: the version of every package that .ci/run installs, as newest ones fit today."""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path
from tempfile import TemporaryDirectory

from environments import ROOT, fresh, install, installed, normal, project

LOCK = ROOT / ".ci" / "requirements.lock"
BUILD_TOOLS = ("cmake", "ninja")
"""What the build backend asks for where the system has none."""


def main() -> None:
    """Install the package with its tests and with what builds it in a fresh environment, and write down what came."""
    ArgumentParser(description=__doc__).parse_args()
    about = project()
    with TemporaryDirectory() as folder:
        python = fresh(Path(folder) / "venv")
        before = installed(python)
        # What builds the package stands in the same environment, so that both have one casadi.
        install(python, ["-e", ".[test]", *about["build-system"]["requires"], *BUILD_TOOLS], {}, Path(folder) / "none")
        versions = installed(python)
    ours = {normal(about["project"]["name"]), *before}
    lines = [f"{name}=={version}\n" for name, version in sorted(versions.items()) if name not in ours]
    LOCK.write_text("# Written by: python scripts/lock.py\n" + "".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
