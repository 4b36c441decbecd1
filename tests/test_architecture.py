"""The rooms of the house: what stands on what, and how large a room's modules are."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterable, Mapping
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "casadi_hands"
# What `docs/architecture.md` shows: a room imports only from rooms on lower floors, or from within itself.
FLOORS = (
    {"cache", "declared", "errors", "lifetime", "motion", "geometry"},
    {"nlp", "kinematics", "terms", "statics", "execution", "meshes"},
    {"task"},
    {"problem"},
    {"stages", "verify", "placement"},
    {"export", "diagnosis"},
    {"pipeline", "studio"},
    {"__init__", "cli"},  # and scripts
)
LONGEST = 300  # lines of a module


def modules() -> dict[str, Path]:
    """All modules of the package by their dotted name within it; a package is named by its folder."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" and len(parts) > 1 else parts)] = path
    return found


@cache
def imports() -> Mapping[str, frozenset[str]]:
    """For each module those of the package that it imports, late ones and those for type checkers too."""
    known = modules()
    found: dict[str, frozenset[str]] = {}
    for name, path in known.items():
        taken: set[str] = set()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "casadi_hands":
                base = node.module.removeprefix("casadi_hands").removeprefix(".")
                for alias in node.names:
                    full = f"{base}.{alias.name}" if base else alias.name
                    taken.add(full if full in known else base or "__init__")
            elif isinstance(node, ast.Import):
                taken |= {
                    a.name.removeprefix("casadi_hands.") for a in node.names if a.name.startswith("casadi_hands.")
                }
        found[name] = frozenset(taken - {name})
    return found


def circle(graph: Mapping[str, Iterable[str]]) -> list[str]:
    """A circle of a graph, or nothing."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def room(module: str) -> str:
    return "cli" if module == "__main__" else module.split(".")[0]


def test_no_modules_import_each_other_in_a_circle() -> None:
    assert imports()["pipeline.run"]  # the graph is not empty
    # A package imports its own modules to offer their names: what it offers is not counted as a circle with them.
    packages = {name for name, path in modules().items() if path.name == "__init__.py"}
    graph = {name: taken - packages for name, taken in imports().items()}
    assert circle(graph) == []


def test_rooms_import_only_from_lower_floors() -> None:
    floor = {name: level for level, names in enumerate(FLOORS) for name in names}
    upward = [
        f"{module} imports {other}"
        for module, taken in imports().items()
        for other in taken
        if room(module) != room(other) and floor[room(other)] >= floor[room(module)]
    ]
    assert upward == []
    assert len(FLOORS) <= 8


def test_every_room_has_its_floor() -> None:
    assert {room(name) for name in modules()} == set().union(*FLOORS)


def test_the_witness_shares_nothing_with_the_optimiser() -> None:
    rooms = {room(other) for module, taken in imports().items() if room(module) == "verify" for other in taken}
    assert rooms <= {"verify", "task", "problem", "errors", "lifetime", "motion"}


def test_the_witness_runs_without_the_optimiser() -> None:
    code = "import sys, casadi_hands.verify; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    rooms = {name.split(".")[1] for name in loaded if name.startswith("casadi_hands.")}
    assert "verify" in rooms
    # The task's schema is made from the shapes' and the terms' declarations.
    schema = {"declared", "terms", "geometry", "meshes", "cache"}
    assert rooms <= {"verify", "task", "problem", "errors", "lifetime", "motion"} | schema


@pytest.mark.parametrize("module", sorted(modules()))
def test_a_module_can_be_read_at_one_go(module: str) -> None:
    assert len(modules()[module].read_text(encoding="utf-8").splitlines()) <= LONGEST
