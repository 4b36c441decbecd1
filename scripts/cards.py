"""The gallery's page: one file that needs no other and no network, with a card for each task."""

from __future__ import annotations

import json
import os
import re
from base64 import b64encode
from collections import Counter
from html import escape
from pathlib import Path

from entries import STATES, Entry
from shared import NOTHING
from stills import kept_stills, stills

from casadi_hands.export.design import Design

TEMPLATE = Path(__file__).with_name("gallery.html")
_previews: dict[Path, bytes] = {}  # what tasks without a design look like, by file


def page(cards: list[list[Entry]], place: Path) -> str:
    """The page's text.

    Args:
        cards: for each task its entries, the best first.
        place: folder that the page will be in; links to viewers are relative to it.
    """
    best = [entries[0] for entries in cards]
    count = Counter(entry.state for entry in best)
    solved = len(best) - count["not solved"]
    so_far = "" if solved == len(best) else f" of {solved} solved so far,"
    summary = (
        f"Robot hands designed from task files: topology, morphology, motion and forces. {len(best)} tasks;{so_far} "
        f"{count['certified']} certified: recomputed from the result's files, every physical limit holds, and replayed "
        "in MuJoCo the hand does its task."
    )
    parts = {
        "title": "Hands by casadi-hands",
        "summary": escape(summary),
        "filter": _filter(count, len(best)),
        "cards": "\n".join(card(entries, place) for entries in cards),
        "versions": escape(_versions(best)),
    }
    template = TEMPLATE.read_text(encoding="utf-8")
    return re.sub(r"\{\{(\w+)\}\}", lambda slot: parts[slot[1]], template)


def card(entries: list[Entry], place: Path) -> str:
    """A task's card: pictures and figures of its best entry, links to all."""
    entry = entries[0]
    figure = f"figure {', '.join(entry.figures)}" if entry.figures else ""
    reason = f'<p class="reason">{escape(_short(entry.reason))}</p>' if entry.reason else ""
    about = f'<p class="about">{escape(entry.about)}</p>' if entry.about else ""
    joints = f"<span>{entry.structure} joints</span>" if entry.structure != NOTHING else ""
    state = entry.state.replace(" ", "-")
    return f"""<article class="card-{state}" data-status="{state}">
{_stage(entry)}
<div class="text">
<div class="head"><h2>{escape(entry.name)}</h2><span class="figure">{figure}</span></div>
{about}
<div class="status"><span class="badge {state}">{entry.state}</span>{joints}</div>
{reason}
{_figures(entry)}
<div class="foot">{_foot(entries, place)}</div>
</div>
</article>"""


def _stage(entry: Entry) -> str:
    """The pictures, and a button for each moment where there are several."""
    if entry.task is None:
        return '<div class="stage"><span class="nothing">not a task</span></div>'
    name = escape(entry.name, quote=True)
    if entry.design is None or entry.folder is None or not (entry.folder / "result.json").is_file():
        if entry.file not in _previews:
            _previews[entry.file] = stills(Design(entry.task, "failed"), [0.0])[0]
        moments = [(0.0, _previews[entry.file])]
    else:
        moments = kept_stills(entry.design, entry.folder)
    pictures = "".join(
        f'<img alt="{name} at {time:.3g} s" src="data:image/webp;base64,{b64encode(data).decode("ascii")}"'
        f"{' class=shown' if k == len(moments) // 2 else ''}>"
        for k, (time, data) in enumerate(moments)
    )
    buttons = "".join(f'<button data-time="{t:.3g} s" aria-label="{t:.3g} s"></button>' for t, _ in moments)
    return (
        f'<div class="stage">{pictures}<span class="time"></span></div>'
        f'<div class="strip">{buttons if len(moments) > 1 else ""}</div>'
    )


def _figures(entry: Entry) -> str:
    """The audit's figures and the replay, those that miss their limit marked."""
    if entry.design is None or not entry.design.certificate:
        return ""

    def millimetres(name: str) -> str:
        text = entry.figure(name, 1e3)
        if text == NOTHING:
            return text
        # Finer than a micrometre is not worth a wider column.
        return "< 0.001 mm" if 0 < float(text) < 1e-3 else f"{text} mm"

    cells = [
        ("goal error", entry.goal_error, entry.misses("goal_position", "goal_angle")),
        ("slip", millimetres("slip"), entry.misses("slip")),
        ("penetration", millimetres("penetration"), entry.misses("penetration")),
        ("replay", entry.replay_error, entry.replay_error == "dropped"),
        ("residual", entry.figure("residual", 1.0, ".0e"), entry.misses("residual", "residual_between")),
        ("dropped", entry.drops, False),
    ]
    return f"<dl>{''.join(_cell(*cell) for cell in cells)}</dl>"


def _cell(label: str, value: str, missed: bool) -> str:
    return f"<div><dt>{escape(label)}</dt><dd{' class=missed' if missed else ''}>{escape(value)}</dd></div>"


def _foot(entries: list[Entry], place: Path) -> str:
    """Time, and a link to the viewer of every seed."""
    links = []
    for entry in entries:
        seed = f"seed {entry.seed}: {entry.state}" if len(entries) > 1 else "watch it move"
        viewer = entry.folder / "viewer.html" if entry.folder else None
        if viewer is not None and viewer.is_file():
            target = Path(os.path.relpath(viewer, place)).as_posix()
            links.append(f'<a href="{escape(target, quote=True)}">{seed}</a>')
        elif len(entries) > 1:
            links.append(f"<span>{seed}</span>")
    time = "" if entries[0].seconds == NOTHING else f"<span>{entries[0].seconds} s</span>"
    return " ".join([*links, time]).strip()


def _filter(count: Counter[str], total: int) -> str:
    """Buttons for all cards and for those of each state that there is."""
    buttons = [f'<button data-status="" aria-pressed="true">all <b>{total}</b></button>']
    buttons += [
        f'<button data-status="{state.replace(" ", "-")}" aria-pressed="false">{state} <b>{count[state]}</b></button>'
        for state in STATES
        if count[state]
    ]
    return "".join(buttons)


def _short(reason: str, longest: int = 300) -> str:
    """A reason short enough for a card; the first of several is the one that the others follow from."""
    return reason if len(reason) <= longest else reason[:longest].rsplit(" ", 1)[0] + " …"


def _versions(entries: list[Entry]) -> str:
    """Versions that the first result was made with."""
    for entry in entries:
        file = entry.folder / "result.json" if entry.folder else None
        if file is not None and file.is_file():
            versions = json.loads(file.read_text(encoding="utf-8"))["versions"]
            return " · ".join(f"{name} {version}" for name, version in versions.items())
    return ""
