"""The page's server: on this machine only, and only for who has the address that the command printed."""

from __future__ import annotations

import contextlib
import io
import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import replace
from http.client import HTTPConnection
from typing import Any

from casadi_hands.errors import HandsError

HOST = "127.0.0.1"
# Nothing but this server, and what the page itself holds; viser's page is one file that unpacks its own scripts.
_POLICY = (
    "default-src 'none'; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob: data:; style-src 'unsafe-inline' blob: "
    "data:; img-src 'self' data: blob:; font-src data: blob:; worker-src blob: data:; connect-src 'self' data: blob: "
    "ws://{host}; frame-ancestors 'none'; form-action 'none'; base-uri 'none'"
)
# viser's page is dark where its address says so; here where the browser does, and anew when that changes.
_COLORS = b"""<script>
  const dark = matchMedia("(prefers-color-scheme: dark)");
  function follow() {
    const url = new URL(location);
    if (dark.matches) url.searchParams.set("darkMode", ""); else url.searchParams.delete("darkMode");
    history.replaceState(null, "", url);
  }
  follow();
  dark.addEventListener("change", () => { follow(); location.reload(); });
</script>"""
_HEADERS = {"Referrer-Policy": "no-referrer", "Cache-Control": "no-store", "X-Content-Type-Options": "nosniff"}


def open_server(port: int = 0, label: str = "") -> tuple[Any, str]:
    """Start a server of viser's on the loopback interface.

    viser has no access control of its own: whoever reaches the port could use it, other users of the machine and pages
    of other sites in the browser too. Here requests need a token, drawn anew each time, that only the printed address
    has, and come from no other page.

    Args:
        port: 0 for any free one; where it is taken, the next free one.
        label: above the page's panel.

    Returns:
        viser's server, and the address of its page.

    Raises:
        HandsError: viser is not installed, or is a version whose requests cannot be guarded.
    """
    try:
        import viser
    except ImportError:
        raise HandsError("the studio needs viser: pip install 'casadi-hands[studio]'") from None

    class Server(viser.ViserServer):  # type: ignore[misc, unused-ignore]
        """Without viser's offer to share the page through servers of its own."""

        def request_share_url(self, verbose: bool = True) -> None:
            """Share nothing."""

    token = secrets.token_urlsafe(24)
    with _guarded(token), redirect_stdout(io.StringIO()):  # viser prints an address without the token
        server = Server(host=HOST, port=port, label=label, verbose=False)
    number = server.get_port()
    if _status(number, "/") != 403 or _status(number, f"/{token}/") != 200:
        server.stop()
        raise HandsError("this version of viser cannot be guarded; pip install 'casadi-hands[studio]'")
    return server, f"http://{HOST}:{number}/{token}/"


@contextmanager
def _guarded(token: str) -> Iterator[None]:
    """While a server starts, let it look at each request before viser does."""
    import websockets.asyncio.server

    sockets: Any = websockets.asyncio.server

    serve = sockets.serve

    def serve_guarded(handler: Any, host: str, port: int, *, process_request: Any, **options: Any) -> Any:
        return serve(handler, host, port, process_request=guard(token, process_request), **options)

    sockets.serve = serve_guarded
    try:
        yield
    finally:
        sockets.serve = serve


def guard(token: str, answer: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """What answers requests whose path begins with the token as another does without it, and refuses all else.

    Args:
        token: that the path begins with.
        answer: to a connection and its request, of `websockets`; None lets it become a socket.
    """

    def guarded(connection: Any, request: Any) -> Any:
        given, _, rest = str(request.path).partition("?")[0].removeprefix("/").partition("/")
        host = request.headers.get("Host", "")
        origin = request.headers.get("Origin")
        known = secrets.compare_digest(given.encode(), token.encode())
        if not known or origin not in (None, f"http://{host}"):
            return connection.respond(403, "Open the address that casadi-hands studio printed.\n")
        if "Accept-Encoding" in request.headers:
            del request.headers["Accept-Encoding"]  # what is packed cannot be added to
        response = answer(connection, replace(request, path=f"/{rest}"))
        if response is not None:
            _follow_colors(response)
            response.headers["Content-Security-Policy"] = _POLICY.format(host=host)
            for name, value in _HEADERS.items():
                response.headers[name] = value
        return response

    return guarded


def _follow_colors(response: Any) -> None:
    """Let a page, in a response of `websockets`, be dark where the browser is."""
    head = b"<head>"
    if head in response.body[:1000]:
        response.body = bytes(response.body).replace(head, head + _COLORS, 1)
        del response.headers["Content-Length"]
        response.headers["Content-Length"] = str(len(response.body))


def _status(port: int, path: str) -> int:
    """What the server answers."""
    with contextlib.closing(HTTPConnection(HOST, port, timeout=10)) as connection:
        connection.request("GET", path)
        return connection.getresponse().status
