"""The page: the task in the middle, its file on the left, its fields and the solve on the right."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.errors import HandsError
from casadi_hands.export.page.scene import eye_towards
from casadi_hands.studio import words
from casadi_hands.studio.document import Path as Where
from casadi_hands.studio.document import with_field
from casadi_hands.studio.drawing import TaskDrawing
from casadi_hands.studio.fields import form_of
from casadi_hands.studio.panel import Later, Panel
from casadi_hands.studio.places import Place, moved, places, removed, with_finger, with_goal
from casadi_hands.studio.results import Results
from casadi_hands.studio.session import Session
from casadi_hands.studio.window import View, arrange
from casadi_hands.task import Task

_NOTHING = "nothing"
_FINGERS = ("thumb", "index", "middle", "ring", "little")


class Studio:
    """The page of a task.

    Args:
        server: viser's.
        session: the task.
        command: that solves a task file, to which the file, ``--out`` and a folder are added.
        out: the folder for results.
    """

    def __init__(self, server: Any, session: Session, command: Sequence[str], out: Path) -> None:
        self.session = session
        self._server, self._lock = server, threading.RLock()
        self._gizmo: Any = None
        self._chosen: Where | None = None
        gui = server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, control_width="large")
        server.scene.world_axes.visible = False
        server.scene.configure_environment_map(None)  # a browser without a graphics card would stand still for seconds
        server.scene.add_light_hemisphere("light", intensity=2.0)
        self._drawing = TaskDrawing(server.scene, lambda place: self.choose(place.path))
        self._add_file(gui)
        self._besides = gui.add_html("")  # what the file's panel says, where that may be folded up
        self._add_moves(gui)
        self.results = Results(server, out, command, self._before_solve)
        self._panel = Panel(gui, self._type_field)
        self._show()
        view = self._view()
        server.on_client_connect(lambda client: arrange(client, self._file_panel, view))

    def close(self) -> None:
        """Stop what runs."""
        self.results.close()

    def _add_file(self, gui: Any) -> None:
        """The file's text, what check says of it, and buttons."""
        panel = self._file_panel = gui.add_panel()
        later = Later()
        with panel.add_tab("Task file"):
            gui.add_html(words.STYLE)
            self._state = gui.add_html("")
            self._findings = gui.add_html("")
            does = {"save": self.session.save, "undo": self.session.undo, "reload": self.session.reload}
            buttons = gui.add_button_group(
                "file",
                list(does),
                hint="Write the file, as solving does, too; take the last change back; read the file.",
            )
            self._text = gui.add_text("", self.session.text, multiline=True)
        buttons.on_click(lambda _: self._do(does[buttons.value]))

        def take(event: Any) -> None:
            if event.client is not None:  # not what the program wrote
                later.call(lambda: self._do(lambda: self.session.edit(lambda _: self._text.value), text=False))

        self._text.on_update(take)

    def _add_moves(self, gui: Any) -> None:
        """What is moved, and what is added."""
        with gui.add_folder("place"):
            self._choice = gui.add_dropdown(
                "move", [_NOTHING], hint="What the arrows and rings move; or click it in the picture."
            )
            buttons = gui.add_button_group(
                "change",
                ["add goal", "add finger", "remove"],
                hint="A goal a second after the last; a finger far from the others; remove what is chosen above.",
            )
        does = {"add goal": lambda: self._change(with_goal), "add finger": self._add_finger, "remove": self._remove}
        buttons.on_click(lambda _: does[buttons.value]())

        def choose(event: Any) -> None:
            if event.client is not None:
                found = [each.path for each in self._places() if each.name == self._choice.value]
                self.choose(found[0] if found else None)

        self._choice.on_update(choose)

    def _places(self) -> list[Place]:
        written = self.session.last.written
        return [] if written is None else places(written)

    def _place(self) -> Place | None:
        return next((each for each in self._places() if each.path == self._chosen), None)

    def _change(self, change: Callable[[str, Task], str]) -> None:
        """Change the text of a task that can be drawn."""
        written = self.session.understood.written
        if written is None:
            self._say("First mend what the file's text says, then move and add things.")
            return
        self._do(lambda: self.session.edit(lambda text: change(text, written)))

    def _do(self, action: Callable[[], None], text: bool = True, typing: Where | None = None) -> None:
        """Do something to the session, say what stands against it, and show what it is now.

        Args:
            action: what to do.
            text: whether to write the file's text; not while somebody types in it.
            typing: the field that somebody types in.
        """
        with self._lock:
            try:
                action()
            except HandsError as error:
                self._say(str(error))
            self._show(text, typing)

    def _type_field(self, path: Where, typed: str) -> None:
        self._do(lambda: self.session.edit(lambda text: with_field(text, path, typed)), typing=path)

    def _add_finger(self) -> None:
        def change(text: str, task: Task) -> str:
            free = (name for name in _FINGERS if name not in task.fingers)
            return with_finger(text, task, next(free, f"finger{len(task.fingers)}"))

        self._change(change)

    def _remove(self) -> None:
        place = self._place()
        if place is None or not place.removable:
            self._say("Choose a goal, a finger or a pose of the palm's motion first.")
            return
        self._chosen = None
        self._change(lambda text, _: removed(text, place))

    def _before_solve(self) -> Path:
        """Save the file that shall be solved.

        Raises:
            HandsError: it cannot be solved, or saved.
        """
        with self._lock:
            if not self.session.understood.solvable:
                raise HandsError("before it is solved, mend what check says of the task")
            if self.session.unsaved:
                self.session.save()
            self._show()
        return self.session.path

    def _say(self, text: str) -> None:
        for client in self._server.get_clients().values():
            client.add_notification("casadi-hands", text, auto_close_seconds=12.0, color="red")

    def _show(self, text: bool = True, typing: Where | None = None) -> None:
        """Bring the page to what the session is."""
        session = self.session
        state = "not saved yet" if session.unsaved else "saved"
        self._state.content = words.told([("doubt" if session.unsaved else "good", f"{session.path}: {state}")])
        self._findings.content = words.findings_told(session.understood)
        self._besides.content = words.STYLE + words.in_narrow_windows(self._findings.content)
        if text and self._text.value != session.text:
            self._text.value = session.text
        with suppress(HandsError):  # not YAML, as the findings say; the form stays as it was
            self._panel.show(form_of(session.text), typing)
        if session.understood.written is not None:
            with self._server.atomic():
                self._drawing.draw(session.understood.written)
        self.choose(self._chosen)

    def choose(self, path: Where | None) -> None:
        """Let something be moved.

        Args:
            path: of a place; None for nothing.
        """
        with self._lock:
            self._chosen = path
            if self._gizmo is not None:
                self._gizmo.remove()
                self._gizmo = None
            place = self._place()
            options = [_NOTHING, *(each.name for each in self._places())]
            if list(self._choice.options) != options:
                self._choice.options = options
            self._choice.value = place.name if place else _NOTHING
            if place is not None and place.moves and self.session.understood.written is not None:
                self._add_gizmo(place)

    def _add_gizmo(self, place: Place) -> None:
        size = self.session.understood.written.object.characteristic_length  # type: ignore[union-attr]
        gizmo = self._server.scene.add_transform_controls(
            "/gizmo",
            scale=(1.5 if place.turns else 0.8) * size,
            disable_rotations=not place.turns,
            position=place.position,
            wxyz=Rotation.from_matrix(place.rotation).as_quat(scalar_first=True),
            depth_test=False,
        )

        async def follow(event: Any) -> None:  # in order, which functions on viser's threads are not
            if event.phase == "end":
                threading.Thread(target=self._dropped, args=(place, gizmo)).start()
            else:
                self._drawing.move(place, gizmo.position, gizmo.wxyz)

        gizmo.on_update(follow)
        self._gizmo = gizmo

    def _dropped(self, place: Place, gizmo: Any) -> None:
        position, wxyz = np.array(gizmo.position), np.array(gizmo.wxyz)
        rotation = Rotation.from_quat(wxyz, scalar_first=True).as_matrix()
        self._change(lambda text, task: moved(text, task, place, position, rotation))

    def _view(self) -> View | None:
        """The palm and the object."""
        task = self.session.last.written
        if task is None:
            return None
        points = np.array([each.position for each in places(task)])
        middle = (points.min(axis=0) + points.max(axis=0)) / 2
        size = max(task.palm.radius, task.object.characteristic_length)
        reach = float(np.linalg.norm(points - middle, axis=1).max()) + size
        self._server.initial_camera.near = 0.01 * reach
        return View(middle, eye_towards(task.palm.rotation[:, 2]), reach)
