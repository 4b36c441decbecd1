"""Fresh virtual environments with this package in them, and what pyproject.toml asks of them."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]


def project() -> dict[str, Any]:
    """pyproject.toml as a dictionary."""
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def lowest(requirements: Sequence[str]) -> dict[str, str]:
    """The lowest version that each requirement allows.

    Args:
        requirements: such as ``numpy>=2.0`` or ``pin>=3.7,<5``.

    Returns:
        Versions by name, in the same order.

    Raises:
        ValueError: a requirement has no lower bound.
    """
    found = {}
    for requirement in requirements:
        match = re.match(r"([\w.-]+)(?:\[.*?\])?\s*(?:>=|==|~=)\s*([\w.]+)", requirement)
        if match is None:
            raise ValueError(f"{requirement} has no lower bound")
        found[match[1]] = match[2]
    return found


def fresh(folder: Path, python: str = sys.executable) -> Path:
    """A new virtual environment, without this package.

    Args:
        folder: where it is made; what it held before is removed.
        python: the interpreter it is made with.

    Returns:
        Its interpreter.
    """
    subprocess.run([python, "-m", "venv", "--clear", folder], check=True)
    inside = folder / "bin" / "python"
    # An old pip has no constraints for what is needed to build.
    subprocess.run([inside, "-m", "pip", "install", "--quiet", "--upgrade", "pip>=25.3"], check=True)
    return inside


def install(python: Path, what: Sequence[str], pinned: Mapping[str, str], constraints: Path) -> None:
    """Install with versions fixed, both of what is installed and of what builds it.

    Args:
        python: an interpreter of `fresh`.
        what: arguments of ``pip install``.
        pinned: versions by name; a package that is not among them gets the newest version that fits.
        constraints: the file to write them to.
    """
    constraints.write_text("".join(f"{name}=={version}\n" for name, version in pinned.items()), encoding="utf-8")
    command: list[str | Path] = [python, "-m", "pip", "install", "--quiet"]
    command += ["-c", constraints, "--build-constraint", constraints]
    # pip reads these, too, and they would add to the versions fixed here.
    outside = {name: value for name, value in os.environ.items() if not name.endswith("_CONSTRAINT")}
    subprocess.run([*command, *what], check=True, cwd=ROOT, env=outside)


def installed(python: Path) -> dict[str, str]:
    """Versions of all packages of an environment, by name as pyproject.toml spells it."""
    listed = subprocess.run(
        [python, "-m", "pip", "list", "--format", "json"], check=True, capture_output=True, text=True
    ).stdout
    return {normal(each["name"]): each["version"] for each in json.loads(listed)}


def normal(name: str) -> str:
    """A package's name as registries compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()
