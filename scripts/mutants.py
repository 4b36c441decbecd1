"""Result folders as they come from a bad disk, another program or somebody who means ill: one mutation each."""

from __future__ import annotations

import hashlib
import json
import random
from pathlib import Path

from mutant_files import flipped, foreign, read, truncated
from mutant_values import json_value, npz_array, text_line, xml_element

_KINDS = (truncated, flipped, foreign, json_value, xml_element, npz_array, text_line)
_CHANCES = (10, 15, 10, 20, 25, 20, 10)


def mutate(folder: Path, source: random.Random) -> str:
    """Spoil one thing in a folder, sometimes two, and return what.

    Args:
        folder: a copy of a result folder.
        source: of chance; equal ones spoil equally.
    """
    done = [source.choices(_KINDS, _CHANCES)[0](folder, source) for _ in range(source.choice((1, 1, 1, 1, 2)))]
    if source.random() < 0.5:
        done += _rehash(folder)
    return "; ".join(done)


def _rehash(folder: Path) -> list[str]:
    """State the hash of ``task.yaml`` as it is now, as somebody would who means ill."""
    try:
        record = json.loads(read(folder / "result.json"))
        record["task_hash"] = hashlib.sha256(read(folder / "task.yaml")).hexdigest()
        (folder / "result.json").write_text(json.dumps(record))
    except (OSError, ValueError, TypeError, RecursionError):
        return []
    return ["its hash is right"]
