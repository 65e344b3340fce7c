"""Overlays of a capture: its images with the tracked mesh and the edge of the mask drawn over them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from avatar_export import images
from avatar_runtime import AvatarError, Camera, posed_mesh
from avatar_runtime.stages import joints
from avatar_trainer.captures import targets
from avatar_trainer.captures.mesh_raster import Surface, draw, intrinsics
from avatar_trainer.captures.model import Capture, Frame

COUNT = 12  # overlays, evenly spaced
LARGEST = 1024  # pixels of the longer side
SHEET, COLUMNS, CELL = "sheet.png", 4, 320  # all of them beside each other, pixels of the longer side of each
MESH, EDGE = np.array([0.25, 0.55, 1.0], np.float32), np.array([0.1, 1.0, 0.2], np.float32)
VEIL = 0.55  # of the mesh over the image
DARKEST = 0.25  # of the mesh where it is seen edge-on


def expect_place(folder: Path) -> None:
    """Raise AvatarError if `folder` is a file or holds something."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise AvatarError("exists; name a new or an empty folder", file=folder, field="--pictures")


def write(capture: Capture, folder: Path) -> int:
    """NAME.png in `folder` for at most COUNT frames, and SHEET with all of them; their number.

    Raises AvatarError if they cannot be written.
    """
    frames = targets.evenly(targets.resized(capture, LARGEST).frames, COUNT)
    drawn = {f"{frame.name}.png": overlay(capture, frame) for frame in frames}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, pixels in {SHEET: sheet(list(drawn.values())), **drawn}.items():
            (folder / name).write_bytes(images.png(pixels))
    except OSError as error:
        raise AvatarError(f"cannot be written ({error.strerror or error})", file=folder) from None
    return len(frames)


def sheet(pictures: Sequence[npt.NDArray[np.uint8]]) -> npt.NDArray[np.uint8]:
    """Pictures of one size in rows of COLUMNS, made smaller, over black."""
    height, width = pictures[0].shape[:2]
    scale = min(1.0, CELL / max(height, width))
    cell = max(round(width * scale), 1), max(round(height * scale), 1)
    rows = -(-len(pictures) // COLUMNS)
    whole = Image.new("RGB", (cell[0] * min(len(pictures), COLUMNS), cell[1] * rows))
    for index, picture in enumerate(pictures):
        small = Image.fromarray(picture).resize(cell, Image.Resampling.BOX)
        whole.paste(small, (index % COLUMNS * cell[0], index // COLUMNS * cell[1]))
    return np.asarray(whole)


def overlay(capture: Capture, frame: Frame) -> npt.NDArray[np.uint8]:
    """[H, W, 3] at the size of the frame's camera: the mesh in blue, the edge of the mask in green."""
    target = targets.read(frame)
    image, mask = target.image.numpy(), target.mask.numpy() > 0.5
    mesh = draw(_shaded(capture, frame), _without_skew(frame.camera), samples=1)
    veil = VEIL * mesh.alpha[:, :, None]
    drawn = image * (1 - veil) + mesh.colour * veil
    drawn[_edge(mask)] = EDGE
    pixels: npt.NDArray[np.uint8] = np.rint(np.clip(drawn, 0, 1) * 255).astype(np.uint8)
    return pixels


def _shaded(capture: Capture, frame: Frame) -> Surface:
    """The posed mesh in world space, brighter where it faces the camera."""
    rig, pose = capture.rig, frame.pose
    vertices = posed_mesh(rig, pose, joints.joints(rig, pose)).astype(np.float64)
    vertices = vertices @ pose.world_from_avatar[:3, :3].T + pose.world_from_avatar[:3, 3]
    triangles = rig.triangles.astype(np.int64)
    normal = np.zeros_like(vertices)
    corner = vertices[triangles]
    of_triangle = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    for index in range(3):
        np.add.at(normal, triangles[:, index], of_triangle)
    away = frame.camera.centre.astype(np.float64) - vertices
    size = np.linalg.norm(normal, axis=1) * np.linalg.norm(away, axis=1)
    facing = np.abs(np.einsum("vx,vx->v", normal, away)) / np.maximum(size, 1e-20)
    count = len(vertices)
    return Surface(
        vertices,
        triangles,
        np.full((len(triangles), 3, 2), 0.5, np.float32),
        np.tile(MESH, (2, 2, 1)),
        (DARKEST + (1 - DARKEST) * facing).astype(np.float32),
        np.zeros(count, np.float32),
        np.ones(count, np.float32),
    )


def _without_skew(camera: Camera) -> Camera:
    """The same image by a camera without skew, whose space is sheared instead."""
    k = intrinsics(camera)
    shear = np.eye(4)
    shear[0, 1] = k[0, 1] / k[0, 0]
    projection = camera.clip_from_world.astype(np.float64) @ np.linalg.inv(
        camera.camera_from_world.astype(np.float64)
    )
    projection[0, 1] = 0
    view = (shear @ camera.camera_from_world).astype(np.float32)
    return replace(camera, camera_from_world=view, clip_from_world=(projection @ view).astype(np.float32))


def _edge(mask: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """The pixels of a mask that have a neighbour outside it."""
    inner = mask.copy()
    for axis in (0, 1):
        for step in (1, -1):
            inner &= np.roll(mask, step, axis=axis)
    result: npt.NDArray[np.bool_] = mask & ~inner
    return result
