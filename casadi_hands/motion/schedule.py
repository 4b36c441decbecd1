"""When things happen: goal times, keyframes between them, samples between those."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from casadi_hands.motion.spline import catmull_rom, zero_order_hold

Weights = NDArray[np.float64]


@dataclass(frozen=True)
class Schedule:
    """The times of a motion; every goal is a keyframe and every keyframe is a sample.

    Attributes:
        keyframes: (N,) s.
        samples: (S,) s.
        goals: for each goal the index of its keyframe.
        step: s, the half-width of the central differences.
        holds: keyframes, by their indices in order, at which everything rests and stays for so long, s. Times here pass
            none of that; `real` and `filled` do.
    """

    keyframes: NDArray[np.float64]
    samples: NDArray[np.float64]
    goals: tuple[int, ...]
    step: float
    holds: tuple[tuple[int, float], ...] = ()

    @classmethod
    def of(
        cls, goal_times: Sequence[float], duration: float, between: int, step: float, stops: Sequence[float] = ()
    ) -> Schedule:
        """Put ``between`` keyframes between neighbouring goals and samples at most ``step`` seconds apart.

        A motion that goes on after its last goal gets one more stretch of keyframes to its end. Of the times ``stops``
        those that are apart from all goals get a keyframe, too, which parts the stretch it is in.
        """
        ends = list(goal_times)
        for time in sorted([*stops, duration]):
            if min(abs(time - end) for end in ends) > 1e-9 and time < duration + 1e-9:
                ends.append(time)
        ends.sort()
        keyframes = [ends[0]]
        for start, end in itertools.pairwise(ends):
            keyframes += list(np.linspace(start, end, between + 2)[1:])
        goals = tuple(ends.index(time) * (between + 1) for time in goal_times)
        return cls(np.array(keyframes), _samples(keyframes, step), goals, step)

    def stepped(self, step: float) -> Schedule:
        """The same keyframes with samples at most ``step`` seconds apart."""
        return replace(self, samples=_samples(self.keyframes.tolist(), step), step=step)

    def halved(self, intervals: NDArray[np.bool_]) -> Schedule:
        """The same with one more sample in the middle of each marked interval (S - 1,) between samples."""
        middles = (self.samples[1:] + self.samples[:-1])[intervals] / 2
        return replace(self, samples=np.sort(np.append(self.samples, middles)))

    def real(self, times: ArrayLike) -> NDArray[np.float64]:
        """Times (T,) with all the time that everything has rested by then; at a keyframe that is held, its first, s."""
        times = np.asarray(times, float)
        return times + sum((np.where(times > self.keyframes[k] + 1e-9, rest, 0.0) for k, rest in self.holds), 0.0)

    @property
    def hold_samples(self) -> NDArray[np.int64]:
        """Index (H,) of the sample at each keyframe that is held."""
        return self.keyframe_samples[[k for k, _ in self.holds]]

    def filled(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Real times (R,), s, with samples in holds as elsewhere, and which sample's values (R,) stand there."""
        times, index = self.real(self.samples), np.arange(len(self.samples))
        for sample, (_, rest) in zip(self.hold_samples, self.holds, strict=True):
            count = math.ceil(rest / self.step - 1e-6)
            times = np.append(times, times[sample] + rest * np.arange(1, count + 1) / count)
            index = np.append(index, np.full(count, sample))
        order = np.argsort(times, kind="stable")
        return times[order], index[order]

    @property
    def keyframe_samples(self) -> NDArray[np.int64]:
        """Index (N,) of the sample at each keyframe."""
        return np.searchsorted(self.samples, self.keyframes - 1e-9)

    @property
    def goal_samples(self) -> NDArray[np.int64]:
        """Index (G,) of the sample at each goal."""
        return self.keyframe_samples[list(self.goals)]

    @property
    def sample_keyframes(self) -> NDArray[np.int64]:
        """Index (S,) of the keyframe whose contact flags hold at each sample."""
        return zero_order_hold(self.keyframes, self.samples)

    def at(self, offset: float = 0.0) -> NDArray[np.float64]:
        """Times (S,) ``offset`` steps after the samples, mirrored at the ends as splines are, s."""
        first, last = self.keyframes[0], self.keyframes[-1]
        times = first + np.abs(self.samples + offset * self.step - first)
        return np.asarray(last - np.abs(last - times))

    def spline(self, offset: float = 0.0, resting: ArrayLike = ()) -> Weights:
        """Catmull–Rom weights (S, N) at the samples, ``offset`` steps later, at rest at the keyframes ``resting``."""
        return catmull_rom(self.keyframes, self.samples + offset * self.step, resting)

    def between(self, count: int) -> NDArray[np.float64]:
        """Times of the keyframes with ``count`` more between each pair, s."""
        steps = np.diff(self.keyframes) / (count + 1)
        times = self.keyframes[:-1, None] + np.arange(count + 1) * steps[:, None]
        return np.append(times, self.keyframes[-1])


def _samples(keyframes: Sequence[float], step: float) -> NDArray[np.float64]:
    """All keyframes, and evenly between two neighbours as few times as leave none more than ``step`` apart."""
    samples = [keyframes[0]]
    for a, b in itertools.pairwise(keyframes):
        samples += list(np.linspace(a, b, max(1, math.ceil((b - a) / step - 1e-6)) + 1)[1:])
    return np.array(samples)
