"""Write one picture of the pages of some results, tiled, each at rest at one time of its motion.

    python scripts/pictures.py docs/hand.png results/gallery/sphere_rotation --at 2 --size 1000 750

Chromium without a screen draws them; the file's ending says the format. A page is drawn anew from its folder's data.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image
from shared import options_of

from casadi_hands.export.browser import screenshot
from casadi_hands.export.design import Design
from casadi_hands.export.page.page import write_page


def main() -> None:
    """Draw the pages, and tile their pictures row by row."""
    parser = options_of(__doc__)
    parser.add_argument("file", metavar="FILE", type=Path, help="the picture (.png, .jpg or .webp)")
    parser.add_argument("folders", metavar="DIR", nargs="+", type=Path, help="result folders")
    parser.add_argument("--at", type=float, nargs="+", default=[0.0], help="s, for all or for each")
    parser.add_argument("--size", type=int, nargs=2, default=[1000, 750], help="width and height of a window, pixels")
    parser.add_argument("--width", type=int, help="of a tile, pixels; as the window if not given")
    parser.add_argument("--columns", type=int, default=1, help="tiles in a row")
    given = parser.parse_args()
    count = len(given.folders)
    if len(given.at) not in (1, count):
        parser.error(f"--at: {len(given.at)} times for {count} folders; allowed: one for all, or {count}")
    if given.columns < 1:
        parser.error(f"--columns: given {given.columns}; allowed: 1 or more")
    times = given.at * (count if len(given.at) == 1 else 1)
    tiles = [drawn(folder, time, tuple(given.size)) for folder, time in zip(given.folders, times, strict=True)]
    tiled(tiles, given.columns, given.width or given.size[0]).save(given.file, quality=88, optimize=True)


def drawn(folder: Path, time: float, size: tuple[int, int]) -> Image.Image:
    """The page of a result folder at a time, s, in a window of a size, pixels."""
    with TemporaryDirectory() as place:
        page, picture = Path(place) / "page.html", Path(place) / "page.png"
        write_page(Design.load(folder), page, time)
        screenshot(f"{page.as_uri()}#still", picture, size)
        return Image.open(picture).convert("RGB")


def tiled(tiles: list[Image.Image], columns: int, width: int) -> Image.Image:
    """Pictures of one size, made ``width`` wide, beside and below each other."""
    height = round(tiles[0].height * width / tiles[0].width)
    rows = -(-len(tiles) // columns)
    whole = Image.new("RGB", (min(columns, len(tiles)) * width, rows * height), "white")
    for k, tile in enumerate(tiles):
        whole.paste(
            tile.resize((width, height), Image.Resampling.LANCZOS), (k % columns * width, k // columns * height)
        )
    return whole


if __name__ == "__main__":
    main()
