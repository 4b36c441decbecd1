"""A design with its folder: what `solve` returns, saved and read back."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from casadi_hands.export.folder import read_design, save_design
from casadi_hands.problem.result import Result

if TYPE_CHECKING:
    from casadi_hands.problem.hand import Hand
    from casadi_hands.problem.motion import Motion


@dataclass(frozen=True, repr=False)
class Design(Result):
    """A designed hand, the motion it makes, and how it came about; see `Result` for the attributes."""

    if TYPE_CHECKING:
        # None of a solve that came to nothing. As with what `re.match(...).group()` returns, a checker lets it be used
        # unasked: who looks at the status first need not ask again.
        hand: Hand | Any = None
        motion: Motion | Any = None

    def __repr__(self) -> str:
        """What it is, in a line."""
        from casadi_hands.export.card import facts

        return f"Design({', '.join([repr(self.task.name), *facts(self)])})"

    def _repr_html_(self) -> str:
        """What a notebook shows: a picture of the start, and the certificate as a table."""
        # Late, because what draws takes a second to load.
        from casadi_hands.export.card import design_card

        return design_card(self)

    def save(self, directory: str | Path) -> None:
        """Write the result folder; a partial design writes the files for which there is something to write.

        Args:
            directory: made if it does not exist; files of an earlier design in it are replaced.

        Raises:
            DesignError: the folder cannot be written, or the design holds what cannot be.
        """
        save_design(self, Path(directory))

    @classmethod
    def load(cls, directory: str | Path) -> Design:
        """Read a result folder that `save` wrote.

        Args:
            directory: the folder.

        Raises:
            DesignError: there is no such folder, it is incomplete, or of another format.
        """
        return cls(**read_design(Path(directory)))
