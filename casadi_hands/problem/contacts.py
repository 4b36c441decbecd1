"""Contacts of the object: one table, the ground's among them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Contact:
    """Where something touches the object.

    Attributes:
        name: of the finger, or ``ground``.
        patch: (3,) where it is wanted, object frame.
        body: index of the object's body that it lies on.
        friction: of both surfaces.
        finger: whether a finger makes it.
    """

    name: str
    patch: NDArray[np.float64]
    body: int
    friction: float
    finger: bool = True
