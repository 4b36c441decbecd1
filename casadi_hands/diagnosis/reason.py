"""Why something failed, as the user reads it: what happened, by how much, and what to try."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

MOST = 3  # reasons that are told; who wants all of them reads the certificate


@dataclass(frozen=True)
class Reason:
    """One reason.

    Attributes:
        what: who misses which limit, when and by how much; a clause without a full stop.
        advice: what to try.
        explains: figures of the audit that are missed because of this.
        root: whether it follows from geometry or statics alone. What solvers were left with may be a consequence
            of it, and is not told beside it.
    """

    what: str
    advice: str
    explains: frozenset[str] = frozenset()
    root: bool = False

    @property
    def text(self) -> str:
        """The reason and its advice."""
        return f"{self.what}; try {self.advice}"


def format_reasons(causes: Iterable[Reason], missed: Iterable[tuple[str, Reason]] = (), most: int = MOST) -> str:
    """Put reasons into one text: causes first, then what is missed that none of the causes explains.

    Args:
        causes: of the stages, most fundamental first; where there are roots, others are left out.
        missed: (figure of the audit, reason).
        most: reasons that are spelled out.
    """
    causes, missed = list(causes), list(missed)
    causes = [cause for cause in causes if cause.root] or causes
    explained = frozenset().union(*(cause.explains for cause in causes))
    reasons = [*causes, *(reason for figure, reason in missed if figure not in explained)]
    sentences = [reason.text for reason in reasons[:most]]
    if len(reasons) > most:
        more = len(reasons) - most
        sentences.append(f"{more} more limit{'s are' if more > 1 else ' is'} missed, see the certificate")
    return ". ".join(sentences)


def joints_of(count: int) -> str:
    """``1 joint``, ``2 joints``."""
    return f"{count} joint{'' if count == 1 else 's'}"
