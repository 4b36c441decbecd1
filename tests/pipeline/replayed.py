"""Designs that were replayed, without a simulator."""

from __future__ import annotations

from dataclasses import replace

from casadi_hands.export.design import Design

OF = 20


def replayed(design: Design, drops: int) -> Design:
    """A design whose files hold or not, and whose perturbed replays drop the object so often.

    Where all of them do, so does the one as planned.
    """
    few = drops <= OF / 20
    status = "feasible" if design.status == "certified" and not few else design.status
    entry = {
        "engine": "mujoco",
        "mean": {"mm": 0.5, "degrees": 0.8},
        "dropped_as_planned": drops == OF,
        "dropped": drops,
        "of": OF,
        "perturbed": {f"number {k}": {"dropped": k < drops} for k in range(OF)},
    }
    certificate = {**design.certificate, "replay_dropped": {"value": drops / OF, "limit": 0.05, "holds": few}}
    return replace(design, status=status, replays=[entry], certificate=certificate)
