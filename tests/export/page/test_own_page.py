"""A page from a stranger does not reach the browser; what the folder's data give does."""

from http.server import BaseHTTPRequestHandler, HTTPServer
from threading import Thread

import pytest

from casadi_hands.errors import DesignError
from casadi_hands.export.page.own_page import open_page
from casadi_hands.export.page.page import MenuEntry, write_page
from tests.export.browser import Browser, needs_browser
from tests.export.example import example_design


@pytest.fixture
def opened(monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address) or True)
    return opened


@pytest.fixture
def folder(tmp_path):
    example_design().save(tmp_path / "design")
    return tmp_path / "design"


def test_a_page_that_is_the_folders_own_is_opened_as_it_is(folder, opened, caplog):
    page = folder / "viewer.html"
    before = page.stat().st_mtime_ns, page.stat().st_ino
    assert open_page(folder) == page
    assert opened == [page.as_uri()]
    assert (page.stat().st_mtime_ns, page.stat().st_ino) == before
    assert not caplog.records


@pytest.mark.parametrize("how", ["another", "longer", "not text", "a link", "none"])
def test_any_other_page_is_made_anew(how, folder, opened, caplog, tmp_path):
    page = folder / "viewer.html"
    own = page.read_bytes()
    elsewhere = tmp_path / "elsewhere.html"
    elsewhere.write_bytes(own)
    page.unlink()
    if how == "a link":
        page.symlink_to(elsewhere)
    elif how != "none":
        page.write_bytes({"another": b"<script></script>", "longer": own + b" ", "not text": b"\xff" + own}[how])
    open_page(folder)
    assert page.read_bytes() == own == elsewhere.read_bytes()
    assert not page.is_symlink()
    assert ["made anew" in message for message in caplog.messages] == [True] * (how not in ("none", "a link"))
    assert {path.name for path in folder.iterdir() if path.name.startswith(".")} == set()


def menu(shown):
    return [MenuEntry(f"seed {k} & <b>", None if k == shown else f"../seed{k}/viewer.html") for k in (0, 1)]


def test_menus_and_the_pages_that_they_lead_to_are_kept(tmp_path, opened):
    for k in (0, 1):
        example_design().save(tmp_path / f"seed{k}")
        write_page(example_design(), tmp_path / f"seed{k}/viewer.html", menu=menu(k))
    pages = [tmp_path / f"seed{k}/viewer.html" for k in (0, 1)]
    own = [page.read_bytes() for page in pages]
    open_page(tmp_path / "seed0")
    assert [page.read_bytes() for page in pages] == own
    pages[1].write_bytes(own[1].replace(b"</body>", b"<script>alert(1)</script></body>"))
    open_page(tmp_path / "seed0")
    assert [page.read_bytes() for page in pages] == own


def test_a_menu_leads_to_nothing_but_alternatives(folder, opened):
    page = folder / "viewer.html"
    own = page.read_bytes()
    write_page(example_design(), page, menu=[MenuEntry("seed 0", None), MenuEntry("x", "javascript:alert(1)")])
    open_page(folder)
    assert b"javascript:alert" not in page.read_bytes()
    assert page.read_bytes() != own  # the entry that leads nowhere is kept


def test_a_page_that_cannot_be_replaced_is_not_opened(folder, opened, monkeypatch):
    (folder / "viewer.html").write_text("<script></script>")

    def refuse(*_, **__):
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr("tempfile.mkstemp", refuse)
    with pytest.raises(DesignError, match=r"it is not opened; it cannot be replaced: .*Read-only"):
        open_page(folder)
    assert opened == []


def test_a_page_without_a_design_is_not_opened(tmp_path, opened):
    (tmp_path / "viewer.html").write_text("<script></script>")
    with pytest.raises(DesignError, match=r"no result\.json"):
        open_page(tmp_path)
    assert opened == []


def test_without_a_browser_the_message_says_what_to_open(folder, monkeypatch):
    monkeypatch.setattr("webbrowser.open", lambda address: False)
    with pytest.raises(DesignError, match=r"no browser found; open .*viewer\.html in one yourself"):
        open_page(folder)


@pytest.fixture
def server():
    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            self.server.asked.append(self.path)
            self.send_response(200)
            self.end_headers()

        def log_message(self, *_):
            pass

    with HTTPServer(("127.0.0.1", 0), Handler) as server:
        server.asked = []
        Thread(target=server.serve_forever, daemon=True).start()
        yield server
        server.shutdown()


@needs_browser
def test_a_strangers_page_fetches_nothing(folder, opened, server):
    page, where = folder / "viewer.html", f"http://127.0.0.1:{server.server_port}"
    spoilt = f"<img src='{where}/image'><script>fetch('{where}/script')</script>"
    page.write_text(
        page.read_text().replace("<body>", f"<body>{spoilt}").replace("default-src 'none'", "default-src *")
    )
    with Browser() as browser:
        browser.open(page.as_uri())
        assert "/script" in server.asked
        open_page(folder)
        server.asked.clear()
        browser.open(opened[0])
        browser.evaluate("new Promise((done) => setTimeout(done, 1000))")
        assert server.asked == []
        assert [each for each in browser.requests if not each.startswith(("data:", "blob:"))] == opened
