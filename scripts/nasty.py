"""Task files that are wrong in some way, each following from a number: what `fuzz_tasks.py` feeds the reader with."""

from __future__ import annotations

import json
import math
import re
from copy import deepcopy
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

from nasty_words import HEADS, SNIPPETS, TAILS, VALUES

from casadi_hands.task import Task
from casadi_hands.task.structure import walk
from casadi_hands.task.yamlfile import TaskFile

PROBLEMS = Path(__file__).resolve().parents[1] / "problems"
_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?![\w.])")


def mutant(number: int) -> bytes:
    """The content of a file."""
    random = Random(number)
    text = random.choice(_sources())
    change = random.choice((_as_text, _as_numbers, _as_numbers, _as_structure, _as_structure, _as_snippets, _as_noise))
    return _encoded(change(text, random), random)


@cache
def _sources() -> tuple[str, ...]:
    return tuple(path.read_text(encoding="utf-8") for path in sorted(PROBLEMS.rglob("*.yaml")))


def _encoded(text: str, random: Random) -> bytes:
    how = random.randrange(60)
    if how == 0:
        return text.encode("utf-16", "surrogatepass")
    if how == 1:
        return text.encode("utf-8-sig", "surrogatepass")
    data = text.replace("\n", "\r\n" if how == 2 else "\r" if how == 3 else "\n").encode("utf-8", "surrogatepass")
    if how == 4 and data:
        spoilt = bytearray(data)
        for _ in range(random.randint(1, 5)):
            spoilt[random.randrange(len(spoilt))] = random.randrange(256)
        return bytes(spoilt)
    return data


def _as_text(text: str, random: Random) -> str:
    """Lines and characters left out, repeated, swapped, or cut off."""
    for _ in range(random.randint(1, 4)):
        lines = text.split("\n")
        here, there = random.randrange(len(lines)), random.randrange(len(lines))
        at, end = sorted((random.randrange(len(text) + 1), random.randrange(len(text) + 1)))
        end = min(end, at + random.choice((1, 1, 3, 20)))
        how = random.randrange(8)
        if how == 0:
            del lines[here]
        elif how == 1:
            lines.insert(there, lines[here])
        elif how == 2:
            lines[here], lines[there] = lines[there], lines[here]
        elif how == 3:
            lines[here] = " " * random.randrange(9) + lines[here].lstrip()
        text = "\n".join(lines)
        if how == 4:
            text = text[:at] + text[end:]
        elif how == 5:
            text = text[:at]
        elif how == 6:
            text = text[:at] + chr(random.choice((random.randrange(128), random.randrange(0x11000)))) + text[at:]
        elif how == 7:
            text = text[:at] + text[at:end] * random.choice((2, 3, 50)) + text[end:]
    return text


def _as_numbers(text: str, random: Random) -> str:
    """Numbers made larger, smaller, or equal to others, most of them mildly."""
    places = list(_NUMBER.finditer(text))
    for place in sorted(random.sample(places, min(len(places), random.choice((1, 1, 2, 3)))), key=lambda m: -m.start()):
        value = float(place[0])
        how = random.randrange(8)
        if how < 3:
            value *= random.uniform(-2, 2)
        elif how < 5:
            value = (value or 1.0) * 10 ** random.uniform(-13, 13)
        elif how == 5:
            value = float(random.choice(places)[0])
        elif how == 6:
            value = random.choice(
                (0.0, -0.0, 1e-12, 1e-7, 1e-5, 1e3, 1e5, 1e6, 1e11, -1e11, 1e-300, 1e300, 360.0, -180.0)
            )
        else:
            value = round(value)
        text = text[: place.start()] + _written(value) + text[place.end() :]
    return text


def _as_snippets(text: str, random: Random) -> str:
    """What YAML allows and nobody expects, in place of a value, a name or a line, or before or after it all."""
    for _ in range(random.randint(1, 2)):
        snippet, how = random.choice(SNIPPETS), random.randrange(6)
        places = list((_NUMBER if how < 3 else re.compile(r"\w+|\[.*?\]|\{.*?\}")).finditer(text))
        if how < 5 and places:
            place = random.choice(places)
            text = text[: place.start()] + snippet + text[place.end() :]
        else:
            name = random.choice(_fields())
            text = random.choice(
                (random.choice(HEADS) + text, text + random.choice(TAILS), f"{text}\n{name}: {snippet}\n")
            )
    return text


def _as_noise(text: str, random: Random) -> str:
    """Tokens of YAML and of tasks in any order."""
    structure = (*"[]{}:,-?&*!|>'\"#%", ": ", "- ", "\n", "\n  ", "\n    ")
    tokens = (*SNIPPETS, *structure, *_fields(), *re.findall(r"\S+", text))
    return "".join(random.choice(tokens) for _ in range(random.choice((3, 10, 40))))


def _as_structure(text: str, random: Random) -> str:
    """Values replaced, left out, moved, repeated, nested; fields of the schema added."""
    data: Any = deepcopy(_data(text))
    for _ in range(random.choice((1, 1, 2, 3))):
        places = list(_places(data))
        if not places:
            break
        holder, key = random.choice(places)
        other, name = random.choice(places)
        how = random.randrange(10)
        if how < 3:
            holder[key] = deepcopy(random.choice(VALUES))
        elif how == 3:
            holder[key] = deepcopy(other[name])
        elif how == 4:
            del holder[key]
        elif how == 5 and isinstance(holder, dict):
            holder[random.choice((*_fields(), f"{key}s", str(key)[1:], "\x1b", ""))] = holder.pop(key)
        elif how == 6 and isinstance(holder[key], list) and holder[key]:
            holder[key] = holder[key] * random.choice((2, 2, 5, 60, 600))
        elif how == 7:
            for _ in range(random.choice((1, 2, 30))):
                holder[key] = random.choice(([holder[key]], {"a": holder[key]}))
        else:
            _add(data, random)
    return _written(data)


def _add(data: dict[str, Any], random: Random) -> None:
    """Give a field of the schema, as deep as it is, a value."""
    *sections, last = random.choice(_paths()).split(".")
    here: Any = data
    for name in sections:
        if not isinstance(here, dict):
            return
        here = here.setdefault(name, {})
        if isinstance(here, list) and here:
            here = random.choice(here)
    if isinstance(here, dict):
        value = random.choice(
            (random.choice(VALUES), 10 ** random.uniform(-4, 3), [random.uniform(-1, 1) for _ in range(3)])
        )
        here[last] = deepcopy(value)


@cache
def _paths() -> list[str]:
    """Every field of a task file, by its dotted path."""
    return [path for path, _, _ in walk(Task)]


@cache
def _fields() -> tuple[str, ...]:
    return tuple(sorted({path.split(".")[-1] for path in _paths()}))


@cache
def _data(text: str) -> dict[str, Any]:
    return TaskFile(text, "problem").data


def _places(value: Any) -> list[tuple[Any, Any]]:
    """Every container and key in a value."""
    keys = list(value) if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else []
    return [place for key in keys for place in [(value, key), *_places(value[key])]]


def _written(value: Any) -> str:
    """YAML of plain data, all in one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(str(name))}: {_written(each)}" for name, each in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_written, value)) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    return json.dumps(value)
