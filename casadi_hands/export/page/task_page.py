"""A page of a task that nothing was solved for: palm, object, contacts by name, goals as ghosts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from casadi_hands.errors import HandsError
from casadi_hands.export.browser import screenshot
from casadi_hands.export.page.film import PICTURE_SIZE
from casadi_hands.export.page.page import write_page
from casadi_hands.problem.result import Result
from casadi_hands.task import Task


def write_task_page(task: Task, path: Path, words: str, sets: Sequence[Mapping[str, Sequence[float]]] = ()) -> None:
    """Write the page of a task, which opens without a server and without a network.

    Args:
        task: as loaded.
        path: the file to write; one that ends in .png becomes a picture of the page.
        words: what stands below the task's name.
        sets: of contacts that were found, m, object frame, by finger, of which the task has the first.

    Raises:
        HandsError: the file cannot be written; a picture needs a browser, and there is none, or it cannot draw.
    """
    placement = {"sets": [{"points": dict(each)} for each in sets]} if sets else {}
    result = Result(task=task, status=words, placement=placement)
    try:
        if path.suffix.lower() != ".png":
            write_page(result, path)
            return
        with TemporaryDirectory() as place:
            page = Path(place) / "task.html"
            write_page(result, page)
            drawn = page.with_suffix(".png")
            screenshot(f"{page.as_uri()}#still", drawn, PICTURE_SIZE)
            path.write_bytes(drawn.read_bytes())
    except OSError as error:
        raise HandsError(f"{path}: cannot be written: {error.strerror}; give a file in another folder") from None
