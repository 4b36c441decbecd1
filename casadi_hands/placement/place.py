"""From a task whose contacts are to be placed to tasks whose contacts are: the best sets by statics, reach and room."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from casadi_hands.errors import SolveError
from casadi_hands.placement.grip import Bounds, Grip
from casadi_hands.placement.loads import Contacts, disturbances, loads
from casadi_hands.placement.seen import FARTHEST, seen
from casadi_hands.placement.sets import WOBBLE, Ranked, rank
from casadi_hands.placement.stability import needed_stiffness, shape_operators
from casadi_hands.placement.surface import STEP, Spots, spot, spots
from casadi_hands.problem.model import Model
from casadi_hands.problem.si import build_model
from casadi_hands.task import FingerSpec, Task
from casadi_hands.task.region import Region

Array = NDArray[np.float64]
Index = NDArray[np.int64]
CANDIDATES = 240  # points on the surface
COUNTS = 2  # numbers of fingers, the fewest that hold firmly
SETS = 4  # that differ, of which stages try more
BENT = 2.0  # m·g that a contact costs where the surface is as curved as the fingertip
FIRM = 4.0  # m·g: sets that must press harder hold by the twist of their fingertips alone, if at all
_EASIER = 0.5  # of the grip: where it takes so much less to withstand less, that is all that is asked
_WORSE = 2.0  # times the best set's cost, beyond which a set is not worth trying
_STREAM = 20_260_022  # keeps these draws apart from the search's


@dataclass(frozen=True)
class ContactSet:
    """Contacts for some of a task's fingers, and what speaks for them.

    Attributes:
        points: for each finger by name its contact (3,), m, object frame.
        grip: weights that the hardest-pressed contact presses with at least over all loads.
        reach: what touching there costs, weights: off side-on to the palm, far from it, travelling far, on a curved
            surface.
        wobble: stiffness of fingertips that the grasp asks for, by what joints have at a palm radius from them.
        worst_angle: degrees from side-on to the palm, of the worst contact at the worst moment.
        withstands: what the grip is for, in words.
    """

    points: dict[str, tuple[float, float, float]]
    grip: float
    reach: float
    wobble: float
    worst_angle: float
    withstands: str

    @property
    def cost(self) -> float:
        """What sets are ranked by, weights."""
        return self.grip + self.reach + WOBBLE * self.wobble

    @property
    def firm(self) -> bool:
        """Whether it withstands disturbances about all axes without pressing hard."""
        return self.withstands == _LEVELS[0][0]

    def in_task(self, task: Task) -> Task:
        """The task with these contacts, and the fingers that have one."""
        fingers = {}
        for name, point in self.points.items():
            asked = task.fingers[name]
            fingers[name] = asked if asked.is_placed else FingerSpec(touches=point, placed=asked.touches)
        return task.model_copy(update={"fingers": fingers})


@dataclass(frozen=True)
class Proposal:
    """The sets of contacts that were found, best first.

    Attributes:
        sets: that differ from each other; empty where there are none.
        candidates: how many points of the surface fingers can touch.
        drawn: how many there are on the surface.
        reason: why there is no set, else empty.
    """

    sets: tuple[ContactSet, ...]
    candidates: int
    drawn: int
    reason: str = ""


_LEVELS: tuple[tuple[str, Array], ...] = (
    ("pushes of half the weight and torques along any axis", disturbances()),
    ("pushes of half the weight along any axis", disturbances(torques=False)),
    ("the weight alone", np.zeros((0, 6))),
)


def propose(task: Task) -> Proposal:
    """Find the best sets of contacts for the fingers of a task that have none; the same for the same task and seed.

    Raises:
        SolveError: all contacts are placed.
    """
    if task.is_placed:
        raise SolveError("all contacts are given; there are none to place; see `touches` in casadi-hands fields")
    model = build_model(task)
    rng = np.random.default_rng((task.search.seed, _STREAM))
    drawn = spots(model.bodies, model.tip_radius, CANDIDATES, rng)
    candidates, given = _touchable(task, model, drawn)
    allowed = {name: _allowed(task, model, finger, candidates) for name, finger in task.fingers.items()}
    allowed |= {name: np.array([len(candidates) + k]) for k, name in enumerate(given)}
    of_all = Spots.joined([candidates, *given.values()])
    for name, choice in allowed.items():
        if not len(choice):
            return Proposal((), len(candidates), len(drawn), _nowhere(task, model, name, drawn))
    found: list[ContactSet] = []
    for names in _counts(task):
        found += _sets(task, model, of_all, names, [allowed[name] for name in names])
        if len({len(each.points) for each in found if each.firm}) == COUNTS:
            break
    if any(each.firm for each in found):
        found = [each for each in found if each.firm]
    reason = "" if found else "no set of the contacts that fingers could have bears the object's weight at all goals"
    return Proposal(_few(found), len(candidates), len(drawn), reason)


def _few(found: Sequence[ContactSet]) -> tuple[ContactSet, ...]:
    """The best of each number of fingers in turn, fewest first, then the second best, at most ``SETS`` in all."""
    by_count: dict[int, list[ContactSet]] = {}
    for each in sorted(found, key=lambda each: each.cost):
        by_count.setdefault(len(each.points), []).append(each)
    queues, few = [by_count[count] for count in sorted(by_count)], []
    for place in range(SETS):
        few += [queue[place] for queue in queues if place < len(queue)]
    return tuple(few[:SETS])


def _counts(task: Task) -> list[tuple[str, ...]]:
    """The fingers by name of every number that the task allows."""
    needed = [name for name, finger in task.fingers.items() if not finger.optional]
    spare = [name for name, finger in task.fingers.items() if finger.optional]
    found = [needed + spare[:count] for count in range(len(spare) + 1)]
    return [tuple(name for name in task.fingers if name in chosen) for chosen in found if chosen]


def _touchable(task: Task, model: Model, drawn: Spots) -> tuple[Spots, dict[str, Spots]]:
    """The points that a finger of this palm could touch, and the contacts that are given."""
    view = seen(model, drawn, task.palm.may_move)
    good = (view.above_ground >= model.clearance) & (view.before_palm >= 0) & view.sideways
    given = {c.name: spot(model.bodies, c.body, c.patch) for c in model.contact_table if c.finger}
    return drawn[good], given


def _allowed(task: Task, model: Model, finger: FingerSpec, candidates: Spots) -> Index:
    """The candidates in a finger's region."""
    if not isinstance(finger.touches, Region):
        return np.zeros(0, int)
    return np.flatnonzero(_within(task, model, finger.touches, candidates))


def _within(task: Task, model: Model, region: Region, on: Spots) -> NDArray[np.bool_]:
    names = np.array([shape.name or "" for shape in task.object.shapes])[on.bodies]
    good = np.ones(len(on), bool)
    if region.near is not None and region.within is not None:
        near = np.array(region.near) / model.units.length
        good &= np.linalg.norm(on.points - near, axis=1) <= region.within / model.units.length
    if region.on:
        good &= np.isin(names, region.on)
    return good & ~np.isin(names, region.not_on)


def _nowhere(task: Task, model: Model, name: str, drawn: Spots) -> str:
    """Why there is no place for a finger."""
    region = task.fingers[name].touches
    view, within = seen(model, drawn, task.palm.may_move), _within(task, model, region, drawn)
    there = f"contact '{name}' ({region})"
    if not within.any():
        return f"{there}: none of {len(drawn)} points spread over the object lies there; give it more room"
    ground, palm = view.above_ground >= model.clearance, view.before_palm >= 0
    parts = [
        (ground, "a fingertip there is in the ground at some moment"),
        (palm, "a fingertip there is behind the palm's face or in it at some moment"),
        (view.sideways, f"its side faces to or from the palm, by {np.degrees(FARTHEST):.0f}° or more on average"),
    ]
    told = [f"at {int((within & ~good).sum())} {words}" for good, words in parts if (within & ~good).any()]
    return f"{there}: of {int(within.sum())} points there no finger of this palm can touch any: {'; '.join(told)}"


def _sets(task: Task, model: Model, on: Spots, names: tuple[str, ...], choices: list[Index]) -> list[ContactSet]:
    """The best sets that differ, for some of the fingers."""
    view = seen(model, on, task.palm.may_move)
    contacts = Contacts.of(on.points, on.normals, task.friction, model.torsion)
    shapes = shape_operators(model.bodies, on, contacts.frames, STEP * model.tip_radius)
    needed = loads(model)
    # Where a surface is curved contacts roll far for a small turn, and forces with them.
    cost = view.cost + BENT * model.tip_radius * np.trace(shapes, axis1=1, axis2=2) / 2

    def wobble(chosen: Index, grip: Grip) -> float:
        """Stiffness asked for at the worst load, by that of a fingertip a palm radius from its joint."""
        asked = [
            needed_stiffness(on.points, contacts, chosen, shapes, model.tip_radius, forces) for forces in grip.forces
        ]
        return max(asked) * model.palm_radius**2 / model.stiffness

    ranked: list[Ranked] = []
    words = ""
    for level, disturbed in _LEVELS:
        rng = np.random.default_rng((task.search.seed, _STREAM, len(names)))
        bounds = Bounds(contacts, needed, disturbed, rng)
        better = rank(on, choices, cost, bounds, wobble, model.tip_radius, SETS, rng)
        if better and (not ranked or better[0].grip < _EASIER * ranked[0].grip):
            ranked, words = better, level
        # Without disturbances only where nothing withstands any: the ground alone may bear the weight.
        if ranked and (ranked is not better or ranked[0].grip <= FIRM or level == _LEVELS[1][0]):
            break
    found = []
    for each in [each for each in ranked if each.cost <= _WORSE * ranked[0].cost]:
        points = (on.points[each.chosen] * model.units.length).tolist()
        points = {name: (x, y, z) for name, (x, y, z) in zip(names, points, strict=True)}
        worst = float(np.degrees(view.off_side[each.chosen].max()))
        found.append(ContactSet(points, each.grip, each.reach, each.wobble, worst, words))
    return found
