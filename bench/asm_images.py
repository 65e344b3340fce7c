"""Targets of meshes in grey and in the colours of an error, for contact sheets."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from avatar_runtime.avatar import F32, F64, I64
from avatar_runtime.camera import Camera
from avatar_trainer.captures.mesh_raster import Surface, draw
from avatar_trainer.normals import vertex_normals

AWAY, LENS = 0.9, 4.2  # metres from the face; focal length in heights of an image
GREY = np.full((1, 1, 3), 0.8, np.float32)
RAMP = np.array([[[0.15, 0.25, 0.6], [0.2, 0.7, 0.55], [0.95, 0.9, 0.25], [0.85, 0.15, 0.1]]], np.float32)


def face_camera(middle: F64, size: int) -> Camera:
    """A camera in front of a face, +Z towards it, +Y up."""
    rotation = np.diag([1.0, -1.0, -1.0])
    focal = LENS * size
    k = np.array([[focal, 0, size / 2], [0, focal, size / 2], [0, 0, 1]])
    place = middle + np.array([0, 0, AWAY])
    return Camera.from_opencv(rotation, -rotation @ place, k, size, size)


def grey(vertices: F64, triangles: I64, camera: Camera) -> F32:
    """A mesh under a light from the upper left, [H, W, 3]."""
    uv = np.zeros((len(triangles), 3, 2), np.float32)
    return _drawn(vertices, triangles, uv, GREY, camera)


def errors(vertices: F64, triangles: I64, error: F64, most: float, camera: Camera) -> F32:
    """A mesh coloured by `error` [V], from blue at 0 to red at `most`."""
    across = np.clip(error / most, 0, 1) * 0.75 + 0.125  # centres of the ramp's four colours
    uv = np.stack([across[triangles], np.full(triangles.shape, 0.5)], axis=2).astype(np.float32)
    return _drawn(vertices, triangles, uv, RAMP, camera)


def save_sheet(rows: list[list[F32]], path: Path) -> None:
    """Targets of one size in rows and columns, as PNG."""
    sheet = np.concatenate([np.concatenate(row, axis=1) for row in rows], axis=0)
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.round(np.clip(sheet, 0, 1) * 255).astype(np.uint8)).save(path)


def _drawn(vertices: F64, triangles: I64, uv: F32, texture: F32, camera: Camera) -> F32:
    light = np.array([-0.4, 0.5, 0.77])
    gain = (0.25 + 0.75 * np.clip(vertex_normals(vertices, triangles) @ light, 0, 1)).astype(np.float32)
    none, all_of_it = np.zeros(len(vertices), np.float32), np.ones(len(vertices), np.float32)
    image = draw(Surface(vertices, triangles, uv, texture, gain, none, all_of_it), camera)
    shown: F32 = image.colour * image.alpha[..., None] + (1 - image.alpha[..., None])
    return shown
