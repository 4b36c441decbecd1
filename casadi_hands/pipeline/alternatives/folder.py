"""The result folder of an exploration: the best hand, and beside it ``alternatives/`` with the best distinct ones."""

from __future__ import annotations

import math
import re
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from casadi_hands.errors import ELSEWHERE, DesignError
from casadi_hands.export.folder import remove_design
from casadi_hands.export.moving import replace_file
from casadi_hands.export.page.page import MenuEntry, write_page
from casadi_hands.export.record import record_text
from casadi_hands.export.report.alternatives import read_alternatives
from casadi_hands.export.report.page import REPORT, write_report
from casadi_hands.pipeline.alternatives.ranking import Alternative
from casadi_hands.pipeline.keeper import Keeper

FOLDER = "alternatives"
RANKING = "ranking.json"
_FORMAT = 1


def seed_folder(directory: Path, seed: int) -> Path:
    """Where the result folder of one seed is."""
    return directory / FOLDER / f"seed{seed}"


def write_ranking(ranked: Sequence[Alternative], directory: Path, keeper: Keeper, last: bool) -> None:
    """Write the best design into the folder itself, the ranking, the menus of what is kept, and the report of all.

    The folders of the seeds must have been written.

    Args:
        ranked: best first.
        directory: the exploration's.
        keeper: of the folder itself.
        last: whether all seeds are done.

    Raises:
        DesignError: the folder cannot be written.
    """
    keeper.keep(ranked[0].design, last)
    kept = [one for one in ranked if one.kept]
    record = {"format": _FORMAT, "seeds": [_entry(one) for one in ranked]}
    try:
        text = record_text(record)
        replace_file(directory / FOLDER / RANKING, lambda path: path.write_text(text, encoding="utf-8"))
        if len(kept) > 1:
            if keeper.rival is None:
                _write_menu(kept, kept[0], directory, f"{FOLDER}/")
            for one in kept:
                _write_menu(kept, one, seed_folder(directory, one.seed), "../")
        if keeper.rival is None:
            seeds = read_alternatives(directory)
            replace_file(directory / REPORT, lambda path: write_report(ranked[0].design, path, seeds))
    except OSError as error:
        raise DesignError(f"{directory}: cannot write the alternatives here: {error}", ELSEWHERE) from error


def remove_surplus(ranked: Sequence[Alternative], directory: Path) -> None:
    """Remove the folders of hands that are not kept; failed solves stay, for who wants to see how far they came."""
    for one in ranked:
        if not one.kept and one.design.status != "failed":
            remove_design(seed_folder(directory, one.seed))


def remove_alternatives(directory: Path) -> None:
    """Remove what an earlier exploration left beside the design of a folder, and nothing that is not its own.

    Raises:
        DesignError: it cannot be removed.
    """
    folder = directory / FOLDER
    if not folder.is_dir():
        return
    for each in folder.iterdir():
        if re.fullmatch(r"seed\d+", each.name) and each.is_dir():
            remove_design(each)
        elif re.fullmatch(r"\.seed\d+\.solve", each.name):
            shutil.rmtree(each, ignore_errors=True)
    try:
        (folder / RANKING).unlink(missing_ok=True)
        if not any(folder.iterdir()):
            folder.rmdir()
    except OSError as error:
        raise DesignError(f"{folder}: cannot remove the alternatives here: {error}", ELSEWHERE) from error


def _entry(one: Alternative) -> dict[str, Any]:
    """A seed as ``ranking.json`` has it; what is not finite is null."""
    return {
        "seed": one.seed,
        "status": one.design.status,
        "reason": one.design.reason,
        "joints": list(one.joints),
        "margin": one.margin if math.isfinite(one.margin) else None,
        "torque": one.torque if math.isfinite(one.torque) else None,
        "kept": one.kept,
        "like": one.like,
    }


def _write_menu(kept: Sequence[Alternative], shown: Alternative, directory: Path, to_seeds: str) -> None:
    """Write the page of one hand again, with the menu."""
    menu = [
        MenuEntry(
            f"seed {one.seed} · {'+'.join(map(str, one.joints)) or 'no'} joints · {one.design.status}",
            None if one is shown else f"{to_seeds}seed{one.seed}/viewer.html",
        )
        for one in kept
    ]
    replace_file(directory / "viewer.html", lambda path: write_page(shown.design, path, menu=menu))
