"""The tasks that are shipped: in the installed package, or beside it in a copy of the repository."""

from __future__ import annotations

from base64 import b64encode
from dataclasses import dataclass
from html import escape
from pathlib import Path
from shutil import copyfile

from casadi_hands.errors import HandsError
from casadi_hands.export.page.page import filled, head
from casadi_hands.task.schema import schema_line
from casadi_hands.task.shown import escaped
from casadi_hands.task.textfile import read
from casadi_hands.task.yamlfile import TaskFile

_PACKAGE = Path(__file__).resolve().parents[1]
FOLDERS = (_PACKAGE / "problems", _PACKAGE.parent / "problems")
"""Where they are: the first that is there."""


@dataclass(frozen=True)
class Example:
    """A task that is shipped.

    Attributes:
        name: by which it is asked for.
        about: it, in a sentence.
        path: of its file.
        meshes: files that it names, beside it.
        picture: of it, WebP; maybe not there.
    """

    name: str
    about: str
    path: Path
    meshes: tuple[str, ...]
    picture: Path


def examples() -> list[Example]:
    """All of them, sorted by name.

    Raises:
        HandsError: they are not there.
    """
    folder = next((each for each in FOLDERS if each.is_dir()), None)
    if folder is None:
        raise HandsError(f"{FOLDERS[0]}: not there; install casadi-hands again")
    found = (_example(path, folder / "pictures" / f"{path.stem}.webp") for path in folder.rglob("*.yaml"))
    return sorted(found, key=lambda each: each.name)


def show_examples(path: Path) -> None:
    """Write a page with a picture and a line of each.

    Raises:
        HandsError: the tasks are not there, or the page cannot be written.
    """
    cards = ""
    for each in examples():
        data = b64encode(each.picture.read_bytes()).decode() if each.picture.is_file() else ""
        image = f'<img src="data:image/webp;base64,{data}" alt="{escape(each.about)}">' if data else ""
        cards += f"<li>{image}<h2>{escape(each.name)}</h2><p>{escape(each.about)}</p></li>\n"
    text = filled("examples.html", {"head": head("Tasks that come with casadi-hands", "examples.css"), "cards": cards})
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise _unwritable(path, error) from None


def copy_example(name: str, out: Path | None) -> Path:
    """Copy a task, with the files that it names, and tell editors of its schema.

    Args:
        name: of the example.
        out: file to write; by default NAME.yaml here.

    Returns:
        What was written.

    Raises:
        HandsError: no such example, or there is such a file already.
    """
    known = {each.name: each for each in examples()}
    if name not in known:
        raise HandsError(f"given {escaped(name)}; allowed: {', '.join(known)}")
    example, target = known[name], out or Path(f"{name}.yaml")
    text = f"{schema_line()}\n{read(example.path)}"
    write_new(target, text)
    for mesh in example.meshes:
        if not (target.parent / mesh).exists():
            copyfile(example.path.parent / mesh, target.parent / mesh)
    return target


def write_new(path: Path, text: str) -> None:
    """Write a file that is not there yet.

    Raises:
        HandsError: it is there, or cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise HandsError(f"{path}: is there already; give another file, or move it away") from None
    except OSError as error:
        raise _unwritable(path, error) from None


def _unwritable(path: Path, error: OSError) -> HandsError:
    return HandsError(f"{path}: cannot be written: {error.strerror}; give another file")


def _example(path: Path, picture: Path) -> Example:
    data = TaskFile(read(path), path.name).data
    meshes = [shape["mesh"]["file"] for shape in data["object"]["shapes"] if "mesh" in shape]
    return Example(path.stem, " ".join(data["about"].split()), path, tuple(meshes), picture)
