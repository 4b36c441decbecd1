"""Parts of the page as HTML; every text that is put in is escaped."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from html import escape


class Html(str):
    """Text that is HTML already."""


def text(value: str) -> str:
    """A text as HTML: escaped, unless it is that already."""
    return value if isinstance(value, Html) else escape(value)


def table(head: Sequence[str], rows: Iterable[Sequence[str]], kind: str = "") -> Html:
    """A table that scrolls by itself where it is wider than the page; its first column names the rows.

    Args:
        head: of the columns; an empty one for a column of words.
        rows: of cells, escaped unless they are `Html`.
        kind: CSS class.
    """
    top = "".join(f'<th scope="col">{text(each)}</th>' for each in head)
    body = "".join(
        f'<tr><th scope="row">{text(first)}</th>{"".join(f"<td>{text(cell)}</td>" for cell in rest)}</tr>'
        for first, *rest in rows
    )
    return Html(
        f'<div class="scroll"><table class="{kind}"><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>'
    )


def section(name: str, title: str, *parts: str) -> Html:
    """A section with a heading; parts are HTML."""
    return Html(f'<section id="{name}"><h2>{text(title)}</h2>{"".join(parts)}</section>')


def paragraph(words: str, kind: str = "") -> Html:
    """A paragraph."""
    return Html(f"<p{f' class={kind!r}' if kind else ''}>{text(words)}</p>")


def details(summary: str, *parts: str) -> Html:
    """What is folded until it is asked for; printed unfolded."""
    return Html(f"<details><summary>{text(summary)}</summary>{''.join(parts)}</details>")


def bar(share: float, words: str, kind: str = "") -> Html:
    """A bar of a share, at most whole, with words beside it."""
    width = 100 * min(max(share, 0.0), 1.0)
    return Html(
        f'<span class="share {kind}"><span class="bar"><span style="width: {width:.1f}%"></span></span>'
        f"<span>{text(words)}</span></span>"
    )


def badge(words: str, kind: str) -> Html:
    """A word that stands out, in the colour of its kind: good, warn or bad."""
    return Html(f'<span class="badge {kind}">{text(words)}</span>')


def number(words: str) -> str:
    """Numbers in a text as print has them: 2e-06 is 2 × 10⁻⁶, with a minus sign that is none of hyphens."""
    words = re.sub(r"(\d)e([+-])0*(\d+)\b", lambda m: f"{m[1]} × 10{_raised(m[2] + m[3])}", words)
    return re.sub(r"(?<![\w-])-(?=\d)", "−", words)


def _raised(power: str) -> str:
    return power.removeprefix("+").translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def signed(value: float, digits: int) -> str:
    """A number with so many decimals; zero has no sign."""
    return number(f"{round(value, digits) + 0.0:.{digits}f}")


def percent(share: float) -> str:
    """A share as a reader likes it."""
    if share > 10:
        return "more than 1000 %"
    if 0 < share < 1e-4:
        return "less than 0.01 %"
    return f"{100 * share:.0f} %" if share >= 0.01 or share == 0 else f"{100 * share:.2g} %"
