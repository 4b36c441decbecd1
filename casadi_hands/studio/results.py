"""The part of the page that solves: a button, what the solve says, the best hand so far, and its motion."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from casadi_hands.errors import HandsError
from casadi_hands.export.design import Design
from casadi_hands.studio import words
from casadi_hands.studio.drawing import RESULT, TASK, ResultDrawing
from casadi_hands.studio.solving import Solve, Watched

_BEAT = 1 / 25  # s between frames
_LOOK = 1.0  # s between looks at the folder
_KEPT = 6  # lines of what the solve says
_TASK, _HAND = "task", "hand"


class Results:
    """Solving, and what comes of it.

    Args:
        server: viser's.
        out: the folder that solves write.
        command: that solves a task file, to which the file, ``--out`` and the folder are added.
        ready: gives the file to solve; a `HandsError` says why there is none.
    """

    def __init__(self, server: Any, out: Path, command: Sequence[str], ready: Callable[[], Path]) -> None:
        self._server, self._command, self._ready = server, command, ready
        self._drawing = ResultDrawing(server.scene, server.atomic)
        self._hidden = [server.scene.add_frame(name, show_axes=False) for name in (TASK, RESULT)]
        self._watched = Watched(out)
        self._solve: Solve | None = None
        self._lines: list[str] = []
        self._closed, self._lock = threading.Event(), threading.RLock()
        gui = server.gui
        with gui.add_folder("solve"):
            self._start = gui.add_button("Solve", hint=f"Save the file, design a hand, in {out}.", color="green")
            self._stop = gui.add_button("Stop", hint="What was computed stays in the folder.", visible=False)
            self._said = gui.add_html("")
            self._stands = gui.add_html("")
            self._view = gui.add_dropdown("show", [_TASK, _HAND], initial_value=_TASK)
            self._play = gui.add_checkbox("play", True, visible=False)
            self._time = gui.add_slider("time, s", 0.0, 1.0, 0.01, 0.0, visible=False)
        self._start.on_click(lambda _: self.start())
        self._stop.on_click(lambda _: self._end())
        self._view.on_update(lambda _: self._switch())

        self._time.on_update(self._scrub)
        self._switch()
        self._load()
        threading.Thread(target=self._run, daemon=True).start()

    def start(self) -> None:
        """Solve the task, unless one is being solved."""
        if self._running:
            return
        try:
            file = self._ready()
        except HandsError as error:
            self._said.content = words.told([("bad", str(error))])
            return
        self._lines = []
        self._stands.content = ""
        self._tell("starting")
        self._start.visible, self._stop.visible = False, True
        command = [*self._command, str(file), "--out", str(self._watched.folder)]
        self._solve = Solve(command, self._tell, self._ended)

    @property
    def _running(self) -> bool:
        return self._solve is not None and self._solve.running

    def show_hand(self) -> None:
        """Show the hand in place of the task, if there is one."""
        self._view.value = _HAND
        self._switch()

    def close(self) -> None:
        """Stop the solve, if there is one, and the motion."""
        self._closed.set()
        self._end()

    def _end(self) -> None:
        if self._solve is not None:
            self._solve.stop()

    def _tell(self, line: str) -> None:
        self._lines = [*self._lines, line][-_KEPT:]
        self._said.content = words.told(("", each) for each in self._lines)

    def _ended(self, status: int, rest: str) -> None:
        self._start.visible, self._stop.visible = True, False
        if status not in (0, 1, 130):
            self._tell(f"the solve ended with status {status}: {rest.strip()[-300:]}")
        self._watched.changed()
        self._load()

    def _load(self) -> None:
        """Draw the folder's design, if there is one."""
        with self._lock:
            try:
                design = Design.load(self._watched.folder)
                drawn = self._drawing.draw(design)
            except HandsError:
                return  # none yet, or being written: the next look sees it
            self._stands.content = words.result_told(design, str(self._watched.folder), self._running)
            if drawn:
                self._time.max = max(self._drawing.end, 0.01)
                if self._solve is not None:  # what was there before is shown when it is asked for
                    self._view.value = _HAND
            self._switch()

    def _scrub(self, event: Any) -> None:
        """Show the time that a person chose, and rest there."""
        if event.client is not None:
            self._play.value = False
            self._drawing.show(self._time.value)

    def _switch(self) -> None:
        """Show the task or the hand."""
        hand = self._view.value == _HAND and self._drawing.there
        task_frame, result_frame = self._hidden
        task_frame.visible, result_frame.visible = not hand, hand
        self._play.visible = self._time.visible = hand and self._drawing.end > 0

    def _run(self) -> None:
        """Move the hand, and look for a new one."""
        looked = before = time.monotonic()
        while not self._closed.wait(_BEAT):
            now = time.monotonic()
            if self._time.visible and self._play.value:
                moment = self._time.value + (now - before)
                with self._lock:
                    self._time.value = 0.0 if moment > self._drawing.end else moment
                    self._drawing.show(self._time.value)
            before = now
            if now - looked > _LOOK:
                looked = now
                if self._watched.changed():
                    self._load()
