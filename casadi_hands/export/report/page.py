"""``report.html`` put together: the moving hand, dimensions, plots, checks, motors, costs and alternatives."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from casadi_hands.export.page.page import packed, page_text
from casadi_hands.export.report.alternatives import Seed, alternatives_section
from casadi_hands.export.report.checks import audit_section, replay_section
from casadi_hands.export.report.data import Panel, panels, plotted, with_commands
from casadi_hands.export.report.dimensions import dimensions_section
from casadi_hands.export.report.effort import costs_section, motors_section, run_panel
from casadi_hands.export.report.markup import Html, badge, number, paragraph, section, table, text
from casadi_hands.export.report.placement import placement_section
from casadi_hands.export.report.words import in_words, stage_title, status_kind

if TYPE_CHECKING:
    from casadi_hands.problem.result import Result

REPORT = "report.html"


def write_report(design: Result, path: Path, alternatives: Sequence[Seed] = ()) -> None:
    """Write the report of a design, the same bytes for the same design.

    Args:
        design: whole or partial; what does not exist is not told.
        path: the file to write.
        alternatives: hands for the same task, best first, as `read_alternatives` gives them.
    """
    path.write_text(report_text(design, alternatives), encoding="utf-8")


def report_text(design: Result, alternatives: Sequence[Seed] = ()) -> str:
    """The report of a design as one page of HTML; arguments as of `write_report`."""
    found = panels(design)
    motion = with_commands(design) if design.hand is not None and design.motion is not None else design.motion
    sections = [
        _moving(design),
        audit_section(design),
        replay_section(design),
        dimensions_section(design.hand, motion),
        _plots(design, found),
        motors_section(design),
        costs_section(design),
        alternatives_section(list(alternatives)),
        placement_section(design),
        _made(design),
    ]
    parts = {
        "title": escape(design.task.name),
        "head": _head(design),
        "sections": "".join(sections),
        "links": "".join(
            f'<a href="#{name}">{title}</a>'
            for name, title in re.findall(r'<section id="(\w+)"><h2>([^<]*)</h2>', "".join(sections))
        ),
        "data": json.dumps(_data(design, found), allow_nan=False).replace("<", "\\u003c"),
        "viewer": packed(page_text(design)),
        "licence": _file("vendor/uPlot.LICENSE").strip(),
        "plot_style": _file("vendor/uPlot.min.css"),
        "style": _file("report.css"),
        "plot_script": _file("vendor/uPlot.iife.min.js"),
        "script": _file("report.js"),
    }
    page = re.sub(r"\{\{(\w+)\}\}", lambda slot: parts[slot[1]], _file("report.html"))
    return page.replace(_SIZE, f"{len(page.encode('utf-8')) / 1e6:.1f} MB", 1)


_SIZE = "<!--size-->"


def _file(name: str) -> str:
    return files("casadi_hands.export.report").joinpath(name).read_text(encoding="utf-8")


def _head(design: Result) -> Html:
    """What it is, how it ended, and why not better."""
    task, hand, motion = design.task, design.hand, design.motion
    facts = [f"An object of {1e3 * task.object.mass:.3g} g"]
    if hand is not None:
        joints, motors = hand.degrees_of_freedom, hand.motors
        fingers = f"{len(hand.fingers)} finger{'' if len(hand.fingers) == 1 else 's'}"
        shared = f" on {motors} motor{'' if motors == 1 else 's'}" if hand.drive else ", each with its motor"
        facts.append(f"{fingers}, {joints} joint{'' if joints == 1 else 's'}{shared}")
    if motion is not None:
        facts.append(f"{len(task.motion)} goals in {motion.time[-1] - motion.time[0]:.3g} s")
    status = badge(design.status, status_kind(design.status))
    reason = ""
    if design.reason:
        words = number(in_words(design.reason, hand))
        words = words[:1].upper() + words[1:]
        reason = paragraph(words + ("" if words.endswith(".") else "."), f"reason {status_kind(design.status)}")
    meaning = {
        "certified": "Every limit is kept, in the files and in a simulator that took no part in the design.",
        "feasible": "There is a motion, and a limit is missed or not judged.",
        "failed": "There is no motion that does the task.",
    }[design.status]
    return Html(f"<h1>{text(task.name)} {status}</h1><p>{text('; '.join(facts))}. {text(meaning)}</p>{reason}")


def _moving(design: Result) -> Html:
    """The frame for the viewer's page, and a place for pictures of the goals."""
    return section(
        "moving",
        "The moving hand",
        '<iframe id="viewer" title="the hand and the object, moving"></iframe><div id="goals" class="strip"></div>',
        '<p class="note screen">Drag to turn, scroll or pinch to come nearer. Times below follow: drag over a plot, or '
        "press a picture of a goal, to go to a time.</p>",
    )


def _plots(design: Result, found: Sequence[Panel]) -> Html:
    """A place for each plot, with what is largest in it for who cannot see it."""
    title = "Over time"
    if not found or design.motion is None:
        return section("time", title, paragraph("There is no motion."))
    places = []
    for panel in found:
        most, about = panel.largest, panel.about
        if most is not None:
            label, value, k = most
            amount = number(f"{value:.3g}") + ("" if panel.unit == "°" else " ") + panel.unit
            about += f" Farthest from zero: {amount} at {design.motion.time[k]:.3g} s ({label})."
        unit = f", {panel.unit}" if panel.unit else ""
        places.append(
            f'<figure class="plot"><h3>{text(panel.title + unit)}</h3><div data-panel="{panel.key}"></div>'
            f"<figcaption>{text(about.strip())}</figcaption></figure>"
        )
    return section("time", title, f'<div class="plots">{"".join(places)}</div>')


def _made(design: Result) -> Html:
    """How long it took, and what the page is."""
    rows = [
        (stage_title(name), f"{seconds:.1f}")
        for name, seconds in sorted(design.seconds.items(), key=lambda item: item[0] == "total")
    ]
    spent = table(("Stage", "seconds"), rows) if rows else ""
    words = (
        f"This page is one file of {_SIZE}, made from the other files of its folder. It opens without a network and "
        "loads nothing. Plots by uPlot, scene by meshcat and three.js (all MIT)."
    )
    return section("made", "How it was made", spent, f'<p class="note">{words}</p>')


def _data(design: Result, found: Sequence[Panel]) -> dict[str, Any]:
    """What the page's script reads."""
    time = None if design.motion is None else design.motion.time
    runs = run_panel(design.stages)
    return {
        "plots": None if time is None else plotted(found, time),
        "runs": None if runs is None else plotted([runs[0]], runs[1]),
        "goals": [] if time is None else _moments(design),
    }


def _moments(design: Result) -> list[dict[str, Any]]:
    """The goals, of which the page takes pictures."""
    return [{"label": f"goal {k}", "time": goal.at} for k, goal in enumerate(design.task.motion, start=1)]
