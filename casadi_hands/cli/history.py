"""How long earlier solves took on this machine, and what that says of one that runs."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from casadi_hands.cache import cache_folder

if TYPE_CHECKING:
    from casadi_hands.task import Task

FEWEST = 3
"""Solves of like size that are still of use, below which nothing is said."""
_KEPT = 300
_NEAR = 1.5  # times as many samples, either way
_SHARE = 0.1  # of the solves that may take less, and more, than what is said


@dataclass(frozen=True)
class Kind:
    """What time depends on; solves of one kind are alike.

    Attributes:
        version: of the program.
        until: the last stage.
        seeds: how many.
        jobs: processes.
        warm: whether an earlier result is refined.
        motors: as the task asks for them.
        fingers: how many.
        placed: whether the task says where they touch.
        attached: whether a joint holds the object.
        samples: of the motion; those of a like solve may be half as many again.
    """

    version: str
    until: str
    seeds: int
    jobs: int
    warm: bool
    motors: str
    fingers: int
    placed: bool
    attached: bool
    samples: int

    def is_like(self, other: Kind) -> bool:
        """Whether both may take about as long."""
        near = max(self.samples, other.samples) <= _NEAR * min(self.samples, other.samples)
        return near and asdict(self) | {"samples": 0} == asdict(other) | {"samples": 0}


@dataclass(frozen=True)
class Solve:
    """A solve that has ended.

    Attributes:
        kind: of it.
        total: s that it took.
        began: s after which each stage began for the first time.
    """

    kind: Kind
    total: float
    began: dict[str, float] = field(default_factory=dict)


def kind_of(task: Task, *, version: str, until: str, seeds: int, jobs: int | None, warm: bool) -> Kind:
    """The kind of a solve that is asked for."""
    return Kind(
        version=version,
        until=until,
        seeds=seeds,
        jobs=jobs or os.cpu_count() or 1,
        warm=warm,
        motors=str(task.motors),
        fingers=len(task.fingers),
        placed=task.is_placed,
        attached=task.object.attached is not None,
        samples=max(1, round(task.duration / task.time_step)),
    )


class Clock:
    """The time of a solve that runs, and what earlier ones say of the time that is left.

    Args:
        kind: of it.
        earlier: solves, of any kind.
        now: s, that only grows.
    """

    def __init__(self, kind: Kind, earlier: Sequence[Solve] = (), now: Callable[[], float] = time.monotonic) -> None:
        self.kind, self._now = kind, now
        self._earlier = [each for each in earlier if each.kind.is_like(kind)]
        self._zero: float | None = None
        self._stage, self._began = "", {"": 0.0}

    def hear(self, stage: str, elapsed: float) -> None:
        """Take news of a stage, with the s since the solve began."""
        if self._zero is None:
            self._zero = self._now() - elapsed
        if self.kind.seeds == 1 and stage not in self._began:
            self._stage, self._began[stage] = stage, elapsed

    def left(self) -> tuple[float, float] | None:
        """The s within which four of five solves would end that came as far and took as long; None if unknown."""
        if self._zero is None:
            return None
        spent = self._now() - self._zero - self._began[self._stage]
        whole = (each.total - each.began[self._stage] for each in self._earlier if self._stage in each.began)
        rest = sorted(each - spent for each in whole if each > spent)
        if len(rest) < FEWEST:
            return None
        return _quantile(rest, _SHARE), _quantile(rest, 1 - _SHARE)

    def ended(self) -> Solve:
        """The solve, as it is to be remembered."""
        total = 0.0 if self._zero is None else self._now() - self._zero
        return Solve(self.kind, total, dict(self._began))


def words(left: tuple[float, float] | None) -> str:
    """The time left as people say it, empty where it is not known."""
    if left is None:
        return ""
    low, high = (_rounded(each) for each in left)
    return f"about {high} left" if low == high else f"{low} to {high} left"


def remembered(path: Path | None = None) -> list[Solve]:
    """Earlier solves; none where there is no record that can be read."""
    with suppress(OSError, RuntimeError, ValueError):
        return list(_read(path or _file()))
    return []


def remember(solve: Solve, path: Path | None = None) -> None:
    """Add a solve to the record, which keeps the last few hundred; where it cannot be written, that is no harm."""
    if not solve.total:  # what was refused at once says nothing of others
        return
    with suppress(OSError, RuntimeError):
        file = path or _file()
        file.parent.mkdir(parents=True, exist_ok=True)
        kept = [*remembered(file), solve][-_KEPT:]
        beside = file.with_name(f"{file.name}.{os.getpid()}")
        beside.write_text("".join(f"{json.dumps(asdict(each))}\n" for each in kept), encoding="utf-8")
        beside.replace(file)


def _file() -> Path:
    return cache_folder() / "solves.jsonl"


def _read(path: Path) -> Iterator[Solve]:
    for line in path.read_text(encoding="utf-8").splitlines():
        with suppress(ValueError, TypeError, KeyError):  # of another version
            given = json.loads(line)
            began = {str(name): float(value) for name, value in given["began"].items()}
            yield Solve(Kind(**given["kind"]), float(given["total"]), began)


def _quantile(ordered: Sequence[float], share: float) -> float:
    """Value below which a share of some values lies, between them along straight lines."""
    place = share * (len(ordered) - 1)
    low = min(int(place), len(ordered) - 2)
    return ordered[low] + (place - low) * (ordered[low + 1] - ordered[low])


def _rounded(seconds: float) -> str:
    if seconds < 95:
        return f"{max(5, 5 * round(seconds / 5)) if seconds < 30 else 10 * round(seconds / 10)} s"
    if seconds < 95 * 60:
        return f"{round(seconds / 60)} min"
    return f"{seconds / 3600:.1f} h"
