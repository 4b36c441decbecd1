"""What a command says at its end: a task as understood, a design, an audit, replays."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from casadi_hands.verify.report import show

if TYPE_CHECKING:
    from casadi_hands.export.design import Design
    from casadi_hands.pipeline.alternatives import Alternative
    from casadi_hands.verify import Audit, Replay, Replays

_STYLES = {"certified": "bold green", "feasible": "bold yellow", "failed": "bold red"}


def design_summary(design: Design, folder: Path) -> RenderableType:
    """How a solve ended: status, joints, certificate, reason, where the files are."""
    parts: list[RenderableType] = [_headline(design.task.name, design.status)]
    if design.certificate:
        parts.append(certificate_table(design.certificate))
    if design.replays:
        parts.append(Text(f"replays: {design.replay_words}"))
    if design.reason:
        parts.append(Text(f"{'why' if design.status == 'failed' else 'note'}: {design.reason}"))
    if "palm" in design.placement:
        parts.append(Text(f"palm placed: {design.placement['palm']['why']}"))
    if "why" in design.placement and design.status != "failed":
        parts.append(Text(f"contacts placed: {design.placement['why']}"))
    if design.hand is not None:
        fingers = ", ".join(f"{finger.name} {len(finger.links)}" for finger in design.hand.fingers)
        parts.append(Text(f"joints: {fingers}; {design.hand.degrees_of_freedom} in all"))
        if design.hand.drive is not None:
            motors = design.hand.motors
            drive = "1 motor drives" if motors == 1 else f"{motors} motors drive"
            parts.append(Text(f"motors: {drive} {design.hand.degrees_of_freedom} joints"))
    if design.seconds:
        # The total last, whatever order the stages were written in.
        spent = sorted(design.seconds.items(), key=lambda item: item[0] == "total")
        parts.append(Text("time: " + ", ".join(f"{name.replace('_', ' ')} {value:.0f} s" for name, value in spent)))
    parts.append(Text(f"files: {folder}"))
    if design.motion is not None:
        parts.append(Text(f"see it move: casadi-hands view {folder}"))
    return Group(*parts)


def headline(design: Design, folder: Path) -> RenderableType:
    """How a solve ended, in a line."""
    return Text.assemble(_headline(design.task.name, design.status), f" ({folder})")


def alternatives_summary(ranked: Sequence[Alternative], folder: Path) -> RenderableType:
    """What each seed gave, best first, and where it is."""
    table = Table("seed", "status", "joints", box=SIMPLE_HEAD)
    for column in ("margin %", "torque N·m"):
        table.add_column(column, justify="right", no_wrap=True)
    table.add_column(f"in {folder}", overflow="fold")
    for one in ranked:
        design = one.design
        table.add_row(
            str(one.seed),
            Text(design.status, _STYLES[design.status]),
            "+".join(map(str, one.joints)),
            # Of a limit that is missed by much the share says nothing to a reader.
            f"{100 * one.margin:.0f}" if one.margin >= 0 else "",
            f"{one.torque:.3g}" if math.isfinite(one.torque) else "",
            Text(_place(one, one is ranked[0])),
        )
    note = "margin: the smallest share left of the limits on contacts, clearance and motors, or of the friction"
    return Group(Text("Hands from all seeds, best first"), table, Text(note))


def audit_summary(found: Audit) -> RenderableType:
    """The figures of an audit and what is wrong."""
    status = "certified" if found.certified else "not certified"
    if found.certified and "replay_position" not in found.figures:
        status = "the files hold; not replayed"
    headline = _headline(found.name, status)
    lines = [Text(f"- {why}") for why in found.reasons] + [Text(f"note: {note}") for note in found.notes]
    return Group(headline, certificate_table(found.as_certificate()), *lines)


def certificate_table(certificate: Mapping[str, Mapping[str, Any]]) -> Table:
    """The ``certificate`` of result.json for the terminal: the worst value of each figure, and its limit."""
    table = Table("figure", box=SIMPLE_HEAD)
    for column in ("value", "limit"):
        table.add_column(column, justify="right", no_wrap=True)
    table.add_column("unit")
    table.add_column("")
    for name, figure in certificate.items():
        value, limit, unit = figure["value"], figure["limit"], figure.get("unit", "")
        verdict = ("", "") if limit is None else ("holds", "green") if figure["holds"] else ("missed", "red")
        table.add_row(
            name.replace("_", " "),
            "none" if value is None else _number(value, unit)[0],
            "" if limit is None else _number(limit, unit)[0],
            _number(0.0, unit)[1],
            Text(*verdict),
        )
    return table


def replay_summary(played: Replays) -> RenderableType:
    """Errors of the replay as planned, at the goals too, and of those perturbed ones that kept the object."""
    nominal, perturbed = played.nominal, list(played.perturbed.values())
    table = Table(box=SIMPLE_HEAD, collapse_padding=True, pad_edge=False)
    table.add_column("", no_wrap=True)
    for column in ("mean mm", "max mm", "end mm", "mean deg", "max deg", "end deg"):
        table.add_column(column, justify="right", no_wrap=True)
    table.add_row("as planned", *_errors([nominal], np.mean))
    held = [each for each in perturbed if not each.dropped]
    if held:
        table.add_row(f"{len(held)} perturbed, mean", *_errors(held, np.mean))
        table.add_row(f"{len(held)} perturbed, worst", *_errors(held, np.max))
    lost = f"; lost at the end: {', '.join(nominal.lost_contacts)}" if nominal.lost_contacts else ""
    parts: list[RenderableType] = [
        Text("The object's distance and angle from the plan"),
        table,
        Text(f"as planned: {'dropped' if nominal.dropped else 'not dropped'}{lost}"),
    ]
    for number, goal in enumerate(nominal.goals, start=1):
        angle = "" if goal.angle is None else f", {goal.angle:.3g} deg"
        parts.append(Text(f"from goal {number}: {1e3 * goal.position:.3g} mm{angle}"))
    if perturbed:
        parts.append(Text(f"perturbed: dropped in {len(perturbed) - len(held)} of {len(perturbed)}"))
    parts += [Text(f"- {figure.reason}") for figure in played.figures() if not figure.holds]
    return Group(*parts)


def _place(one: Alternative, best: bool) -> str:
    """Where a seed's hand is, or why it is not there."""
    if one.design.status == "failed":
        return one.design.reason
    if one.like is not None:
        return f"dropped: like that of seed {one.like}"
    if not one.kept:
        return "dropped: enough others are better"
    # Late, because it loads the solver, which other summaries do without.
    from casadi_hands.pipeline.alternatives import seed_folder

    place = str(seed_folder(Path(), one.seed))
    return f"{place}, and here" if best else place


def _number(value: float, unit: str) -> tuple[str, str]:
    """A figure's value and its unit as shown to a reader."""
    number, _, suffix = show(value, unit).partition(" ")
    return number, suffix.removeprefix("of the ")


def _headline(name: str, status: str) -> Text:
    return Text.assemble((name, "bold"), ": ", (status, _STYLES.get(status, "bold red")))


def _errors(replays: Sequence[Replay], reduce: Callable[[list[float]], Any]) -> list[str]:
    """Position (mm) and angle (deg) errors - mean, largest, final - reduced over the replays."""
    return [
        f"{scale * reduce([getattr(each, f'{kind}_{which}') for each in replays]):.3g}"
        for kind, scale in (("position", 1e3), ("angle", 1.0))
        for which in ("mean", "max", "final")
    ]
