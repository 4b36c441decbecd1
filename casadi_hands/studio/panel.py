"""The form: a text field for each field of the task, with what it means beside it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from typing import Any

from casadi_hands.studio.document import Path
from casadi_hands.studio.fields import Field, Form

PAUSE = 0.5
"""s without a key, after which what was typed is taken."""
_OPEN = ("object",)


class Later:
    """Calls a function once nothing has asked for it for a while.

    Args:
        seconds: to wait.
    """

    def __init__(self, seconds: float = PAUSE) -> None:
        self._seconds, self._timer = seconds, threading.Timer(0, lambda: None)
        self._lock = threading.Lock()

    def call(self, function: Callable[[], None]) -> None:
        """Call it later, in place of what was to be called."""
        with self._lock:
            self._timer.cancel()
            self._timer = threading.Timer(self._seconds, function)
            self._timer.daemon = True
            self._timer.start()


class Panel:
    """The form on the page.

    Args:
        gui: viser's.
        typed: called with a field's path and what was typed into it, once the typing pauses.
    """

    def __init__(self, gui: Any, typed: Callable[[Path, str], None]) -> None:
        self._gui, self._typed = gui, typed
        self._folders: list[Any] = []
        self._inputs: dict[Path, Any] = {}
        self._written: dict[Path, str] = {}

    def show(self, form: Form, typing: Path | None = None) -> None:
        """Show a form; what a person types is not written over, and what the file refused stays to be mended.

        Args:
            form: of the file as it is now.
            typing: the field that somebody types in.
        """
        fields = {field.path: field for field in _all(form)}
        if fields.keys() != self._inputs.keys():
            self._build(form)
        for path, field in fields.items():
            if self._written[path] != field.written:
                self._written[path] = field.written
                if path != typing:
                    self._inputs[path].value = field.written

    def _build(self, form: Form) -> None:
        for folder in self._folders:
            folder.remove()
        self._folders, self._inputs, self._written = [], {}, {}
        self._add(Form("general", (), form.fields, ()), top=True)
        for inner in form.forms:
            self._add(inner, top=True)

    def _add(self, form: Form, top: bool = False) -> None:
        folder = self._gui.add_folder(form.title, expand_by_default=form.path in {(name,) for name in _OPEN})
        if top:
            self._folders.append(folder)
        with folder:
            for field in form.fields:
                self._add_field(field)
            for inner in form.forms:
                self._add(inner)

    def _add_field(self, field: Field) -> None:
        later = Later()
        default = "Required." if field.default == "required" else f"Default: {field.default}."
        handle = self._gui.add_text(field.name, field.written, hint=f"{field.about} {default}")
        self._inputs[field.path], self._written[field.path] = handle, field.written

        def take(event: Any) -> None:
            if event.client is not None:  # not what the program wrote
                later.call(lambda: self._typed(field.path, handle.value))

        handle.on_update(take)


def _all(form: Form) -> Iterator[Field]:
    yield from form.fields
    for inner in form.forms:
        yield from _all(inner)
