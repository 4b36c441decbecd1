"""The errors this package raises on purpose; each message is written for the person who reads it."""

from __future__ import annotations


class HandsError(Exception):
    """Root of every error this package raises on purpose."""


class TaskError(HandsError):
    """A task file cannot be used; the message names file, line, field, what was given and what is allowed."""


class DesignError(HandsError):
    """A result folder is missing, incomplete or of another format."""


class SolveError(HandsError):
    """A task cannot be solved; the message says why in the user's terms."""


class KinematicsError(HandsError):
    """The compiled kinematics extension is missing or was built against another CasADi."""
