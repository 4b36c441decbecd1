"""A pencil that hangs still while fingers let go of it and touch it again."""

from __future__ import annotations


def pencil(end: float, fingers: str) -> str:
    """The task's text.

    Args:
        end: of the motion, s.
        fingers: lines of YAML, two spaces in.
    """
    return f"""
object: {{mass: 0.03, shapes: [{{capsule: {{start: [0, 0, -0.05], end: [0, 0, 0.05], radius: 0.006}}}}]}}
palm: {{radius: 0.045, position: [0, 0, 0.11], facing: [0, 0, -1]}}
motion:
  - {{at: 0, position: [0, 0, 0]}}
  - {{at: {end}, position: [0, 0, 0]}}
fingers:
{fingers}"""
