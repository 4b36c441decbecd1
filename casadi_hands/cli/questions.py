"""The questions of ``casadi-hands new``, each with an answer to begin with."""

from __future__ import annotations

from collections.abc import Callable, Set
from dataclasses import replace
from typing import Any

import typer

from casadi_hands.errors import TaskError
from casadi_hands.task.starter import MOTIONS, SIZES, USUAL, Idea, starter

_MOTIONS = "lift it, carry it to one side and back, turn it about the vertical, or tilt it"


def numbers(text: str) -> tuple[float, ...]:
    """Numbers with spaces, commas or × between.

    Raises:
        TaskError: other words among them.
    """
    words = text.replace(",", " ").replace("×", " ").split()
    try:
        return tuple(float(word) for word in words)
    except ValueError:
        raise TaskError(f"size: given {text!r}; allowed: numbers in mm with spaces between") from None


def ask(idea: Idea, known: Set[str]) -> Idea:
    """Ask for all that is not known, until each answer can be used.

    Args:
        idea: what is known already, and what Enter takes.
        known: fields that are not asked for.
    """

    def answer(field: str, text: str, default: Any, read: Callable[[str], Any] = str) -> None:
        nonlocal idea
        while field not in known:
            try:
                changed = replace(idea, **{field: read(typer.prompt(text, default=default, type=str))})
                if field == "fingers":
                    starter(changed)  # whether they have room
                idea = changed
                return
            except ValueError:
                typer.echo("a number, please")
            except TaskError as error:
                typer.echo(str(error))

    answer("shape", f"What shape has the object ({', '.join(SIZES)})?", idea.shape)
    usual = " ".join(f"{each:g}" for each in idea.size or USUAL[idea.shape])
    answer("size", f"Its {', '.join(SIZES[idea.shape])} in mm?", usual, numbers)
    answer("mass", "Its mass in g?", f"{1e3 * idea.kilograms:g}", float)
    answer("motion", f"What shall the hand do ({', '.join(MOTIONS)}): {_MOTIONS}?", idea.motion)
    answer("amount", f"How far, in {MOTIONS[idea.motion]}?", f"{idea.far:g}", float)
    if idea.motion in ("lift", "turn"):
        answer("table", "Does it lie on a table at first (yes, no)?", "yes" if idea.table else "no", _yes)
    answer("fingers", "How many fingers (2 to 5)?", str(idea.fingers), int)
    return idea


def _yes(text: str) -> bool:
    if text.strip().lower() in ("y", "yes", "true"):
        return True
    if text.strip().lower() in ("n", "no", "false"):
        return False
    raise TaskError(f"given {text!r}; allowed: yes or no")
