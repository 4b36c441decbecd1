"""Pages as a browser without a screen shows them: Chromium, with the network off."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from casadi_hands.errors import HandsError

NAMES = ("chromium", "chromium-browser", "google-chrome")
MISSING = f"pictures need a browser, and there is none of {', '.join(NAMES)} here: apt-get install chromium"
_SECONDS = 300
_OPTIONS = (
    "--headless=new",
    "--no-sandbox",  # only pages of our own are opened
    "--no-first-run",
    "--hide-scrollbars",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-dev-shm-usage",
    "--host-resolver-rules=MAP * ~NOTFOUND",
    # WebGL without a graphics card.
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)


def browser() -> str | None:
    """Where the browser is; None where there is none."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


def content(page: Path) -> str:
    """What a page holds once its scripts have run, as HTML.

    Raises:
        HandsError: there is no browser, or it fails; the message says which.
    """
    return _run(page.resolve().as_uri(), "--dump-dom").decode("utf-8")


def screenshot(address: str, file: Path, size: tuple[int, int]) -> None:
    """Write a PNG of a page, given by its address, in a window of so many pixels, width and height.

    Raises:
        HandsError: as `content`.
    """
    wanted = (f"--screenshot={file.resolve()}", "--window-size={},{}".format(*size), "--virtual-time-budget=3000")
    file.unlink(missing_ok=True)
    _run(address, *wanted)
    if not file.is_file():
        raise HandsError(f"the browser wrote no {file}; try again with a newer Chromium")


def _run(address: str, *wanted: str) -> bytes:
    program = browser()
    if program is None:
        raise HandsError(MISSING)
    with TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [program, *_OPTIONS, f"--user-data-dir={profile}", *wanted, address]
        try:
            done = subprocess.run(command, capture_output=True, timeout=_SECONDS, check=False)
        except subprocess.TimeoutExpired:
            raise HandsError(
                f"{program} did not draw {address} within {_SECONDS} s; try again when the machine is less busy"
            ) from None
    if done.returncode:
        last = done.stderr.decode("utf-8", "replace").strip().splitlines()[-1:]
        raise HandsError(f"{program} ended with {done.returncode}: {' '.join(last)}; try another browser in PATH")
    return done.stdout
