"""The command line: words and progress, no mathematics."""

from __future__ import annotations

import io
import os
import sys

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def main() -> None:
    """Run the command that the arguments name; exits 2 with one message for what the user can put right."""
    # The work is spread over processes; threads of linear algebra on top only get in each other's way. NumPy reads
    # these once, when it is imported, so they come before every other import.
    for name in _THREADS:
        os.environ.setdefault(name, "1")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # where a terminal knows fewer characters than are printed
            stream.reconfigure(errors="backslashreplace")
    from casadi_hands.cli.app import app
    from casadi_hands.errors import HandsError, words_of

    try:
        app()
    except HandsError as error:
        print(f"casadi-hands: {words_of(error)}", file=sys.stderr)
        sys.exit(2)
