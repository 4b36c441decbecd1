"""Write the tables of terms, constraints and symbols in docs/notation.md from their declarations.

python scripts/notation.py
"""

from __future__ import annotations

import re
from pathlib import Path

from shared import table_text

from casadi_hands.nlp import Constraint, Term
from casadi_hands.terms import body, clearance, constraints, contact, finger

PAGE = Path(__file__).parents[1] / "docs" / "notation.md"
_MODULES = (body, contact, clearance, finger)
_TABLE = re.compile(r"(<!-- declared: (\w+) -->\n).*?(<!-- end of declared -->)", re.DOTALL)


def main() -> None:
    """Write the tables anew."""
    PAGE.write_text(written(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


def written(text: str) -> str:
    """A page with its tables as the declarations are now."""
    tables = {"terms": _terms, "constraints": _constraints}
    return _TABLE.sub(lambda match: f"{match[1]}{tables[match[2]]()}\n{match[3]}", text)


def _terms() -> str:
    rows = []
    for module in _MODULES:
        for name, term in vars(module).items():
            if isinstance(term, Term):
                weights = ", ".join(f"{stage} {_weight(weight.default)}" for stage, weight in term.weights.items())
                code = f"`terms.{module.__name__.rpartition('.')[2]}.{name}`"
                form = "square" if term.form == "square" else "sum"
                weight = weights or f"as {term.weighs_as}"
                rows.append([f"`{term.name}`", term.about, term.equation, term.unit, form, weight, code])
    return table_text(["term", "what costs", "source", "unit of the residual", "form", "weight", "declared"], rows)


def _weight(value: float | tuple[float, ...]) -> str:
    return " / ".join(f"{each:g}" for each in value) if isinstance(value, tuple) else f"{value:g}"


def _constraints() -> str:
    rows = [
        [f"`{value.name}`", value.equation, value.unit, value.cannot, f"`terms.constraints.{name}`"]
        for name, value in vars(constraints).items()
        if isinstance(value, Constraint) and not name.startswith("_")
    ]
    return table_text(["constraint", "source", "unit", "violated, it or its finger cannot …", "declared"], rows)


if __name__ == "__main__":
    main()
