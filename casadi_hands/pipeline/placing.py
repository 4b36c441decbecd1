"""Contacts that the program places: the best sets by statics, the soft stages over each at small cost, best first."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import asdict, dataclass, replace
from typing import Any

from casadi_hands.execution.processes import run_all
from casadi_hands.export.design import Design
from casadi_hands.nlp import SolverError
from casadi_hands.pipeline.record import Record
from casadi_hands.placement.place import ContactSet, Proposal, propose
from casadi_hands.problem.si import build_model
from casadi_hands.stages.floating.stage import solve_floating
from casadi_hands.stages.synthesis.algorithm import Search
from casadi_hands.stages.synthesis.score import singular_fingers
from casadi_hands.stages.synthesis.target import target_of
from casadi_hands.task import Task
from casadi_hands.task.checks import check
from casadi_hands.task.palm_place import standing

TRIALS, RECOMBINATIONS = 3, 2  # of the search, where the task's are more
ATTEMPTS = 2  # sets that are solved in full, the second where the first gives no certified hand


@dataclass(frozen=True)
class Tried:
    """What the soft stages made of a set of contacts.

    Attributes:
        joints: of each finger.
        lacking: fingers that would need more joints than are allowed.
        singular: fingers that pass a singular pose while they touch.
        idle: contacts that never act, and have no finger.
        held: whether contacts that let go at times, as the motion has it, can hold the object.
        broke_off: why there is nothing to tell, else empty.
    """

    joints: tuple[int, ...] = ()
    lacking: int = 0
    singular: int = 0
    idle: int = 0
    held: bool = False
    broke_off: str = ""

    def rank(self, contacts: ContactSet) -> tuple[float, ...]:
        """Best first: what can be done, with all fingers, few joints, no singular poses, and little grip in reach."""
        done = bool(self.broke_off), self.lacking, not self.held, self.idle
        return (*done, sum(self.joints), self.singular, contacts.cost)


def place(task: Task, record: Record, executor: Executor | None) -> tuple[list[Task], dict[str, Any]]:
    """Place the contacts of a task.

    Args:
        task: some of whose contacts have no place.
        record: told of the progress.
        executor: where the soft stages run; what is placed does not depend on it.

    Returns:
        The task with contacts in place, best set first, none where there is none; and what is to be told of it.
    """
    with record.stage("placement", f"contacts for {len(task.fingers)} fingers, by statics"):
        proposal = propose(task)
        tasks = [each.in_task(task) for each in proposal.sets]
        done, kept = 0, record.journal.section("sets of contacts")

        def tell(index: int, tried: Tried) -> None:
            nonlocal done
            done += 1
            record.log("placement", f"set {index + 1}, {done} of {len(tasks)}: {_tried_words(tried)}")

        tried = (
            run_all(executor, try_contacts, [(each,) for each in tasks], tell, kept, "set {} of contacts".format)
            if len(tasks) > 1
            else [Tried()] * len(tasks)
        )
    order = sorted(range(len(tasks)), key=lambda k: (*tried[k].rank(proposal.sets[k]), k))
    return [tasks[k] for k in order], _told(task, proposal, tried, order)


def try_contacts(task: Task) -> Tried:
    """Stages 1 and 2 over a task with few trials."""
    model, search = build_model(task), task.search
    try:
        floating = solve_floating(model, dict(task.weights.floating))
        algorithm = Search(
            target_of(floating.model, floating),
            dict(task.weights.synthesis),
            trials=min(TRIALS, search.trials),
            recombinations=min(RECOMBINATIONS, search.recombinations),
            max_joints=search.max_joints,
            threshold=search.threshold,
            seed=search.seed,
            executor=None,
            progress=lambda _: None,
        )
        found = algorithm.run()
    except SolverError as error:
        return Tried(broke_off=str(error))
    best = found.candidates[0]
    singular = singular_fingers(algorithm.target, best.hand)
    idle = len(task.fingers) - len(best.joints)
    return Tried(best.joints, len(found.short), singular, idle, floating.threshold > 0)


def placed_like(task: Task, earlier: Task) -> Task:
    """The task with the contacts of an earlier one, where the program placed them for the same regions.

    What it did not place stays without a place.
    """
    fingers = {}
    for name, finger in task.fingers.items():
        other = earlier.fingers.get(name)
        known = other is not None and not finger.is_placed and other.placed == finger.touches
        fingers[name] = other if known and other is not None else finger
    kept = {n: f for n, f in fingers.items() if f.is_placed or not f.optional}
    return task.model_copy(update={"fingers": kept}) if all(f.is_placed for f in kept.values()) else task


def stood_like(task: Task, earlier: Task) -> Task:
    """The task with the palm of an earlier one, where the program placed both and it may stand there still."""
    palm, was = task.palm, earlier.palm
    if not (palm.placed and was.placed and (palm.radius, palm.thickness) == (was.radius, was.thickness)):
        return task
    kept = task.model_copy(update={"palm": palm.model_copy(update={"position": was.position, "facing": was.facing})})
    return task if check(kept) else kept


def tell_palm(record: Record) -> None:
    """Tell, and write into ``placement.json``, where the palm stands, if the program placed it."""
    palm = record.task.palm
    if palm.placed:
        found = standing(record.task)
        record.log("placement", f"the palm stands at {list(palm.position)} m, facing {list(palm.facing)}: {found}")
        told = {"position": list(palm.position), "facing": list(palm.facing), **asdict(found), "why": str(found)}
        record.update(placement={"palm": told})


def unplaceable(record: Record, told: dict[str, Any]) -> Design:
    """The failed design of a task whose contacts cannot be placed."""
    return replace(record.design, status="failed", reason=told["why"], placement={**record.design.placement, **told})


def _told(task: Task, proposal: Proposal, tried: list[Tried], order: list[int]) -> dict[str, Any]:
    """What ``placement.json`` holds."""
    sets = []
    for k in order:
        each = proposal.sets[k]
        stages = {**asdict(tried[k]), "joints": list(tried[k].joints)}
        sets.append({**asdict(each), "points": {n: list(p) for n, p in each.points.items()}, **stages})
    return {
        "asked": {name: str(f.touches) for name, f in task.fingers.items() if not f.is_placed},
        "points_on_surface": proposal.drawn,
        "points_within_reach": proposal.candidates,
        "sets": sets,
        "why": why([proposal.sets[k] for k in order], [tried[k] for k in order]) if order else proposal.reason,
    }


def why(sets: list[ContactSet], tried: list[Tried]) -> str:
    """Why the first set was chosen, in a sentence."""
    first, best = sets[0], tried[0]
    grip = (
        f"its hardest-pressed contact presses with {first.grip:.2g} weights at least, to withstand {first.withstands}"
    )
    if len(sets) == 1 or not best.joints:
        return f"the one set found: {grip}"
    others = ", ".join(_tried_words(each) for each in tried[1:])
    return f"of {len(sets)} sets it takes the least: {_tried_words(best)} (the others: {others}); {grip}"


def _tried_words(tried: Tried) -> str:
    if tried.broke_off:
        return "broke off"
    words = f"{'+'.join(map(str, tried.joints))} joints"
    words += f", {tried.lacking} of the fingers would need more" if tried.lacking else ""
    words += f", {tried.idle} idle" if tried.idle else ""
    return words + (f", {tried.singular} in singular poses" if tried.singular else "")
