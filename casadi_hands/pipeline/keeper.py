"""Where the designs of a solve go, and what stands there already: a result makes way for a better one only."""

from __future__ import annotations

from collections.abc import Callable, Set
from pathlib import Path

from casadi_hands.errors import DesignError
from casadi_hands.export.design import Design
from casadi_hands.export.moving import LAST
from casadi_hands.export.place import shown
from casadi_hands.export.record import STATUSES
from casadi_hands.pipeline.rank import rank_of
from casadi_hands.task import Task


class Keeper:
    """Writes designs of one task into a folder.

    Args:
        out: the folder; None to write nothing.
        rival: the result that stands there, if only a better one may take its place.
        replaces: whether the last design takes its place in any case.
        before: is called before a design is written.
    """

    def __init__(
        self,
        out: Path | None,
        rival: Design | None = None,
        replaces: bool = False,
        before: Callable[[], None] = lambda: None,
    ) -> None:
        self.out, self.rival, self.replaces, self._before = out, rival, replaces, before
        self.outdone = False

    def keep(self, design: Design, last: bool = False) -> None:
        """Write a design, unless what stands there is better.

        Args:
            design: of the solve.
            last: whether no other follows. Where it is not written, the keeper is ``outdone`` until one is.

        Raises:
            DesignError: it cannot be written.
        """
        if self.out is None:
            return
        forced = last and self.replaces
        self.outdone = self.rival is not None and not forced and _standing(design) > _standing(self.rival)
        if self.outdone:
            return
        self._before()
        design.save(self.out)
        self.rival = None


def rival_in(out: Path, task: Task, force: bool = False) -> Design | None:
    """The result in a folder that only a better one may replace.

    Args:
        out: the folder; need not exist.
        task: that is to be solved into it.
        force: whether whatever stands there may be replaced in the end. Until then it stands.

    Returns:
        A judged design. None where there is no result, one that was not judged, or a failed one of another task.

    Raises:
        DesignError: a new result would take the place of one that is certified, that is not of this task and has not
            failed, or that cannot be read; unless that is forced.
    """
    if not (out / LAST).is_file():
        return None
    try:
        found = Design.load(out)
    except DesignError as error:
        if force:
            return None
        raise DesignError(f"{shown(out)}: holds a result that cannot be read ({error})", _REMEDY) from error
    same = _is_asked_for(found.task, task)
    if not force and (found.status == "certified" or (not same and found.status != "failed")):
        which = "this task" if same else f"another task ({found.task.name})"
        raise DesignError(f"{shown(out)}: holds a {found.status} result of {which} already", _REMEDY)
    judged = bool(found.certificate) and (same or found.status != "failed")
    return found if judged else None


_REMEDY = "--force replaces it when there is another, --out names another folder"


_HOW = ("search", "weights")


def _is_asked_for(found: Task, task: Task) -> bool:
    """Whether a result's task is what a task asks for: the same, however it is looked for, less fingers to spare."""
    spare = {name for name, each in task.fingers.items() if each.optional} - found.fingers.keys()
    return _asked(found) == _asked(task, spare)


def _asked(task: Task, spare: Set[str] = frozenset()) -> Task:
    """What a task asks for, contacts as they were before they were placed, without some fingers to spare."""
    default = Task.model_fields
    how = {name: default[name].get_default(call_default_factory=True) for name in _HOW}
    fingers = {
        # Of one that was placed nobody knows whether it was to spare.
        name: each.model_copy(update={"touches": each.placed or each.touches, "placed": None, "optional": None})
        for name, each in task.fingers.items()
        if name not in spare
    }
    return task.model_copy(update={**how, "fingers": fingers})


def _standing(design: Design) -> tuple[float, ...]:
    """How good a design is, best first."""
    return STATUSES.index(design.status), not design.certificate, *rank_of(design)
