"""Meshcat without its server: what would be sent to a browser is kept, to be written into a page."""

from __future__ import annotations

from typing import Any

import umsgpack  # type: ignore[import-untyped]
from meshcat.visualizer import Visualizer


class Recorder:
    """Stands where meshcat's window to its server would stand and keeps the commands, packed as meshcat packs them.

    A server of meshcat's own would open ports and needs a second process only to write a file.

    Attributes:
        commands: msgpack bytes, in the order in which they were sent.
    """

    def __init__(self) -> None:
        """Start with no commands."""
        self.commands: list[bytes] = []

    def send(self, command: Any) -> None:
        """Keep one of meshcat's commands."""
        data = command.lower()
        if data["type"] == "set_object":
            _rename(data["object"], data["path"])
        self.commands.append(umsgpack.packb(data))


def _rename(drawing: dict[str, Any], path: str) -> None:
    """Replace random identifiers by places in the scene, so that equal designs give equal pages."""
    geometry, material = f"{path}:geometry", f"{path}:material"
    drawing["geometries"][0]["uuid"], drawing["materials"][0]["uuid"] = geometry, material
    drawing["object"].update(uuid=path, geometry=geometry, material=material)


def recording() -> tuple[Visualizer, Recorder]:
    """A meshcat visualizer and the recorder that keeps what is drawn with it."""
    recorder = Recorder()
    return Visualizer(window=recorder), recorder
