"""What a refine problem is built for: the joints of each finger, and when each contact touches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from casadi_hands.stages.model import Model


@dataclass(frozen=True)
class Structure:
    """What a refine problem is built for.

    Attributes:
        model: the task.
        contacts: index of each finger's contact.
        joints: of each finger.
        active: (S, columns) which contact touches, held from its knot to the next: the fingers', then, if the ground
            ever carries load, the ground's.
    """

    model: Model
    contacts: tuple[int, ...]
    joints: tuple[int, ...]
    active: NDArray[np.bool_]

    @classmethod
    def of(
        cls, model: Model, contacts: tuple[int, ...], joints: tuple[int, ...], active: NDArray[np.bool_]
    ) -> Structure:
        """Pick the columns in use from the flags (S, C) of all contacts, the ground's last."""
        columns = list(contacts)
        if model.ground is not None and active[:, -1].any():
            columns.append(model.contacts)
        return cls(model, contacts, joints, active[:, columns])

    @property
    def columns(self) -> list[int]:
        """Index of every contact in use, in the order of the problem's points and forces."""
        return [*self.contacts, *([self.model.contacts] if self.grounded else [])]

    @property
    def grounded(self) -> bool:
        """Whether the ground ever carries load."""
        return bool(self.active.shape[1] > len(self.contacts))

    @property
    def touching(self) -> NDArray[np.bool_]:
        """(S, columns) where bodies touch: from the first active knot to the first broken one."""
        return np.asarray(self.active | np.vstack([np.zeros((1, self.active.shape[1]), bool), self.active[:-1]]))
