"""What is read of pyproject.toml, and how versions reach pip."""

from __future__ import annotations

import os
from importlib.metadata import version
from pathlib import Path

import environments
import pytest
import vulnerable


def test_the_lowest_version_of_each_requirement() -> None:
    found = environments.lowest(["numpy>=2.0", "ruamel.yaml >= 0.18, <1", "imageio[ffmpeg]~=2.38", "pin==4.1"])
    assert found == {"numpy": "2.0", "ruamel.yaml": "0.18", "imageio": "2.38", "pin": "4.1"}


def test_a_requirement_without_a_lower_bound_is_refused() -> None:
    with pytest.raises(ValueError, match="numpy<3 has no lower bound"):
        environments.lowest(["numpy<3"])


def test_every_dependency_of_this_package_has_a_lowest_version() -> None:
    about = environments.project()["project"]
    assert len(environments.lowest(about["dependencies"])) == len(about["dependencies"])


def test_names_are_compared_as_registries_do() -> None:
    assert environments.normal("Ruamel.Yaml_clib") == "ruamel-yaml-clib"


def test_pinned_versions_hold_for_the_build_too_and_none_come_from_outside(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    # A program in place of Python writes down how it is called.
    python, said = tmp_path / "python", tmp_path / "said"
    python.write_text(f'#!/bin/sh\necho "$@" >> {said}\nenv | grep CONSTRAINT >> {said}\nexit 0\n', encoding="utf-8")
    python.chmod(0o755)
    monkeypatch.setitem(os.environ, "PIP_CONSTRAINT", "elsewhere.txt")
    constraints = tmp_path / "pinned.txt"
    environments.install(python, ["-e", "."], {"numpy": "2.0", "casadi": "3.8"}, constraints)
    assert constraints.read_text(encoding="utf-8") == "numpy==2.0\ncasadi==3.8\n"
    assert said.read_text(encoding="utf-8").splitlines() == [
        f"-m pip install --quiet -c {constraints} --build-constraint {constraints} -e ."
    ]


def test_all_that_is_needed_in_turn_is_looked_up() -> None:
    versions = vulnerable.needed(environments.project()["project"]["dependencies"])
    # pin needs coal's library, meshcat a server of its own.
    assert {"casadi", "numpy", "pin", "libcoal", "tornado"} <= set(versions)
    assert versions["numpy"] == version("numpy")
    assert not {"pytest", "drake"} & set(versions)
    assert vulnerable.needed(["no-such-package-anywhere>=1"]) == {}
