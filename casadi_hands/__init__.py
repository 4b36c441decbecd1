"""Design a robot hand for a task: its topology, its shape, its motion and its forces."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from casadi_hands.export.design import Design
    from casadi_hands.pipeline import solve
    from casadi_hands.pipeline.alternatives import explore
    from casadi_hands.pipeline.formulate import formulate
    from casadi_hands.task import load_task
    from casadi_hands.terms.own import Bound, Cost
    from casadi_hands.verify import audit, replay

__version__ = "0.1.0"
__all__ = ["Bound", "Cost", "Design", "audit", "explore", "formulate", "load_task", "replay", "solve"]

_HOME = {
    "Bound": "casadi_hands.terms.own",
    "Cost": "casadi_hands.terms.own",
    "Design": "casadi_hands.export.design",
    "audit": "casadi_hands.verify",
    "explore": "casadi_hands.pipeline.alternatives",
    "formulate": "casadi_hands.pipeline.formulate",
    "load_task": "casadi_hands.task",
    "replay": "casadi_hands.verify",
    "solve": "casadi_hands.pipeline",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for: CasADi and Pinocchio take seconds to load."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    """Names of the module, those not imported yet among them."""
    return sorted({*globals(), *__all__})
