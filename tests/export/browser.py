"""A headless Chromium for tests of pages, driven by its DevTools protocol over a pipe."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import time
from base64 import b64decode
from pathlib import Path
from types import TracebackType
from typing import Any

import pytest

from casadi_hands.errors import HandsError
from casadi_hands.export.browser import MISSING, browser

ARTEFACTS = Path(os.environ.get("ARTEFACTS") or Path(__file__).parents[2] / "artefacts")
"""Pictures for people to look at, of each page at each of `SIZES`, light and dark."""
_TILE = 2400  # px; taller pictures of pages are cut
SIZES = ((1440, 900), (768, 1024), (390, 844))
needs_browser = pytest.mark.browser
"""Of tests that fail where there is no Chromium; ``-m 'not slow and not browser'`` leaves them out."""
_FLAGS = (
    "--headless=new",
    "--remote-debugging-pipe",
    "--no-sandbox",
    "--no-first-run",
    "--hide-scrollbars",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-dev-shm-usage",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
    # WebGL without a graphics card; only pages of our own are opened.
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)


class Browser:
    """One page of a browser, and all that it says. Nothing but this machine can be reached from it.

    Attributes:
        problems: console errors and exceptions, of the page and of its frames.
        requests: addresses that were asked for, those of sockets among them.
    """

    def __init__(self) -> None:
        program = browser()
        if program is None:
            raise HandsError(MISSING)
        self.problems: list[str] = []
        self.requests: list[str] = []
        self._number, self._rest = 0, b""
        self._profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        to_browser, self._write = os.pipe()
        self._read, from_browser = os.pipe()

        # The browser reads commands at 3 and answers at 4.
        command = [program, *_FLAGS, f"--user-data-dir={self._profile.name}", "about:blank"]
        redirect = f'exec "$@" 3<&{to_browser} 4>&{from_browser}'
        self._process = subprocess.Popen(
            ["/bin/bash", "-c", redirect, "bash", *command],
            pass_fds=(to_browser, from_browser),
            stderr=subprocess.DEVNULL,
        )
        os.close(to_browser)
        os.close(from_browser)
        self._session: str | None = None
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._process.kill()
        self._process.wait()
        os.close(self._write)
        os.close(self._read)
        self._profile.cleanup()

    def call(self, method: str, **arguments: Any) -> Any:
        """Call a method of the protocol and return its result."""
        self._number += 1
        number = self._number
        command = {"id": number, "method": method, "params": arguments}
        if self._session:
            command["sessionId"] = self._session
        os.write(self._write, json.dumps(command).encode() + b"\0")
        while True:
            message = self._message()
            if message.get("id") == number:
                if "error" in message:
                    raise RuntimeError(f"{method}: {message['error']['message']}")
                return message["result"]
            self._heed(message)

    def open(self, page: Path | str, width: int = 1440, height: int = 900, dark: bool = False) -> None:
        """Open a file with the network off, or an address of this machine, in a window of a size, px."""
        offline, address = isinstance(page, Path), page.resolve().as_uri() if isinstance(page, Path) else page
        reach = {"latency": 0, "downloadThroughput": 0 if offline else -1, "uploadThroughput": 0 if offline else -1}
        self.call("Network.emulateNetworkConditions", offline=offline, **reach)
        self.look(width, height, dark)
        self.problems.clear()
        self.requests.clear()
        self.call("Page.navigate", url=address)
        self.wait("document.readyState === 'complete'")

    def look(self, width: int, height: int, dark: bool = False) -> None:
        """Give the window a size, px, and the system's colours; narrow ones are a phone's."""
        self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 500
        )
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])

    def evaluate(self, expression: str) -> Any:
        """The value of an expression on the page, which may be a promise.

        Raises:
            RuntimeError: the expression throws.
        """
        found = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in found:
            raise RuntimeError(str(found["exceptionDetails"].get("exception", found["exceptionDetails"])))
        return found["result"].get("value")

    def wait(self, expression: str, seconds: float = 60.0) -> Any:
        """The value of an expression on the page, once it is true.

        Raises:
            TimeoutError: it is not within so many seconds.
        """
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            try:
                if value := self.evaluate(expression):
                    return value
            except RuntimeError:
                pass  # the page is not there yet
            time.sleep(0.05)
        raise TimeoutError(f"{expression}; {self.problems}")

    def drag(self, start: tuple[float, float], end: tuple[float, float], steps: int = 8) -> None:
        """Press the mouse, move it, and let it go; px. Pages heed each of these at the next frame."""
        held: dict[str, Any] = {"button": "left", "buttons": 1, "clickCount": 1}
        self._mouse("mouseMoved", *start)
        time.sleep(0.3)
        self._mouse("mousePressed", *start, **held)
        for k in range(1, steps + 1):
            self._mouse("mouseMoved", *(a + (b - a) * k / steps for a, b in zip(start, end, strict=True)), **held)
            time.sleep(0.1)
        self._mouse("mouseReleased", *end, **held)

    def picture(self, path: Path, whole: bool = False) -> None:
        """Write a PNG of the window, or of the whole page."""
        found = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        path.write_bytes(b64decode(found["data"]))

    def keep(self, name: str, dark: bool) -> None:
        """Write pictures of the page among the artefacts, one after the other down to its end."""
        ARTEFACTS.mkdir(exist_ok=True)
        width, height = self.evaluate("[innerWidth, Math.max(innerHeight, document.documentElement.scrollHeight)]")
        tops = range(0, height, _TILE)
        for k, top in enumerate(tops, start=1):
            clip = {"x": 0, "y": top, "width": width, "height": min(_TILE, height - top), "scale": 1}
            found = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=len(tops) > 1, clip=clip)
            part = f"-{k}" if len(tops) > 1 else ""
            file = ARTEFACTS / f"{name}-{width}-{'dark' if dark else 'light'}{part}.png"
            file.write_bytes(b64decode(found["data"]))

    def pdf(self, path: Path) -> None:
        """Print the page."""
        found = self.call("Page.printToPDF", printBackground=True, preferCSSPageSize=True)
        path.write_bytes(b64decode(found["data"]))

    def _mouse(self, kind: str, x: float, y: float, **held: Any) -> None:
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **held)

    def _message(self) -> Any:
        while b"\0" not in self._rest:
            more = os.read(self._read, 1 << 16)
            if not more:
                raise RuntimeError("the browser ended")
            self._rest += more
        text, _, self._rest = self._rest.partition(b"\0")
        return json.loads(text)

    def _heed(self, message: dict[str, Any]) -> None:
        method, given = message.get("method"), message.get("params", {})
        if method == "Runtime.exceptionThrown":
            details = given["exceptionDetails"]
            self.problems.append(str(details.get("exception", {}).get("description", details["text"])))
        elif method == "Runtime.consoleAPICalled" and given["type"] in ("error", "assert"):
            self.problems.append(" ".join(str(each.get("value", each.get("description"))) for each in given["args"]))
        elif method == "Log.entryAdded" and given["entry"]["level"] == "error":
            self.problems.append(f"{given['entry']['text']} {given['entry'].get('url', '')}".strip())
        elif method == "Network.requestWillBeSent":
            self.requests.append(given["request"]["url"])
        elif method == "Network.webSocketCreated":
            self.requests.append(given["url"])
