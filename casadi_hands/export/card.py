"""A design at a glance: its facts in a line, and a card of a picture and a table for notebooks."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

from casadi_hands.export.picture import picture
from casadi_hands.problem.result import Result
from casadi_hands.verify.report import show

_COLORS = {"certified": "#1a7f37", "feasible": "#9a6700", "failed": "#cf222e"}


def facts(design: Result) -> list[str]:
    """How it ended, joints of each finger, motors that share them, and the time it took."""
    found = [design.status]
    if design.hand is not None:
        joints = "+".join(str(len(finger.links)) for finger in design.hand.fingers)
        found.append(f"{joints} joints")
        if design.hand.drive is not None:
            found.append(f"{design.hand.motors} motor{'' if design.hand.motors == 1 else 's'}")
    if "total" in design.seconds:
        found.append(f"{design.seconds['total']:.0f} s")
    return found


def design_card(design: Result) -> str:
    """HTML of a design: its facts, why it is not certified, the hand at the start, and the certificate."""
    color = _COLORS[design.status]
    title = f"<b>{escape(design.task.name)}</b>: <b style='color:{color}'>{escape(facts(design)[0])}</b>"
    rest = "".join(f", {escape(each)}" for each in facts(design)[1:])
    reason = f"<p>{escape(design.reason)}</p>" if design.reason else ""
    table = ""
    if design.certificate:
        head = "".join(f"<th style='text-align:left'>{each}</th>" for each in ("figure", "worst", "limit", ""))
        table = f"<table><tr>{head}</tr>{''.join(_rows(design))}</table>"
    sides = "display:flex;flex-wrap:wrap;gap:1em;align-items:flex-start"
    return f"<div><p>{title}{rest}</p>{reason}<div style='{sides}'>{picture(design)}{table}</div></div>"


def _rows(design: Result) -> Iterator[str]:
    """A row for each figure."""
    for name, figure in design.certificate.items():
        value, limit, unit = (figure.get(each) for each in ("value", "limit", "unit"))
        shown = ["" if each is None else escape(show(float(each), unit or "")) for each in (value, limit)]
        verdict = "" if limit is None else "holds" if figure["holds"] else "<b>missed</b>"
        cells = [escape(name.replace("_", " ")), *shown, verdict]
        entries = "".join(f"<td style='text-align:left'>{each}</td>" for each in cells)
        yield f"<tr>{entries}</tr>"
