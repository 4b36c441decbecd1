"""Pydantic's errors in the user's words."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from pydantic_core import ErrorDetails

from casadi_hands.task.problem import Problem
from casadi_hands.task.region import TAGS
from casadi_hands.task.shapes import SECTIONS, spelled
from casadi_hands.task.shown import shown
from casadi_hands.task.structure import description_at, names_at, paths_of

# A template, in which braces are doubled.
_KINDS = " or ".join(f"{name}: {{{spelled(section)}}}" for name, section in SECTIONS.items())
_ALLOWED = {
    "float_type": "a number (without quotes or unit; lengths in m, times in s, masses in kg)",
    "finite_number": "a finite number",
    "greater_than": "a number greater than {gt:g}",
    "greater_than_equal": "a number of at least {ge:g}",
    "less_than": "a number less than {lt:g}",
    "less_than_equal": "a number of at most {le:g}",
    "int_type": "a whole number",
    "bool_type": "true or false",
    "string_type": "text",
    "string_too_short": "text that is not empty",
    "tuple_type": "a list",
    "model_type": "a mapping with the fields {names}",
    "dict_type": "a mapping of names, such as thumb: {{touches: [0, 0.02, 0]}}",
    "too_long": "at most {max_length} of them",
    "union_tag_invalid": _KINDS,
    "union_tag_not_found": _KINDS,
    "refused": "{allowed}",
}


def explain(errors: Iterable[ErrorDetails]) -> list[Problem]:
    """Translate what pydantic found."""
    errors = [_in_file(error) for error in errors if not _follows_from_another(error)]
    unknown = [_unknown(error["loc"]) for error in errors if error["type"] == "extra_forbidden"]
    meant = {(*problem.path[:-1], guess) for problem, guess in unknown if guess}
    # A misspelt field is reported once: as unknown, not as missing too.
    known = [error for error in errors if error["type"] != "extra_forbidden" and error["loc"] not in meant]
    return [problem for problem, _ in unknown] + [_known(error) for error in known]


def _in_file(error: ErrorDetails) -> ErrorDetails:
    """The error at the place where the file has it."""
    return {**error, "loc": tuple(step for step in error["loc"] if step not in TAGS)}


def _follows_from_another(error: ErrorDetails) -> bool:
    """Whether an error only says that an earlier one stood in the way."""
    if error["type"] == "too_short":
        # Pydantic counts the valid elements; the others have errors of their own.
        return bool(len(error["input"]) >= error["ctx"]["min_length"])
    return error["type"] == "default_factory_not_called"


def _known(error: ErrorDetails) -> Problem:
    path, kind, given = error["loc"], error["type"], shown(error["input"])
    context = {**error.get("ctx", {}), "names": ", ".join(names_at(path))}
    given = context.get("given", given)
    if kind == "missing":
        return Problem(path, "nothing", f"a value, it has no default: {description_at(path)}")
    if kind == "too_short":
        count = error["ctx"]["min_length"]
        return Problem(path, f"{len(error['input'])} of them", f"at least {count}: {description_at(path)}")
    return Problem(path, given, _ALLOWED[kind].format(**context) if kind in _ALLOWED else error["msg"])


def _unknown(path: tuple[str | int, ...]) -> tuple[Problem, str | None]:
    """The problem of a field that does not exist, and the name that was likely meant."""
    name, section = str(path[-1]), names_at(path[:-1])
    near = difflib.get_close_matches(name, section, n=1, cutoff=0.6)
    if near:
        return Problem(path, "an unknown field", f"{', '.join(section)}; did you mean {near[0]}?"), near[0]
    elsewhere = paths_of(name)
    hint = f"; did you mean {' or '.join(elsewhere)}?" if elsewhere else ""
    return Problem(path, "an unknown field", f"{', '.join(section)}{hint}"), None
