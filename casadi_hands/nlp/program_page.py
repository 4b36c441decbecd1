"""A page about a program for people: counts, terms, scales and sparsity; opens without a server or a network."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from casadi_hands.nlp.program import Program
from casadi_hands.nlp.sparsity_picture import sparsity_picture

_STYLE = """
body { font: 15px/1.5 sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; color: #222; background: #fff }
table { border-collapse: collapse; margin: 0.7rem 0 }
th, td { text-align: left; padding: 0.15rem 0.8rem 0.15rem 0; border-bottom: 1px solid #ddd; vertical-align: top }
td.number { text-align: right; font-variant-numeric: tabular-nums }
code, pre { font-size: 0.92em; background: #f3f3f3 }
pre { padding: 0.7rem; overflow-x: auto }
svg { max-width: 100%; height: auto }
"""
_LOADING = """import json
import casadi as ca
import numpy as np

nlp = ca.Function.load("nlp.casadi")
numbers = dict(np.load("program.npz"))  # x0, p, lbx, ubx, lbg, ubg
index = json.load(open("program.json"))
found = ca.nlpsol("solver", "ipopt", nlp)(**numbers)
x = np.array(found["x"]).ravel()
print(found["f"], x[index["variables"]["%s"]["positions"]])
"""


def program_page(program: Program, index: Mapping[str, Any], title: str, facts: Mapping[str, Any]) -> str:
    """HTML.

    Args:
        program: shown.
        index: of it, as ``program_index`` gives it.
        title: of the page.
        facts: what else there is to say, told in a table.
    """
    first = program.problem.variables.names()[0]
    start = index["start"]
    parts = [
        f"<h1>{escape(title)}</h1>",
        "<p>Minimise f(x, p) subject to lbx ≤ x ≤ ubx and lbg ≤ g(x, p) ≤ ubg, from x0. Written with CasADi "
        f"{escape(index['casadi'])}. At x0 the objective is {_text(start['objective'])} and the largest violation of a "
        f"constraint {_text(start['violation'])}.</p>",
        _table(("", ""), [(_words(name), _fact(value)) for name, value in facts.items()]),
        "<h2>Size</h2>",
        _table(("", ""), [(_words(name), count) for name, count in index["sizes"].items()]),
        "<h2>Terms</h2>",
        _terms(index["terms"]),
        "<h2>Variables</h2>",
        _variables(index["variables"]),
        "<h2>Constraints</h2>",
        _constraints(index["constraints"]),
        "<h2>Jacobian of the constraints</h2>",
        _jacobian(program),
        "<h2>Hessian of the Lagrangian</h2>",
        _hessian(program),
        "<h2>Files</h2>",
        f"<pre>{escape(_LOADING % first)}</pre>",
        _table(
            ("file", "inputs", "outputs", ""),
            [(f["file"], ", ".join(f["inputs"]), ", ".join(f["outputs"]), f["about"]) for f in _functions(index)],
        ),
    ]
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{_STYLE}</style>'
    return f'<!doctype html>\n<html lang="en"><head>{head}</head>\n<body>\n' + "\n".join(parts) + "\n</body></html>\n"


def _functions(index: Mapping[str, Any]) -> Iterable[Mapping[str, Any]]:
    found: Mapping[str, Mapping[str, Any]] = index["functions"]
    return found.values()


def _terms(terms: Mapping[str, Mapping[str, Any]]) -> str:
    rows = [
        (name, t["about"], t["equation"], t["unit"], t["form"], t["weight"], t["value_at_start"])
        for name, t in terms.items()
    ]
    return _table(("term", "what costs", "from", "unit of the residual", "form", "weight", "value at x0"), rows)


def _variables(variables: Mapping[str, Mapping[str, Any]]) -> str:
    rows = []
    for name, v in variables.items():
        scale = v["scale"]
        bounds = f"{_text(v['lower'], '-∞')} … {_text(v['upper'], '∞')}"
        magnitudes = scale["value"], scale["gradient"], scale["jacobian_column"]
        rows.append((name, v["about"], v["unit"], "×".join(map(str, v["shape"])), bounds, *magnitudes))
    return _table(("variable", "what", "unit", "shape", "bounds", "|x0|", "|gradient|", "|Jacobian|"), rows)


def _constraints(constraints: Mapping[str, Mapping[str, Any]]) -> str:
    rows = []
    for name, c in constraints.items():
        scale = c["scale"]
        between = f"{_text(scale['smallest_row'])} … {_text(scale['largest_row'])}"
        shape = "×".join(map(str, c["shape"]))
        rows.append((name, c["equation"], c["unit"], shape, c["equations"], c["violation_at_start"], between))
    headings = ("constraint", "from", "unit", "shape", "equations", "violation at x0", "rows of the Jacobian at x0")
    return _table(headings, rows)


def _jacobian(program: Program) -> str:
    pattern = program.functions["jac_g"].sparsity_out("jac_g_x")
    row, column = (np.array(each, int) for each in pattern.get_triplet())
    return sparsity_picture(
        (row, column), pattern.shape, _blocks(program.problem.constraints), _variable_blocks(program)
    )


def _hessian(program: Program) -> str:
    pattern = program.functions["hess_lag"].sparsity_out("triu_hess_gamma_x_x")
    row, column = (np.array(each, int) for each in pattern.get_triplet())
    both = np.append(row, column), np.append(column, row)
    blocks = _variable_blocks(program)
    return sparsity_picture(both, pattern.shape, blocks, blocks)


def _variable_blocks(program: Program) -> dict[str, tuple[int, int]]:
    return _blocks(program.problem.variables)


def _blocks(layout: Any) -> dict[str, tuple[int, int]]:
    """First position of each array, and the one after its last."""
    return {
        name: (int(layout[name].min()), int(layout[name].max()) + 1) for name in layout.names() if layout[name].size
    }


def _table(headings: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    head = "".join(f"<th>{escape(each)}</th>" for each in headings)
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows)
    return f"<table>{f'<tr>{head}</tr>' if any(headings) else ''}{body}</table>"


def _cell(value: Any) -> str:
    number = value is None or isinstance(value, int | float)
    return f'<td class="number">{_text(value)}</td>' if number else f"<td>{escape(str(value))}</td>"


def _text(value: float | None, missing: str = "—") -> str:
    """A number to four digits."""
    return missing if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)


def _fact(value: Any) -> Any:
    if isinstance(value, Mapping):
        return ", ".join(f"{_words(name)} {_fact(each)}" for name, each in value.items())
    return _text(value) if isinstance(value, float) else value


def _words(name: str) -> str:
    return name.replace("_", " ")
