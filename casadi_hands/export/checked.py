"""What the entries of ``result.json`` must look like for a design to be made of them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from casadi_hands.errors import DesignError
from casadi_hands.problem.stored import LARGEST_NUMBER, read_json

FORMAT = 1
Number = Annotated[float, Field(ge=-1e30, le=1e30)] | None
Size = Annotated[float, Field(gt=0, le=LARGEST_NUMBER)]
Finite = Annotated[float, Field(ge=-LARGEST_NUMBER, le=LARGEST_NUMBER)]
Vector = Annotated[list[Finite], Field(min_length=3, max_length=3)]


class _Entry(BaseModel):
    """Named entries, and others that only people read."""

    model_config = ConfigDict(strict=True, extra="allow")


class _Figure(_Entry):
    value: Number = None
    limit: Number = None
    holds: bool


class _Off(_Entry):
    mm: Number
    degrees: Number


class _Played(_Entry):
    dropped: bool


class _Replays(_Entry):
    dropped_as_planned: bool
    dropped: int
    of: int
    mean: _Off
    perturbed: dict[str, _Played] = {}


class _Palm(_Entry):
    radius: Size
    thickness: Size


class _Link(_Entry):
    length: Size
    radius: Size
    axis: Vector
    bend: list[Finite] = Field(default=[0.0, 0.0], min_length=2, max_length=2)
    hinge: float = Field(default=0.0, ge=0, le=LARGEST_NUMBER)


class _Finger(_Entry):
    name: str
    base: Vector
    links: list[_Link] = Field(min_length=1, max_length=30)


class _Hand(_Entry):
    palm: _Palm
    fingers: list[_Finger] = Field(max_length=30)
    joint_lower: Finite
    joint_upper: Finite
    effort: Size
    velocity: Size
    density: Size
    servo: str | None = None
    ratios: list[list[Finite]] | None = None
    offsets: list[Finite] | None = None
    motor_effort: Size | None = None
    motor_velocity: Size | None = None

    @model_validator(mode="after")
    def _drives_all(self) -> Self:
        """Motors that share joints turn all of them, and each turns one that no other does."""
        stated = [self.ratios, self.offsets, self.motor_effort, self.motor_velocity]
        if self.ratios is None and self.offsets is None:
            return self
        joints = sum(len(finger.links) for finger in self.fingers)
        rows = self.ratios or []
        turned = [{m for m, ratio in enumerate(row) if ratio} for row in rows]
        if (
            any(each is None for each in stated)
            or not len(rows) == len(self.offsets or []) == joints
            or len({len(row) for row in rows}) != 1
            or not rows[0]
            or any({m} not in turned for m in range(len(rows[0])))
        ):
            raise ValueError(f"motors that share joints need ratios and offsets for {joints} joints, and limits")
        return self


class _Record(_Entry):
    status: Literal["certified", "feasible", "failed"]
    reason: str
    hand: _Hand | None
    samples: int | None
    costs: dict[str, dict[str, Any]]
    certificate: dict[str, _Figure]
    replays: list[_Replays] = []  # earlier versions told of none
    stages: list[dict[str, Any]]
    seconds: dict[str, float]


def read_record(directory: Path) -> dict[str, Any]:
    """Return a folder's ``result.json``, of the format that this version reads and with the entries a design needs.

    Raises:
        DesignError: there is no such folder or file, it is of another format, or an entry is missing or of another
            kind; the message names the first of these.
    """
    if not directory.is_dir():
        raise DesignError(f"{directory}: there is no such folder; give one that `casadi-hands solve` wrote", "")
    path = directory / "result.json"
    if not path.is_file():
        raise DesignError(f"{directory}: no result.json, so this is not the folder of a finished design")
    record = read_json(path)
    given = record.get("format") if isinstance(record, dict) else None
    if not isinstance(record, dict) or given != FORMAT or isinstance(given, bool):
        raise DesignError(f"{path}: its format is {str(given)[:60]}; this version reads format {FORMAT}")
    try:
        _Record.model_validate(record)
    except ValidationError as error:
        raise DesignError(f"{path}: {_first(error)}") from None
    return record


def _first(error: ValidationError) -> str:
    errors = error.errors(include_url=False)
    missing = [str(each["loc"][0]) for each in errors if each["type"] == "missing" and len(each["loc"]) == 1]
    if missing:
        return f"lacks {', '.join(missing)}"
    first = errors[0]
    where = ".".join(str(part)[:60] for part in first["loc"])
    if first["type"] == "missing":
        return f"lacks {where}"
    return f"{where}: given {str(first['input'])[:60]!r}; {first['msg'][0].lower()}{first['msg'][1:]}"
