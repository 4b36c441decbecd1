"""A camera, and its pictures as PNG files."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np

OVERSAMPLING = 2
"""Rays per pixel and direction."""


@dataclass(frozen=True)
class Camera:
    """A camera with perspective.

    Attributes:
        position: (3,).
        axes: (3, 3) rows: right, up, back to the viewer.
        focal: focal length over the picture's width.
        offset: (2,) what is in the picture's middle, right and up, over the width.
        size: width and height, pixels.
    """

    position: np.ndarray
    axes: np.ndarray
    focal: float
    offset: np.ndarray
    size: tuple[int, int]

    @cached_property
    def rays(self) -> np.ndarray:
        """Unit directions (rows, columns, 3) of all rays."""
        width, height = (OVERSAMPLING * n for n in self.size)
        x = ((np.arange(width) + 0.5) / width - 0.5 + self.offset[0]) / self.focal
        y = ((height / 2 - np.arange(height) - 0.5) / width + self.offset[1]) / self.focal
        flat = np.stack([*np.meshgrid(x, y), -np.ones((height, width))], axis=-1)
        rays: np.ndarray = (flat / np.linalg.norm(flat, axis=-1, keepdims=True)) @ self.axes
        return rays


def look(eye: np.ndarray, points: np.ndarray, size: tuple[int, int], margin: float = 0.06) -> Camera:
    """A camera that looks against ``eye`` and has all points in its picture.

    Args:
        eye: (3,) unit direction from what is looked at to the camera.
        points: (P, 3).
        size: width and height, pixels.
        margin: free share of the picture at each side.
    """
    right = np.cross([0.0, 0.0, 1.0], eye)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(eye, right), eye])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    position = middle + 5.0 * np.linalg.norm(points - middle, axis=1).max() * eye
    seen = (points - position) @ axes.T
    flat = seen[:, :2] / -seen[:, 2:]
    low, high = flat.min(axis=0), flat.max(axis=0)
    shape = np.array([1.0, size[1] / size[0]])
    focal = float(((1 - 2 * margin) * shape / (high - low)).min())
    return Camera(position, axes, focal, (low + high) / 2 * focal, size)


def png(picture: np.ndarray) -> bytes:
    """An oversampled picture (rows, columns, 4), RGBA in 0..1, as a PNG file of its final size."""
    n = OVERSAMPLING
    rows, columns = picture.shape[0] // n, picture.shape[1] // n
    blocks = np.clip(picture, 0, 1).reshape(rows, n, columns, n, 4)
    alpha = blocks[..., 3:].mean(axis=(1, 3))
    color = (blocks[..., :3] * blocks[..., 3:]).mean(axis=(1, 3)) / np.maximum(alpha, 1e-9)
    pixels = np.round(255 * np.concatenate([color, alpha], axis=-1)).astype(np.uint8)
    # PNG's filter 1: each pixel less the one to its left.
    filtered = np.concatenate([pixels[:, :1], pixels[:, 1:] - pixels[:, :-1]], axis=1).reshape(rows, -1)
    lines = np.concatenate([np.ones((rows, 1), np.uint8), filtered], axis=1)
    header = struct.pack(">IIBBBBB", columns, rows, 8, 6, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(lines.tobytes())), (b"IEND", b""))
    packed = (struct.pack(">I", len(d)) + kind + d + struct.pack(">I", zlib.crc32(kind + d)) for kind, d in chunks)
    return b"\x89PNG\r\n\x1a\n" + b"".join(packed)
