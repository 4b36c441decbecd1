"""What the studio's page says, as HTML."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

from casadi_hands.problem.result import Result
from casadi_hands.studio.understood import Understood

STYLE = """<style>
  textarea { font-family: ui-monospace, monospace !important; min-height: calc(100vh - 14rem) !important;
    max-height: none !important; white-space: pre !important; overflow-x: auto !important;
    line-height: 1.45 !important; }
  .mantine-Flex-root:has(textarea) > :first-child { display: none; }
  .mantine-Flex-root:has(textarea) > :last-child { flex-grow: 1; }
  .studio { font-size: 0.8rem; line-height: 1.4; padding: 0.1rem 0.5rem; overflow-wrap: anywhere; }
  .studio p { margin: 0.25rem 0; padding-left: 0.5rem; border-left: 3px solid var(--mark, #9aa5b1); }
  @media (min-width: 1200px) { .studio-narrow { display: none; } }
  @media (max-width: 576px) {
    textarea { min-height: 40vh !important; }
    .mantine-Paper-root[style*="position: fixed"] { width: 100% !important; max-height: 50% !important; }
    .mantine-Paper-root[style*="position: fixed"] .mantine-ScrollArea-content > div { width: 100% !important; }
  }
  .studio .good { --mark: #2f9e44; } .studio .bad { --mark: #e03131; } .studio .doubt { --mark: #f08c00; }
</style>"""
"""Of the whole page: viser shows six lines of a text, and a task file is longer."""


def told(lines: Iterable[tuple[str, str]]) -> str:
    """Paragraphs.

    Args:
        lines: a kind, ``good``, ``bad``, ``doubt`` or none, and a text for each.
    """
    return '<div class="studio">' + "".join(f'<p class="{kind}">{escape(text)}</p>' for kind, text in lines) + "</div>"


def findings_told(understood: Understood) -> str:
    """What `check` says of a text."""
    lines = [("bad", text) for text in understood.refusals]
    lines += [("bad", f"No hand can do this: {text}") for text in understood.impossible]
    lines += [("doubt", f"May fail: {text}") for text in understood.doubts]
    lines += [("doubt", f"Is this meant? {text}") for text in understood.questions]
    return told(lines or [("good", "The task can be used, and check finds nothing that speaks against it.")])


def in_narrow_windows(told: str) -> str:
    """What is said once more where panels are folded up for want of room."""
    return f'<div class="studio-narrow">{told}</div>'


def result_told(design: Result, name: str, running: bool) -> str:
    """How a design ended, or stands.

    Args:
        design: as its folder has it.
        name: of its folder.
        running: whether the solve goes on, and may find a better one.
    """
    if running and design.hand is None:
        return told([("", "So far there is no hand.")])
    usual = "doubt" if running or design.status != "failed" else "bad"
    parts = [f"{'So far, in' if running else 'In'} {name}: {design.status}"]
    if design.hand is not None:
        parts.append(f"{len(design.hand.fingers)} fingers, {design.hand.degrees_of_freedom} joints")
    if design.replays:
        parts.append(design.replay_words)
    lines = [("good" if design.status == "certified" else usual, "; ".join(parts))]
    return told([*lines, ("", design.reason)] if design.reason else lines)
