"""A text as the program understands it: the task as it is written, and what `check` says of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from casadi_hands.diagnosis.impossible import findings
from casadi_hands.errors import HandsError, TaskError
from casadi_hands.placement.place import propose
from casadi_hands.problem.si import build_model
from casadi_hands.task import Task
from casadi_hands.task.loader import parse_questioned
from casadi_hands.task.mesh import FOLDER
from casadi_hands.task.yamlfile import TaskFile


@dataclass(frozen=True)
class Understood:
    """What a text says.

    Attributes:
        written: the task in the file's own object frame, contacts where the file has them; None where it is refused.
        refusals: why the file cannot be used, a line each.
        impossible: why no hand can do the task, a line each.
        doubts: what may make solves fail, a line each.
        questions: what the file may mean otherwise, a line each.
    """

    written: Task | None
    refusals: tuple[str, ...] = ()
    impossible: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    questions: tuple[str, ...] = ()

    @property
    def solvable(self) -> bool:
        """Whether solving makes sense."""
        return not self.refusals and not self.impossible


def understand(text: str, path: Path) -> Understood:
    """Check a text as `casadi-hands check` would.

    Args:
        text: of the task file.
        path: where it is, or will be, for messages and for files that it names.
    """
    written = None
    try:
        written = _as_written(text, path)
        task, questions = parse_questioned(text, path.name, path.stem, path.parent)
    except HandsError as error:
        return Understood(written, tuple(str(error).splitlines()))
    if written is not None and written.palm.auto:
        written = written.model_copy(update={"palm": task.palm})
    proposal = None if task.is_placed else propose(task)
    if proposal is not None and proposal.sets:
        task = proposal.sets[0].in_task(task)
    found = findings(task, build_model(task))
    unplaced = (proposal.reason,) if proposal is not None and not proposal.sets else ()
    return Understood(
        written,
        impossible=(*unplaced, *(each.reason.text for each in found if each.certain)),
        doubts=tuple(each.reason.text for each in found if not each.certain),
        questions=tuple(questions),
    )


def _as_written(text: str, path: Path) -> Task | None:
    data = {"name": path.stem, **TaskFile(text, path.name).data}
    try:
        return Task.model_validate(data, context={FOLDER: path.parent})
    except (ValidationError, TaskError):
        return None
