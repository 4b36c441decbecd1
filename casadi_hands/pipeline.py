"""From a task to a design: the stages in order, with everything computed kept as it comes."""

from __future__ import annotations

import importlib.util
import os
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from casadi_hands.design import Design
from casadi_hands.errors import SolveError
from casadi_hands.nlp import Solution
from casadi_hands.search.algorithm import Candidate, Found, Search, run_record
from casadi_hands.search.work import processes
from casadi_hands.stages.floating import Floating, FloatingStage
from casadi_hands.stages.model import Model, build_model
from casadi_hands.stages.outcome import floating_motion, hand_of, joint_loads, whole_hand_motion
from casadi_hands.stages.refine import WEIGHTS, Margin, Refined, RefineStage
from casadi_hands.stages.target import target_of
from casadi_hands.stages.whole_hand import WholeHand, WholeHandStage
from casadi_hands.task import Task
from casadi_hands.verify import Audit, audit, replay, replay_many

STAGES = ("floating", "synthesis", "whole_hand", "refine")
AMPLE = Margin()
SMALL = Margin(friction=0.8, normal_force=0.25)
FIRM = Margin(normal_force=2.0)
REPLAYS = 12  # perturbed ones, that a certified design is tried on
DROPS = 1  # of them, that pass
FEASIBLE = {  # beyond these a motion is none: m, degrees, m·g
    "goal_position": 0.001,
    "goal_angle": 1.0,
    "residual": 0.1,
    "friction_excess": 0.05,
    "gap": 0.001,
    "penetration": 0.002,
}
OUT_OF_REACH = 0.3  # half extents that a finger misses its contact by: nothing is left to refine
HANDS_REFINED = 2  # hands of one structure that are tried before fingers get another joint

_CONSTRAINTS = {  # what a violated constraint means
    "physics.defect": "be moved as planned by the forces of its contacts",
    "wrench.sum": "be moved as planned by the forces of its contacts",
    "middle_torque.sum": "be moved as planned by the forces of its contacts",
    "contact.on_surfaces": "reach its contact",
    "contact.opposed": "reach its contact with its surface facing the object's",
    "contact.facing": "reach its contact from outside the object",
    "contact.pressing": "press firmly enough",
    "contact.cone": "press without slipping",
    "contact.passive": "supply its force with its joints",
    "contact.torque": "supply its force within the torque limit",
    "rolling.no_slip": "roll with the object",
    "apart.clear": "stay clear of the other bodies",
    "apart_touching.clear": "stay clear of the other bodies",
    "fingers_apart.clear": "stay clear of the other fingers",
    "joint_motion.speed": "keep within the joints' speed limit",
    "stay.on_palm": "start on the palm",
}


@dataclass(frozen=True)
class Progress:
    """What a solve is doing.

    Attributes:
        stage: one of ``STAGES``.
        text: what is tried, and the best so far.
        elapsed: s since the solve began.
    """

    stage: str
    text: str
    elapsed: float


def solve(
    task: Task,
    *,
    seed: int | None = None,
    jobs: int | None = None,
    until: str = "refine",
    out: Path | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Design:
    """Design a hand for a task.

    Args:
        task: as ``load_task`` gives it.
        seed: of the search, in place of the task's.
        jobs: processes for the trials; all cores by default. The design does not depend on it.
        until: the last stage to run.
        out: folder that is written after every stage, so that nothing computed is lost.
        progress: told what is being done.

    Returns:
        The design; its status is earned by the audit of what is written.

    Raises:
        SolveError: ``until`` is not a stage.
    """
    if until not in STAGES:
        raise SolveError(f"until: given {until!r}; allowed: {', '.join(STAGES)}")
    if seed is not None:
        task = task.model_copy(update={"search": task.search.model_copy(update={"seed": seed})})
    jobs = jobs or os.cpu_count() or 1
    with processes(jobs) as executor:
        return _Run(task, until, out, progress or (lambda _: None), executor, jobs).run()


class _Run:
    """The state of one solve."""

    def __init__(
        self,
        task: Task,
        until: str,
        out: Path | None,
        progress: Callable[[Progress], None],
        executor: Executor | None,
        jobs: int,
    ) -> None:
        self.jobs = jobs
        self.task, self.until, self.out = task, until, out
        self.report, self.executor = progress, executor
        self.model: Model = build_model(task)
        self.started = time.perf_counter()
        self.design = Design(task=task, status="failed", reason="nothing has been computed yet")

    def run(self) -> Design:
        """All stages, to the last one asked for."""
        floating = self._floating()
        if self.until == "floating":
            return self._keep(self._stopped("floating"))
        search = self._search(floating)
        found = self._search_on(search)
        if self.until == "synthesis":
            return self._keep(self._stopped("synthesis"))
        if self.until == "whole_hand":
            self._whole_hand(floating, found.candidates[0])
            return self._keep(self._judge(self.design, "; ".join(found.short)))
        return self._keep(self._refine(floating, search, found))

    # What each stage does.

    def _floating(self) -> Floating:
        with self._stage("floating", f"object's motion with {self.model.contacts} floating contacts"):
            result = FloatingStage(self.model).solve(dict(self.task.weights.floating))
        runs = [run_record("floating", what, self.task.search.seed, what, s) for what, s in result.runs]
        self._extend(runs, "floating", result.solution, dict(self.task.weights.floating))
        self.design = replace(self.design, motion=floating_motion(self.model, result))
        self._keep(replace(self.design, reason="stopped before a hand was designed"))
        return result

    def _search(self, floating: Floating) -> Search:
        settings = self.task.search
        return Search(
            target_of(self.model, floating),
            dict(self.task.weights.synthesis),
            trials=settings.trials,
            recombinations=settings.recombinations,
            max_joints=settings.max_joints,
            threshold=settings.threshold,
            seed=settings.seed,
            executor=self.executor,
            progress=lambda text: self._say("synthesis", text),
        )

    def _search_on(self, search: Search, least: Mapping[int, int] | None = None) -> Found:
        """Run the search, from ``least`` joints a finger, and adopt its best hand."""
        with self._stage("synthesis", f"fingers for {len(search.contacts)} contacts"):
            found = search.run(least)
        best = found.candidates[0]
        self._extend(search.take_runs(), "synthesis", best.hand.solution, dict(self.task.weights.synthesis))
        hand = hand_of(self.task, self.model, best.hand.fingers, best.hand.contacts, 1.0, 1.0)
        self.design = replace(self.design, hand=hand, motion=None)
        joints = "+".join(map(str, best.joints))
        self._say("synthesis", f"best hand has {joints} joints, scores {', '.join(f'{s:.3f}' for s in best.scores)}")
        return found

    def _whole_hand(self, floating: Floating, candidate: Candidate) -> WholeHand:
        with self._stage("whole_hand", f"object and hand of {'+'.join(map(str, candidate.joints))} joints together"):
            stage = WholeHandStage(self.model, candidate.hand.contacts, candidate.joints, self.task.palm.may_move)
            result = stage.solve(floating, candidate.hand.fingers, dict(self.task.weights.whole_hand))
        runs = [run_record("whole_hand", "hand", self.task.search.seed, "", result.solution)]
        self._extend(runs, "whole_hand", result.solution, dict(self.task.weights.whole_hand))
        self._adopt(result)
        self._keep(replace(self.design, reason="stopped before the motion was refined"))
        return result

    def _refine(self, floating: Floating, search: Search, found: Found) -> Design:
        """Refine hands until one is certified: the best, the next best, then with one more joint where it fails."""
        best: tuple[int, Design] | None = None
        if found.farthest > OUT_OF_REACH:
            self._whole_hand(floating, found.candidates[0])
            return self._judge(self.design, "; ".join(found.short))
        while True:
            failing: set[str] = set()
            for candidate in found.candidates[:HANDS_REFINED]:
                whole = self._whole_hand(floating, candidate)
                judged, refined = self._certify(whole, found.short)
                if judged.status == "certified":
                    return judged
                self._say("refine", f"not certified: {judged.reason}")
                missed = sum(not figure["holds"] for figure in judged.certificate.values())
                if best is None or missed < best[0]:
                    best = (missed, judged)
                failing |= _failing(self.model, refined)
                if refined.slips_hopelessly:
                    break  # a structure that must slip will do so in any of its hands
            least = self._more_joints(search, found, failing)
            if least is None and best is not None:
                return best[1]
            self._say("synthesis", f"another joint for {', '.join(sorted(failing)) or 'the fingers with fewest'}")
            found = self._search_on(search, least)

    def _certify(self, whole: WholeHand, short: tuple[str, ...]) -> tuple[Design, Refined]:
        """Refine one hand with an ample margin, with a small one where that fails, with more where a replay drops."""
        joints = tuple(finger.joints for finger in whole.fingers)
        with self._stage("refine", "the same motion with exact physics, rolling contacts and clearance"):
            stage = RefineStage(self.model, whole.contacts, joints, whole.active)
            refined = self._attempt(stage, whole, AMPLE)
        if not refined.exact and not refined.slips_hopelessly:
            with self._stage("refine", "again, closer to the limits of friction and grip"):
                second = self._attempt(stage, whole, SMALL)
            refined = second if second.exact or second.worst[1] < refined.worst[1] else refined
        judged = self._judged(refined, short)
        drops = self._drops(judged)
        if drops > DROPS:
            with self._stage("refine", f"again with a firmer grip: {drops} of {REPLAYS} replays dropped the object"):
                firmer = self._attempt(stage, whole, FIRM)
            again = self._judged(firmer, short)
            if again.status == "certified" and self._drops(again) < drops:
                return again, firmer
            # Both designs' runs are kept in the record.
            return replace(judged, stages=self.design.stages, seconds=self.design.seconds), refined
        return judged, refined

    def _drops(self, design: Design) -> int:
        """How many perturbed replays of a certified design drop the object; 0 where there is no simulator to ask."""
        if design.status != "certified" or importlib.util.find_spec("mujoco") is None:
            return 0
        with self._stage("refine", "replays of the certified motion"), tempfile.TemporaryDirectory() as scratch:
            design.save(scratch)
            if replay(scratch).dropped:
                return REPLAYS
            return sum(r.dropped for r in replay_many(scratch, REPLAYS, jobs=self.jobs))

    def _attempt(self, stage: RefineStage, whole: WholeHand, margin: Margin) -> Refined:
        """Refine with one margin, and record its solves whether they serve or not."""
        result = stage.solve(whole, margin)
        what = f"hand, {margin.friction:g} of the friction and {margin.normal_force:g} weights of grip"
        runs = [run_record("refine", what, self.task.search.seed, step, s) for step, s in result.runs]
        length = self.model.units.length
        # What the refinement changed in each finger: base and lengths in m, axes in rad.
        runs[-1]["design_change"] = {
            finger: {"base": change["base"] * length, "lengths": change["lengths"] * length, "axes": change["axes"]}
            for finger, change in result.moved.items()
        }
        self.design = replace(self.design, stages=[*self.design.stages, *runs])
        return result

    def _judged(self, refined: Refined, short: tuple[str, ...]) -> Design:
        """Adopt a refined hand and have it audited; ``short`` says what its fingers could not do before."""
        last = refined.runs[-1][1]
        costs = {name: {"weight": WEIGHTS[name], "value": value} for name, value in last.terms.items()}
        self.design = replace(self.design, costs={**self.design.costs, "refine": costs})
        self._adopt(refined.hand)
        reasons = [*short, *filter(None, [_reason(self.model, refined)])]
        return self._judge(self.design, "; ".join(reasons))

    def _more_joints(self, search: Search, found: Found, failing: set[str]) -> dict[int, int] | None:
        """Joints of each finger for the next round; None when no failing finger may have more."""
        best = found.candidates[0]
        joints = dict(zip(best.hand.contacts, best.joints, strict=True))
        chosen = [c for c in joints if self.model.contact_names[c] in failing] or list(joints)
        chosen = [c for c in chosen if joints[c] < search.max_joints]
        if not chosen:
            return None
        fewest = min(joints[c] for c in chosen)
        return {c: n + (c in chosen and n == fewest) for c, n in joints.items()}

    # What is kept.

    def _adopt(self, result: WholeHand) -> None:
        torque, speed = joint_loads(self.model, result)
        hand = hand_of(self.task, self.model, result.fingers, result.contacts, torque, speed)
        self.design = replace(self.design, hand=hand, motion=whole_hand_motion(self.model, result))

    def _judge(self, design: Design, reason: str) -> Design:
        """The design with the audit's certificate and the status it earns."""
        with tempfile.TemporaryDirectory() as scratch:
            design.save(scratch)
            verdict: Audit = audit(scratch)
        certificate = verdict.as_certificate()
        if verdict.certified:
            return replace(design, status="certified", reason="", certificate=certificate)
        # What the motors could not do is never hidden by what a stage could not reach because of it.
        motors = [f.reason for name, f in verdict.figures.items() if name in ("speed", "torque") and not f.holds]
        text = "; ".join([reason, *motors]) if reason else "; ".join(verdict.reasons)
        values = {name: certificate[name]["value"] for name in FEASIBLE if name in certificate}
        possible = all(value is not None and value <= FEASIBLE[name] for name, value in values.items())
        return replace(design, status="feasible" if possible else "failed", reason=text, certificate=certificate)

    def _stopped(self, stage: str) -> Design:
        return replace(self.design, status="feasible", reason=f"stopped after the stage {stage}, as asked")

    def _keep(self, design: Design) -> Design:
        """Write what there is, if there is a place for it."""
        seconds = {**design.seconds, "total": time.perf_counter() - self.started}
        design = replace(design, seconds=seconds)
        if self.out is not None:
            design.save(self.out)
        return design

    def _extend(self, runs: list[dict[str, Any]], stage: str, solution: Solution, weights: Mapping[str, Any]) -> None:
        """Add a stage's runs and its terms' weights and weighted values."""
        costs = {}
        for name, value in solution.terms.items():
            weight = weights.get(name.removesuffix("_perturbed"), 0.0)
            weight = weight[-1] if isinstance(weight, tuple | list) else weight
            costs[name] = {"weight": float(weight), "value": value}
        all_costs = {**self.design.costs, stage: costs}
        self.design = replace(self.design, costs=all_costs, stages=[*self.design.stages, *runs])

    def _say(self, stage: str, text: str) -> None:
        self.report(Progress(stage, text, time.perf_counter() - self.started))

    @contextmanager
    def _stage(self, name: str, text: str) -> Iterator[None]:
        """Announce a stage and add its time to the design's."""
        self._say(name, text)
        began = time.perf_counter()
        yield
        seconds = dict(self.design.seconds)
        seconds[name] = seconds.get(name, 0.0) + time.perf_counter() - began
        self.design = replace(self.design, seconds=seconds)


def _failing(model: Model, refined: Refined) -> set[str]:
    """Names of the fingers that kept a motion from being exact; none if it cannot be laid to fingers."""
    if refined.slips_hopelessly:
        most = max(refined.slips.values())
        return {name for name, slip in refined.slips.items() if slip > 0.3 * most}
    kernel = refined.worst[0].split(".")[0]
    digits = "".join(ch for ch in kernel if ch.isdigit())
    return {model.contact_names[int(digits)]} if digits.isdigit() and int(digits) < model.contacts else set()


def _reason(model: Model, refined: Refined) -> str:
    """Why a refined motion is not exact, in the user's terms; empty if it is."""
    if refined.exact:
        return ""
    joints = {
        model.contact_names[c]: f.joints for c, f in zip(refined.hand.contacts, refined.hand.fingers, strict=True)
    }
    if refined.slips_hopelessly:
        worst = max(refined.slips, key=lambda name: refined.slips[name])
        slip = refined.slips[worst] * model.units.length * 1e3
        return f"finger '{worst}' with {joints[worst]} joint(s) cannot roll with the object: it slips {slip:.1f} mm"
    kernel, constraint = refined.worst[0].split(".")
    who = _failing(model, refined)
    subject = f"finger '{min(who)}'" if who else "the object"
    what = _CONSTRAINTS.get(f"{kernel.rstrip('0123456789_')}.{constraint}", f"meet {refined.worst[0]}")
    return f"no exact motion was found with {'+'.join(map(str, joints.values()))} joints: {subject} cannot {what}"
