"""The folder of a program: functions, arrays, index and page, for whoever has CasADi and NumPy."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from casadi_hands.nlp.program import Program
from casadi_hands.nlp.program_index import Quantities, program_index
from casadi_hands.nlp.program_page import program_page


def save_program(program: Program, folder: Path, title: str, facts: Mapping[str, Any], quantities: Quantities) -> None:
    """Write a program.

    Functions go into ``<name>.casadi`` as CasADi saves them, arrays into ``program.npz``, the index by name, with
    ``title`` and ``facts``, into ``program.json``, which comes last, and the page into ``index.html``.

    Args:
        program: written.
        folder: made if it does not exist; files of an earlier program in it are replaced.
        title: what it is, in a few words.
        facts: what else there is to say of it, as JSON knows it.
        quantities: what each variable and parameter is, by name.

    Raises:
        OSError: the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    record = folder / "program.json"
    record.unlink(missing_ok=True)
    np.savez_compressed(folder / "program.npz", **program.numbers)  # type: ignore[arg-type]
    for name, function in program.functions.items():
        function.save(str(folder / f"{name}.casadi"))
    index = program_index(program, quantities)
    (folder / "index.html").write_text(program_page(program, index, title, facts), encoding="utf-8")
    record.write_text(_readable({"title": title, **facts, **index}), encoding="utf-8")


def _readable(record: Mapping[str, Any]) -> str:
    """JSON with a line for each entry of the first two levels: positions are many numbers."""
    parts = []
    for name, value in record.items():
        if isinstance(value, Mapping) and value:
            lines = ",\n".join(f"  {json.dumps(key)}: {_dumped(each)}" for key, each in value.items())
            parts.append(f" {json.dumps(name)}: {{\n{lines}\n }}")
        else:
            parts.append(f" {json.dumps(name)}: {_dumped(value)}")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def _dumped(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
