"""The hands of other seeds for the same task, side by side."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from casadi_hands.errors import DesignError
from casadi_hands.export.checked import read_record
from casadi_hands.export.record import hand_from_record
from casadi_hands.export.report.drawing import palm_drawing
from casadi_hands.export.report.markup import Html, badge, paragraph, percent, section, table, text
from casadi_hands.export.report.words import status_kind
from casadi_hands.problem.hand import Hand
from casadi_hands.problem.stored import read_json


@dataclass(frozen=True)
class Seed:
    """What one seed gave, as ``alternatives/ranking.json`` has it.

    Attributes:
        seed: of the search.
        status, reason: of its design.
        joints: of each finger.
        margin: the smallest share left of any limit, or None.
        torque: the largest of a joint or motor, N·m, or None.
        kept: whether its folder is there.
        like: the better seed's hand that it is like, or None.
        hand: of what is kept; None where it cannot be read.
    """

    seed: int
    status: str
    reason: str
    joints: tuple[int, ...]
    margin: float | None
    torque: float | None
    kept: bool
    like: int | None
    hand: Hand | None

    @property
    def folder(self) -> str:
        """Where its files are, relative to the page."""
        return f"alternatives/seed{self.seed}"


def read_alternatives(directory: Path) -> list[Seed]:
    """What the seeds of an exploration gave, best first; nothing where the folder is of a single solve.

    Args:
        directory: the exploration's.

    Raises:
        DesignError: the ranking cannot be read.
    """
    path = directory / "alternatives" / "ranking.json"
    if not path.is_file():
        return []
    try:
        return [_seed(directory, entry) for entry in read_json(path)["seeds"]]
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise DesignError(f"{path}: cannot be read: {error!r}") from error


def _seed(directory: Path, entry: dict[str, Any]) -> Seed:
    seed, kept = int(entry["seed"]), bool(entry["kept"])
    margin, torque = (None if entry[name] is None else float(entry[name]) for name in ("margin", "torque"))
    return Seed(
        seed,
        str(entry["status"]),
        str(entry["reason"]),
        tuple(int(each) for each in entry["joints"]),
        margin,
        torque,
        kept,
        None if entry["like"] is None else int(entry["like"]),
        _hand(directory / "alternatives" / f"seed{seed}" / "result.json") if kept else None,
    )


def _hand(path: Path) -> Hand | None:
    if not path.is_file():
        return None
    return hand_from_record(read_record(path.parent))


def alternatives_section(seeds: list[Seed]) -> Html:
    """Cards of the hands that are kept, and a table of all seeds.

    Args:
        seeds: best first.
    """
    if len(seeds) < 2:
        return Html("")
    cards = "".join(_card(each, number) for number, each in enumerate(seeds) if each.kept)
    rows = [
        (
            f"seed {each.seed}",
            badge(each.status, status_kind(each.status)),
            "+".join(map(str, each.joints)),
            "" if each.margin is None or each.margin < 0 else percent(each.margin),
            "" if each.torque is None else f"{each.torque:.3g}",
            _fate(each, number),
        )
        for number, each in enumerate(seeds)
    ]
    head = ("", "", "joints", "smallest margin", "largest torque, N·m", "")
    words = "Hands for the same task from other starts of the search, best first; this page is of the best."
    return section(
        "alternatives",
        "Other hands for this task",
        paragraph(words),
        f'<div class="cards">{cards}</div>',
        table(head, rows, "words"),
    )


def _fate(each: Seed, number: int) -> str:
    if number == 0:
        return "this hand"
    if each.status == "failed":
        return each.reason
    if each.like is not None:
        return f"like that of seed {each.like}"
    return "" if each.kept else "not kept: enough others are better"


def _card(each: Seed, number: int) -> str:
    drawn, facts = "", f"{'+'.join(map(str, each.joints)) or 'no'} joints"
    if each.hand is not None:
        drawn = palm_drawing(each.hand, numbers=False)
        whole = 1e3 * sum(link.length for finger in each.hand.fingers for link in finger.links)
        facts += f" on {each.hand.motors} motors, {whole:.0f} mm of fingers"
    links = f'<a href="{each.folder}/viewer.html">watch</a> · <a href="{each.folder}/report.html">report</a>'
    here = "this hand" if number == 0 else links
    return (
        f'<div class="card">{drawn}<p><b>seed {each.seed}</b> {badge(each.status, status_kind(each.status))}<br>'
        f"{text(facts)}<br>{here}</p></div>"
    )
