"""The units of work of Algorithm 1, which run in processes."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Mapping
from typing import Any

import numpy as np

from casadi_hands.kinematics.morphology import FingerSeed
from casadi_hands.stages.synthesis.seeds import random_finger
from casadi_hands.stages.synthesis.stage import Synthesised, SynthesisStage
from casadi_hands.stages.synthesis.target import Target

_stages: dict[tuple[bytes, tuple[int, ...], tuple[int, ...]], SynthesisStage] = {}


def _stage(target: Target, contacts: tuple[int, ...], joints: tuple[int, ...]) -> SynthesisStage:
    """The stage's problem, built once a process for each structure."""
    key = (hashlib.sha256(pickle.dumps(target)).digest(), contacts, joints)
    if key not in _stages:
        if len(_stages) > 50:
            _stages.clear()
        _stages[key] = SynthesisStage(target, contacts, joints)
    return _stages[key]


def design_finger(
    target: Target, contact: int, joints: int, stream: tuple[int, ...], weights: Mapping[str, Any]
) -> Synthesised:
    """One trial of Algorithm 1: a finger alone, from the random start that ``stream`` names."""
    seed = random_finger(target, contact, joints, np.random.default_rng(stream))
    return _stage(target, (contact,), (joints,)).solve((seed,), weights)


def combine_fingers(
    target: Target, contacts: tuple[int, ...], fingers: tuple[FingerSeed, ...], weights: Mapping[str, Any]
) -> Synthesised:
    """One recombination of Algorithm 1: fingers designed alone, annealed again together."""
    return _stage(target, contacts, tuple(f.joints for f in fingers)).solve(fingers, weights)
