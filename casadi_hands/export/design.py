"""A design with its folder: what `solve` returns, saved and read back."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from casadi_hands.export.folder import read_design, save_design
from casadi_hands.problem.result import Result


@dataclass(frozen=True)
class Design(Result):
    """A designed hand, the motion it makes, and how it came about; see `Result` for the attributes."""

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
