"""Pictures of sparsity patterns that need no other program: SVG with a PNG in it."""

from __future__ import annotations

import struct
import zlib
from base64 import b64encode
from collections.abc import Mapping
from html import escape

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.int64]
_LARGEST = 640  # pixels of a picture's longer side
_MARGIN = 110  # pixels at its left and top, where names stand
_APART = 9  # pixels between names, at least


def sparsity_picture(
    places: tuple[Indices, Indices],
    shape: tuple[int, int],
    rows: Mapping[str, tuple[int, int]],
    columns: Mapping[str, tuple[int, int]],
) -> str:
    """An SVG element: a dark spot wherever there is a nonzero, lines between named blocks.

    Args:
        places: row and column of each nonzero.
        shape: of the matrix.
        rows: name of a block of rows -> its first row and the one after its last.
        columns: likewise.
    """
    scale = _LARGEST / max(*shape, 1)
    height, width = (max(round(scale * size), 1) for size in shape)
    fewer = min(scale, 1.0)
    spots = np.full([max(int(np.ceil(fewer * size)), 1) for size in shape], 255, np.uint8)
    row, column = ((fewer * np.asarray(each)).astype(int) for each in places)
    spots[row, column] = 40
    image = b64encode(_png(spots)).decode()
    lines, names = [], []
    for vertical, blocks in ((False, rows), (True, columns)):
        last = -np.inf
        for name, (first, after) in blocks.items():
            at, middle = _MARGIN + scale * first, _MARGIN + scale * (first + after) / 2
            lines.append(_line(at, height, width, vertical))
            if middle - last >= _APART and after > first:
                names.append(_name(name, middle, vertical))
                last = middle
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width + _MARGIN + 2} {height + _MARGIN + 2}" '
        f'width="{width + _MARGIN + 2}" font-family="sans-serif" font-size="9">'
        f'<image x="{_MARGIN}" y="{_MARGIN}" width="{width}" height="{height}" preserveAspectRatio="none" '
        f'style="image-rendering: pixelated" href="data:image/png;base64,{image}"/>'
        f'<rect x="{_MARGIN}" y="{_MARGIN}" width="{width}" height="{height}" fill="none" stroke="#888"/>'
        f'<g stroke="#36c" stroke-opacity="0.35" stroke-width="0.5">{"".join(lines)}</g>{"".join(names)}</svg>'
    )


def _line(at: float, height: int, width: int, vertical: bool) -> str:
    if vertical:
        return f'<line x1="{at:.1f}" x2="{at:.1f}" y1="{_MARGIN}" y2="{_MARGIN + height}"/>'
    return f'<line x1="{_MARGIN}" x2="{_MARGIN + width}" y1="{at:.1f}" y2="{at:.1f}"/>'


def _name(name: str, at: float, vertical: bool) -> str:
    if vertical:
        return f'<text transform="translate({at + 3:.1f} {_MARGIN - 4}) rotate(-60)">{escape(name)}</text>'
    return f'<text x="{_MARGIN - 4}" y="{at + 3:.1f}" text-anchor="end">{escape(name)}</text>'


def _png(pixels: NDArray[np.uint8]) -> bytes:
    """A picture (h, w) in shades of grey as a PNG."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    height, width = pixels.shape
    lines = np.hstack([np.zeros((height, 1), np.uint8), pixels])  # each begins with its filter: none
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    content = zlib.compress(lines.tobytes(), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", content) + chunk(b"IEND", b"")
