"""Draw the shipped tasks, small: palm, object, contacts and goals, as `check --show` does.

    python scripts/thumbnails.py

Writes ``problems/pictures/NAME.webp`` for every task file, or for those that are named; needs Chromium.
"""

from __future__ import annotations

from argparse import ArgumentParser
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

from casadi_hands.export.page.task_page import write_task_page
from casadi_hands.task import load_task

PROBLEMS = Path(__file__).parents[1] / "problems"
SIZE = (320, 240)


def main() -> None:
    """Draw them."""
    parser = ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="tasks; by default all")
    names = parser.parse_args().names
    for file in sorted(PROBLEMS.rglob("*.yaml")):
        if names and file.stem not in names:
            continue
        target = PROBLEMS / "pictures" / f"{file.stem}.webp"
        target.parent.mkdir(exist_ok=True)
        target.write_bytes(thumbnail(file))
        print(target, f"{target.stat().st_size} bytes", flush=True)


def thumbnail(file: Path) -> bytes:
    """The drawing of a task file, WebP."""
    with TemporaryDirectory() as place:
        drawn = Path(place) / "task.png"
        write_task_page(load_task(file), drawn, "")
        picture = Image.open(drawn).convert("RGB")
        width = round(picture.height * SIZE[0] / SIZE[1])
        left = (picture.width - width) // 2
        small = picture.crop((left, 0, left + width, picture.height)).resize(SIZE, Image.Resampling.LANCZOS)
    data = BytesIO()
    small.save(data, "WEBP", quality=70, method=6)
    return data.getvalue()


if __name__ == "__main__":
    main()
