"""What pyproject.toml, the build, the lock file and the citation say of versions is one thing."""

from __future__ import annotations

import tomllib
from importlib import import_module
from importlib.metadata import requires, version
from pathlib import Path

import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import casadi_hands
from casadi_hands.cli.examples import FOLDERS

ROOT = Path(__file__).parents[1]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
BUILD = [Requirement(each) for each in PYPROJECT["build-system"]["requires"]]
CORE = [Requirement(each) for each in PYPROJECT["project"]["dependencies"]]
TESTS = [Requirement(each) for each in PYPROJECT["project"]["optional-dependencies"]["test"]]


def locked() -> dict[str, str]:
    """The versions that .ci/run installs, by name."""
    lines = (ROOT / ".ci/requirements.lock").read_text(encoding="utf-8").splitlines()
    pins = [Requirement(line) for line in lines if not line.startswith("#")]
    assert all(len(pin.specifier) == 1 and str(pin.specifier).startswith("==") and not pin.url for pin in pins)
    return {canonicalize_name(pin.name): str(pin.specifier)[2:] for pin in pins}


def of_casadi(requirements: list[Requirement]) -> list[str]:
    return [str(each.specifier) for each in requirements if each.name == "casadi"]


def test_the_build_takes_the_casadi_that_the_package_allows() -> None:
    assert of_casadi(BUILD) == of_casadi(CORE)
    assert len(of_casadi(CORE)) == 1


def test_the_installed_package_requires_the_casadi_it_was_built_against() -> None:
    # So that pip tells of a change of casadi, or builds the extension again.
    built_with = import_module("casadi_hands.kinematics._built_with").CASADI_VERSION
    installed = [Requirement(each) for each in requires("casadi-hands") or []]
    assert f"=={built_with}" in of_casadi(installed)
    assert version("casadi") == built_with


def test_the_lock_has_a_version_that_fits_for_all_that_is_asked_for() -> None:
    versions = locked()
    unmet = [str(each) for each in BUILD + CORE + TESTS if versions[canonicalize_name(each.name)] not in each.specifier]
    assert unmet == []


def test_tasks_are_shipped_where_the_program_looks_for_them() -> None:
    packages = PYPROJECT["tool"]["scikit-build"]["wheel"]["packages"]
    assert {ROOT / source for source in packages.values()} == {ROOT / "casadi_hands", ROOT / "problems"}
    places = [FOLDERS[0].relative_to(FOLDERS[0].parents[1]).as_posix() for name in packages if "/" in name]
    assert places == [name for name in packages if "/" in name]
    size = sum(path.stat().st_size for path in (ROOT / "problems").rglob("*") if path.is_file())
    assert size < 1_000_000


def test_the_citation_is_of_this_version() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == casadi_hands.__version__
    assert citation["license"] == PYPROJECT["project"]["license"]
    assert citation["references"][0]["number"] == "CMU-RI-TR-18-36"


def test_what_others_made_is_named_in_a_file_that_every_wheel_has() -> None:
    third_party = (ROOT / "THIRD_PARTY.md").read_text(encoding="utf-8")
    assert {"LICENSE", "THIRD_PARTY.md"} <= set(PYPROJECT["project"]["license-files"])
    extras = PYPROJECT["project"]["optional-dependencies"]
    needed = [each for name, extra in extras.items() if name != "test" for each in map(Requirement, extra)]
    unnamed = [each.name for each in [*CORE, *needed] if f"`{each.name}`" not in third_party]
    built = [each.name for each in BUILD if each.name not in ("scikit-build-core", "nanobind")]
    assert unnamed + [name for name in [*built, "nanobind"] if name not in third_party] == []
