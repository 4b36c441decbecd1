"""Motors that would do, what the costs are made of, and what the solve took."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from casadi_hands.export.report import markup as html
from casadi_hands.export.report.data import Curve, Panel, css, with_commands
from casadi_hands.export.report.motors import Fit, demands, fit, lightest
from casadi_hands.export.report.words import plain, stage_title, term_title
from casadi_hands.task.servos import SERVOS

if TYPE_CHECKING:
    from casadi_hands.problem.result import Result


def motors_section(design: Result) -> html.Html:
    """Each servo of the library with its shares of torque and speed, and the lightest that does in each place."""
    title = "Motors that would do"
    if design.hand is None or design.motion is None:
        return html.section("motors", title, html.paragraph("There is no motion to choose them by."))
    asked = demands(design.hand, with_commands(design))
    least = design.certificate.get("least_stiffness", {}).get("value")
    rows = [_servo(fit(name, asked), least, design.hand.servo) for name in SERVOS]
    what = "every motor" if design.hand.drive else "the motor of every joint"
    words = (
        f"If one kind of servo is to be {what}: the share of the torque that it can hold, and of the speed that is "
        "left at the torque of the time. More than a whole is too much. Whether they fit between the links is only "
        "checked where the task names one for its joints."
    )
    if least:
        which = "Springs between motors and joints" if design.hand.drive else "Joints"
        words += f" {which} must be stiffer than {least:.3g} N·m/rad; leave a factor of two or three."
    head = ("Servo", "", "torque", "speed", "stiffness, N·m/rad", "mass, g", "price")
    places = [
        (
            each.name,
            f"{each.torque.max(initial=0.0):.3g}",
            f"{each.speed.max(initial=0.0):.3g}",
            lightest(each) or "none of these",
        )
        for each in asked
    ]
    where = "Motor" if design.hand.drive else "Joint"
    each = html.table((where, "torque, N·m", "speed, rad/s", "the lightest that does"), places)
    return html.section(
        "motors", title, html.paragraph(words), html.table(head, rows), html.details("One by one", each)
    )


def _servo(found: Fit, least: float | None, built_in: str | None) -> tuple[str, ...]:
    servo = SERVOS[found.servo]
    kind = "good" if found.does else "warn" if found.moment < 1 and found.speed <= 1 else "bad"
    stiffness = "not stated" if servo.stiffness is None else f"{servo.stiffness:g}"
    if servo.stiffness is not None and least is not None and servo.stiffness <= least:
        stiffness += ", too soft"
    speed = html.bar(found.speed, html.percent(found.speed) if isfinite(found.speed) else "stalls", _over(found.speed))
    return (
        f"{found.servo}{' (in this hand)' if found.servo == built_in else ''}",
        html.badge(found.words, kind),
        html.bar(found.torque, html.percent(found.torque), _over(found.torque)),
        speed,
        stiffness,
        f"{1e3 * servo.mass:.3g}",
        servo.price,
    )


def _over(share: float) -> str:
    return "bad" if share > 1 else ""


def costs_section(design: Result) -> html.Html:
    """What the cost of each stage is made of, and how it fell from run to run."""
    parts = [
        html.paragraph("What each stage weighed against each other when it ended: the weighted value of each term.")
    ]
    for stage, terms in design.costs.items():
        whole = sum(each["value"] or 0.0 for each in terms.values())
        ranked = sorted(terms.items(), key=lambda item: -(item[1]["value"] or 0.0))
        rows = [
            (
                term_title(stage, name),
                html.bar(value / whole if whole > 0 else 0.0, html.number(f"{value:.3g}")),
                f"{weight:.3g}",
            )
            for name, each in ranked
            for value, weight in [(each["value"] or 0.0, each["weight"] or 0.0)]
        ]
        shown = [row for row, (_, each) in zip(rows, ranked, strict=True) if (each["value"] or 0.0) > 1e-3 * whole]
        inner = html.table(("Term", "weighted value", "weight"), shown or rows, "costs")
        if 0 < len(shown) < len(rows):
            rest = html.table(("Term", "weighted value", "weight"), rows[len(shown) :], "costs")
            inner = html.Html(inner + html.details(f"{len(rows) - len(shown)} more, each less than 0.1 %", rest))
        parts.append(html.Html(f"<h3>{html.text(stage_title(stage))} <small>{whole:.3g} in all</small></h3>{inner}"))
    if design.stages:
        parts.append(html.Html('<h3>From run to run</h3><div id="runs"></div>'))
        parts.append(_runs(design.stages))
    return html.section("costs", "What the solver weighed", *parts)


def _runs(stages: list[dict[str, Any]]) -> html.Html:
    """A line for each stage's kind of run: how many, how many iterations, how long, how many did not end well."""
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for run in stages:
        groups.setdefault((str(run.get("stage", "")), str(run.get("annealing_step", ""))), []).append(run)
    rows = [
        (
            stage_title(stage),
            plain(step),
            str(len(runs)),
            str(sum(int(run.get("iterations") or 0) for run in runs)),
            f"{sum(float(run.get('seconds') or 0.0) for run in runs):.1f}",
            str(sum(run.get("status") not in _WELL for run in runs) or ""),
        )
        for (stage, step), runs in groups.items()
    ]
    head = ("Stage", "step", "runs", "iterations", "seconds", "without a solution")
    return html.details(f"The {len(stages)} solver runs by stage and annealing step", html.table(head, rows))


_WELL = ("Solve_Succeeded", "Solved_To_Acceptable_Level")
_STAGE_COLORS = ((0.20, 0.47, 0.75), (0.80, 0.36, 0.58), (0.10, 0.58, 0.62), (0.80, 0.50, 0.10))


def run_panel(stages: list[dict[str, Any]]) -> tuple[Panel, Any] | None:
    """The objective of each solver run in order, by stage, and the runs' numbers (R,); None without any above zero."""
    values = np.array([_objective(run) for run in stages])
    if not (values > 0).any():
        return None
    names = list(dict.fromkeys(str(run.get("stage", "")) for run in stages))
    own = np.array([str(run.get("stage", "")) for run in stages])
    curves = tuple(
        Curve(stage_title(name), css(_STAGE_COLORS[k % len(_STAGE_COLORS)]), 0, np.where(own == name, values, np.nan))
        for k, name in enumerate(names)
    )
    about = "Where each run ended. Weights change from step to step, so runs of different steps are not of one scale."
    return Panel("runs", "Objective", "", about, curves, "runs"), np.arange(1, len(stages) + 1)


def _objective(run: dict[str, Any]) -> float:
    value = run.get("objective")
    return float(value) if isinstance(value, int | float) and isfinite(value) and value > 0 else float("nan")
