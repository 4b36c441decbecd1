"""What is kept of a solve that has not ended, beside its folder, and going on from there."""

from __future__ import annotations

import hashlib
import json
import shutil
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import casadi_hands
from casadi_hands.errors import SolveError
from casadi_hands.execution.journal import Journal
from casadi_hands.export.moving import LAST, replace_file
from casadi_hands.export.place import beside, leave_owned, resolved, shown
from casadi_hands.task import Task, load_task, task_to_yaml

_REQUEST, _TASK, _UNITS, _WRITTEN, _SCRATCH = "request.json", "task.yaml", "units", "written", "scratch"
_DECIDE_NUMBERS = ("casadi-hands", "casadi", "pin", "numpy", "scipy", "mujoco")


@dataclass(frozen=True)
class Request:
    """What a solve was asked for.

    Attributes:
        task: the hash of the task as solved.
        until: the last stage.
        seeds: that are explored; None where one hand is designed.
        start: folder of the result that it starts from.
        force: whether its result takes the place of any other.
        program: what decides the numbers: this program, and what it computes with.
    """

    task: str
    until: str
    seeds: tuple[int, ...] | None = None
    start: str | None = None
    force: bool = False
    program: dict[str, str] = field(default_factory=lambda: _program())


class Unfinished:
    """The files of a solve that has not ended.

    Args:
        place: the folder that one has beside the result's while one owns that: see `export.place`.
    """

    def __init__(self, place: Path) -> None:
        self.place = place
        self.scratch = place / _SCRATCH

    def begin(self, task: Task, request: Request) -> Journal:
        """Forget what another solve left, and keep what this one is asked for.

        Raises:
            SolveError: it cannot be written.
        """
        self.end()
        try:
            self.scratch.mkdir()
            (self.place / _TASK).write_text(task_to_yaml(task), encoding="utf-8")
            text = json.dumps(asdict(request), indent=1)
            replace_file(self.place / _REQUEST, lambda path: path.write_text(text, encoding="utf-8"))
        except OSError as error:
            self.end()
            raise SolveError(
                f"{shown(self.place)}: cannot write here: {error.strerror or error}; give another folder (--out)"
            ) from error
        return Journal(self.place / _UNITS)

    def go_on(self, request: Request) -> Journal:
        """The units of an earlier solve that was asked for the same.

        Raises:
            SolveError: there is none, or it was asked for something else.
        """
        begun = _read(self.place)
        if begun is None:
            raise SolveError(f"{shown(self.place)}: no solve was stopped here; leave out --resume")
        for name, given in asdict(request).items():
            if name == "force":
                continue
            if (before := getattr(begun, name)) != given and name != "program":
                raise SolveError(f"the solve that was stopped had another {name}; begin anew, without --resume")
            if before != given:
                changed = sorted(n for n in {*before, *given} if before.get(n) != given.get(n))
                raise SolveError(
                    f"the solve that was stopped was begun with another version of {', '.join(changed)}, so that it "
                    "could not come to the same end; begin anew, without --resume"
                )
        shutil.rmtree(self.scratch, ignore_errors=True)
        self.scratch.mkdir(exist_ok=True)
        return Journal(self.place / _UNITS)

    def end(self) -> None:
        """Remove all files."""
        for folder in (_UNITS, _SCRATCH):
            shutil.rmtree(self.place / folder, ignore_errors=True)
        for file in (_REQUEST, _TASK, _WRITTEN):
            with suppress(OSError):
                (self.place / file).unlink(missing_ok=True)

    def leave(self) -> None:
        """Keep the units if there are any, for `go_on`; else remove all files."""
        shutil.rmtree(self.scratch, ignore_errors=True)
        if not any((self.place / _UNITS).glob("*.npz")):
            self.end()

    @property
    def has_written(self) -> bool:
        """Whether the solve has written into its folder: what stands there is its own."""
        return (self.place / _WRITTEN).exists()

    def wrote(self) -> None:
        """Remember that it has."""
        (self.place / _WRITTEN).touch()


def stopped_solve(directory: Path) -> tuple[Task, Request]:
    """The task and the request of the solve that was stopped before it had written its result.

    Args:
        directory: of the result.

    Raises:
        SolveError: there is none.
    """
    directory = resolved(directory)
    place = beside(directory)
    request = _read(place)
    if request is None:
        done = " a finished result is there" if (directory / LAST).is_file() else " nothing was kept for it"
        raise SolveError(f"{shown(directory)}: no solve into this folder was stopped;{done}; leave --resume out")
    return load_task(place / _TASK, within=True), request


def leave_unfinished() -> None:
    """Leave beside the folders that this process writes what solves can go on from, and nothing else: it ends."""
    leave_owned(lambda place: Unfinished(place).leave())


def is_unfinished(directory: Path) -> bool:
    """Whether a solve into a folder was stopped and can go on: some of its units are kept."""
    place = beside(resolved(directory))
    return _read(place) is not None and any((place / _UNITS).glob("*.npz"))


def has_written(directory: Path) -> bool:
    """Whether a solve into a folder that has not ended has written its own result there."""
    return Unfinished(beside(resolved(directory))).has_written


def request_hash(task: Task) -> str:
    """SHA-256 of a task as solved, hexadecimal."""
    return hashlib.sha256(task_to_yaml(task).encode()).hexdigest()


def _read(place: Path) -> Request | None:
    """The request, or None where there is none or it cannot be read."""
    try:
        stored: dict[str, Any] = json.loads((place / _REQUEST).read_text(encoding="utf-8"))
        seeds = stored.pop("seeds")
        return Request(**stored, seeds=None if seeds is None else tuple(int(seed) for seed in seeds))
    except (OSError, ValueError, TypeError, LookupError, AttributeError):
        return None


def _program() -> dict[str, str]:
    """Versions of what decides the numbers, and a hash of this package's code."""
    found = {name: version(name) for name in _DECIDE_NUMBERS}
    code = hashlib.sha256()
    root = Path(casadi_hands.__file__).parent
    for file in sorted(root.rglob("*.py")):
        code.update(file.relative_to(root).as_posix().encode() + file.read_bytes())
    found["casadi-hands"] += f" ({code.hexdigest()[:16]})"
    return found
