"""Only who has the token reaches the page, and nothing of it is shared."""

from __future__ import annotations

import socket
from http.client import HTTPConnection
from urllib.parse import urlsplit

import pytest

pytest.importorskip("viser")

from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from casadi_hands.errors import HandsError
from casadi_hands.studio import access


@pytest.fixture(scope="module")
def server():
    server, address = access.open_server()
    yield server, urlsplit(address)
    server.stop()


def get(address, path, **headers):
    connection = HTTPConnection(address.hostname, address.port, timeout=10)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    return answer.status, dict(answer.getheaders()), answer.read()


def socket_to(address, path, origin):
    with connect(f"ws://{address.netloc}{path}", origin=origin, subprotocols=["viser-v0"]) as opened:
        return opened.subprotocol


def test_the_page_is_for_who_has_the_address(server):
    _, address = server
    status, headers, text = get(address, address.path)
    assert status == 200
    assert b"<html" in text
    assert headers["Referrer-Policy"] == "no-referrer"
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert f"ws://{address.netloc};" in headers["Content-Security-Policy"]
    token = address.path.strip("/")
    assert len(token) == 32
    for path in ("/", "/index.html", f"/{token[:-1]}/", f"/{token.swapcase()}/", f"/x/{token}/", f"/?token={token}"):
        assert get(address, path)[0] == 403
    assert get(address, f"/{token}/../../_viser.py")[0] == 404


def test_sockets_are_for_the_page_alone(server):
    _, address = server
    own, path = f"http://{address.netloc}", address.path.rstrip("/")
    assert socket_to(address, path, own)
    for where, origin in ((path, "http://evil.example"), (path, "null"), ("/", own), ("/abc", own)):
        with pytest.raises(InvalidStatus, match="403"):
            socket_to(address, where, origin)


def test_it_listens_on_this_machine_alone(server):
    _, address = server
    assert address.hostname == "127.0.0.1"
    others = {each[4][0] for each in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)} - {"127.0.0.1"}
    for other in others:
        with pytest.raises(OSError):  # noqa: PT011
            socket.create_connection((other, address.port), timeout=2).close()


def test_nothing_is_shared(server):
    assert server[0].request_share_url() is None


def test_a_server_that_is_not_guarded_is_stopped(monkeypatch):
    monkeypatch.setattr(access, "guard", lambda token, answer: answer)
    with pytest.raises(HandsError, match="cannot be guarded"):
        access.open_server()


def test_without_viser_the_message_says_what_to_install(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "viser", None)
    with pytest.raises(HandsError, match=r"pip install 'casadi-hands\[studio\]'"):
        access.open_server()
