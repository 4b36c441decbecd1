"""Arguments and options that several commands have."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer


class Stage(StrEnum):
    """The stages of a solve, in order (``casadi_hands.pipeline.STAGES``)."""

    FLOATING = "floating"
    SYNTHESIS = "synthesis"
    WHOLE_HAND = "whole_hand"
    REFINE = "refine"


class Shape(StrEnum):
    """Shapes that a new task may begin with (``casadi_hands.task.starter.SIZES``)."""

    SPHERE = "sphere"
    CAPSULE = "capsule"
    CYLINDER = "cylinder"
    BOX = "box"


class Motion(StrEnum):
    """What a new task may begin with (``casadi_hands.task.starter.MOTIONS``)."""

    LIFT = "lift"
    CARRY = "carry"
    TURN = "turn"
    TILT = "tilt"


TaskFile = Annotated[Path, typer.Argument(metavar="TASK", help="A task file (YAML).", show_default=False)]
Folder = Annotated[
    Path, typer.Argument(metavar="DIR", help="A folder that `casadi-hands solve` wrote.", show_default=False)
]
Jobs = Annotated[
    int | None,
    typer.Option(min=1, help="Processes to use; the result does not depend on it.", show_default="all cores"),
]
Seed = Annotated[int | None, typer.Option(min=0, help="Seed of the random numbers.", show_default="the task's")]
