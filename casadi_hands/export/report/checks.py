"""What was checked: the audit's figures with their limits, the replays, and reasons beside what is missed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from casadi_hands.export.report import markup as html
from casadi_hands.export.report.data import goal_errors
from casadi_hands.export.report.words import figure_title, in_words
from casadi_hands.verify.report import show

if TYPE_CHECKING:
    from casadi_hands.problem.hand import Hand
    from casadi_hands.problem.result import Result


def audit_section(design: Result) -> html.Html:
    """Every figure of the certificate, those that are missed first, each with where it is worst."""
    if not design.certificate:
        return html.section("audit", "What was checked", html.paragraph("Nothing was checked: there is no motion."))
    figures = design.certificate
    missed = [name for name in figures if not figures[name]["holds"]]
    asked = [name for name in figures if name not in missed and figures[name].get("limit") is not None]
    others = [name for name in figures if name not in missed and figures[name].get("limit") is None]
    what = f"{len(asked)} of {len(asked) + len(missed)} limits are kept."
    parts = [html.paragraph(f"Computed anew from the files, by formulas that the design took no part in. {what}")]
    for words, names in (("Missed", missed), ("Kept", asked), ("Told, with no limit", others)):
        if names:
            rows = "".join(_figure(design.hand, name, figures[name]) for name in names)
            parts.append(html.Html(f'<h3>{words}</h3><div class="figures">{rows}</div>'))
    return html.section("audit", "What was checked", *parts)


def _figure(hand: Hand | None, name: str, figure: Mapping[str, Any]) -> html.Html:
    value, limit, unit = figure.get("value"), figure.get("limit"), figure.get("unit", "")
    shown = "none" if value is None else _shown(value, unit)
    kind = "bad" if not figure["holds"] else "" if limit is None else "good"
    asked = html.Html("") if limit is None else _limit(value, limit, unit, figure["holds"])
    found = str(figure.get("where") or "")
    where = html.paragraph(_sentence(html.number(in_words(found, hand))), "where") if found else ""
    verdict = html.badge("missed" if kind == "bad" else "kept", kind) if kind else ""
    return html.Html(
        f'<div class="figure {kind}"><div class="what"><b>{html.text(figure_title(name))}</b>{where}</div>'
        f'<div class="numbers"><div class="value">{html.text(shown)}</div><div class="limit">{asked}</div></div>'
        f"<div>{verdict}</div></div>"
    )


def _limit(value: float | None, limit: float, unit: str, holds: bool) -> html.Html:
    """A limit with how much of it is used; of one that is a least value, nothing is."""
    if value is None or limit <= 0 or holds == (value > limit):
        least = value is not None and holds and value > limit
        return html.Html(html.text(f"at {'least' if least else 'most'} {_shown(limit, unit)}"))
    return html.bar(
        value / limit, f"{html.percent(max(value, 0.0) / limit)} of {_shown(limit, unit)}", "" if holds else "bad"
    )


def _shown(value: float, unit: str) -> str:
    try:
        return html.number(show(value, unit).replace(" deg", "°"))
    except KeyError:  # of another version, or a person's own
        return html.number(f"{value:.3g} {unit}".strip())


def _sentence(words: str) -> str:
    return words[:1].upper() + words[1:] + ("" if words.endswith((".", "?")) else ".")


def replay_section(design: Result) -> html.Html:
    """What physics engines that took no part in the design made of it: at goals, on the way, and disturbed."""
    title = "How it plays in a simulator"
    if not design.replays:
        return html.section("replays", title, html.paragraph("It was not played."))
    parts = []
    for played in design.replays:
        engine = {"mujoco": "MuJoCo", "drake": "Drake"}.get(str(played.get("engine")), str(played.get("engine")))
        words = f"Played in {engine} as planned, the hand is off the plan by {_off(played.get('mean'))} on average"
        if played["dropped_as_planned"]:
            words = f"Played in {engine} as planned, the hand drops the object"
        limit = design.certificate.get("replay_dropped", {}).get("limit")
        most = "" if limit is None else f" ({html.percent(limit)} may)"
        parts.append(
            html.paragraph(f"{words}; {played['dropped']} of {played['of']} disturbed replays drop the object{most}.")
        )
        if played.get("goals"):
            parts.append(_goal_table(design, played))
        perturbed = played.get("perturbed", {})
        if perturbed:
            rows = [
                (
                    name,
                    _off(each.get("mean")),
                    _off(each.get("largest")),
                    html.badge("drops it", "bad") if each["dropped"] else "",
                )
                for name, each in sorted(perturbed.items(), key=lambda item: not item[1]["dropped"])
            ]
            head = ("", "Off the plan on average", "At most", "")
            parts.append(html.details(f"The {len(perturbed)} disturbed replays", html.table(head, rows)))
    return html.section("replays", title, *parts)


def _goal_table(design: Result, played: Mapping[str, Any]) -> html.Html:
    """Errors at each goal, planned and played, and what is allowed."""
    planned = goal_errors(design.task, design.motion) if design.motion else []
    rows: list[tuple[str, ...]] = []
    for k, each in enumerate(played["goals"]):
        at = f"{design.task.motion[k].at:g} s" if k < len(design.task.motion) else ""
        plan = _error(*planned[k]) if k < len(planned) else ""
        rows.append((f"goal {k + 1}", at, plan, _error(each["mm"], each["degrees"])))
    limits = [
        _error(*((scale * limit if limit is not None else None) for scale, limit in ((1e3, place), (1.0, turn))))
        for place, turn in (
            tuple(design.certificate.get(f"{kind}{what}", {}).get("limit") for what in ("_position", "_angle"))
            for kind in ("goal", "replay")
        )
    ]
    rows.append(("at most", "", *limits))
    return html.table(("Error at each goal", "due", "planned", "simulated"), rows)


def _error(mm: float | None, turn: float | None) -> str:
    parts = [f"{mm:.2g} mm"] if mm is not None else []
    return ", ".join([*parts, *([f"{turn:.2g}°"] if turn is not None else [])])


def _off(error: Mapping[str, Any] | None) -> str:
    if error is None:
        return ""
    return _error(error.get("mm"), error.get("degrees"))
