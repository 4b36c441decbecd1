from __future__ import annotations

import struct
import zlib

import numpy as np
import pytest
from camera import OVERSAMPLING, Camera, look, png
from raycast import Capsule, Disc, draw

from casadi_hands.geometry.bodies import capsule as bodies

GREY = (0.5, 0.5, 0.5)
EYE = np.array([0.6, -0.64, 0.48])


def camera_at(points: np.ndarray) -> Camera:
    return look(EYE, points, (60, 40))


def test_capsule_is_met_where_its_distance_is_zero() -> None:
    start, end, radius = np.array([-0.03, 0.01, 0.02]), np.array([0.05, -0.02, 0.0]), 0.015
    capsule = bodies.Capsule(start, end, radius)
    camera = camera_at(np.array([start, end]))
    _, distance = draw(camera, [Capsule(start, end, radius, GREY)])
    rays = camera.rays
    # Marching by the distance to the surface never passes through it.
    for row, column in np.random.default_rng(0).integers(0, distance.shape, (150, 2)):
        met, ray = 0.0, rays[row, column]
        for _ in range(400):
            met += capsule.signed_distance(camera.position + met * ray)
        hit = met < 10.0
        assert hit == (distance[row, column] < 10.0)
        if hit:
            assert distance[row, column] == pytest.approx(met, abs=1e-4)
    assert 0.1 < (distance < 10.0).mean() < 0.9


def test_sphere_covers_its_solid_angle() -> None:
    center, radius = np.array([0.2, 0.1, 0.3]), 0.05
    camera = camera_at(center + 1.5 * radius * np.vstack([np.eye(3), -np.eye(3)]))
    _, distance = draw(camera, [Capsule(center, center, radius, GREY)])
    away = np.linalg.norm(camera.position - center)
    tangent = np.tan(np.arcsin(radius / away)) * camera.focal * OVERSAMPLING * 60
    # The picture of a sphere beside the picture's middle is an ellipse; here it is in the middle.
    assert (distance < 10).sum() == pytest.approx(np.pi * tangent**2, rel=0.01)
    assert distance.min() == pytest.approx(away - radius, rel=1e-3)


def test_disc_is_met_on_face_rim_and_back() -> None:
    pose = np.eye(4)
    for eye, expected in (((0, 0.01, 1.0), 0.0), ((0, 0.01, -1.0), 0.01), ((1.0, 0, 0.001), 0.05)):
        direction = np.array(eye) / np.linalg.norm(eye)
        camera = look(direction, 0.06 * np.vstack([np.eye(3), -np.eye(3)]), (20, 20))
        _, distance = draw(camera, [Disc(pose, 0.05, 0.01, GREY)])
        assert distance.min() == pytest.approx(np.linalg.norm(camera.position) - expected, abs=1.5e-3)


def test_everything_asked_for_is_in_the_picture() -> None:
    points = np.random.default_rng(1).normal(size=(40, 3))
    camera = camera_at(points)
    balls = [Capsule(point, point, 0.1, GREY) for point in points]
    for ball in balls:
        _, distance = draw(camera, [ball])
        seen = distance < 1e6
        assert seen.any()
        assert not np.concatenate([seen[0], seen[-1], seen[:, 0], seen[:, -1]]).any()


def test_shadow_falls_on_the_ground_only_where_there_is_one() -> None:
    ball = Capsule(np.array([0, 0, 0.1]), np.array([0, 0, 0.1]), 0.03, GREY)
    camera = camera_at(np.array([[-0.2, -0.2, 0], [0.2, 0.2, 0.2]]))
    clear, distance = draw(camera, [ball])
    with_ground, _ = draw(camera, [ball], 0.0)
    beside = distance > 1e6
    assert not clear[beside, 3].any()
    assert with_ground[beside, 3].max() > 0.25
    assert with_ground[beside][with_ground[beside, 3] > 0.2][:, 0].min() < 0.5


def test_png_holds_the_picture() -> None:
    picture = np.random.default_rng(2).uniform(size=(6, 8, 4)).repeat(OVERSAMPLING, 0).repeat(OVERSAMPLING, 1)
    data = png(picture)
    chunks, place = {}, 8
    while place < len(data):
        (length,) = struct.unpack(">I", data[place : place + 4])
        kind, body = data[place + 4 : place + 8], data[place + 8 : place + 8 + length]
        assert struct.unpack(">I", data[place + 8 + length : place + 12 + length])[0] == zlib.crc32(kind + body)
        chunks[kind], place = body, place + 12 + length
    assert struct.unpack(">IIBB", chunks[b"IHDR"][:10]) == (8, 6, 8, 6)
    lines = np.frombuffer(zlib.decompress(chunks[b"IDAT"]), np.uint8).reshape(6, 1 + 8 * 4)
    assert (lines[:, 0] == 1).all()
    pixels = np.cumsum(lines[:, 1:].reshape(6, 8, 4), axis=1, dtype=np.uint8)
    expected = picture[::OVERSAMPLING, ::OVERSAMPLING]
    assert np.abs(pixels / 255 - expected).max() < 0.5 / 255 + 1e-9
