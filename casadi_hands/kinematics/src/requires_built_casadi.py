"""Lets the built package require the very CasADi that its extension is compiled against; scikit-build-core calls it."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version
from typing import Any


def dynamic_metadata(settings: Mapping[str, Any], project: Mapping[str, Any]) -> dict[str, list[str]]:
    """What pyproject.toml cannot say before the build: the CasADi whose headers the build sees.

    Returns:
        Dependencies beside those of pyproject.toml.
    """
    # The extension passes through libcasadi's C++ classes, whose memory layout may change with any release. A range
    # would let pip exchange CasADi under it; an exact version makes pip say so, or build again.
    return {"dependencies": [f"casadi=={version('casadi')}"]}


def dynamic_wheel(settings: Mapping[str, Any]) -> dict[str, bool]:
    """The source distribution must not fix it: it is compiled anew wherever it is installed."""
    return {"dependencies": True}
