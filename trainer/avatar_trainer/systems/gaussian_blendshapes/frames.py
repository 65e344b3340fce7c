"""Visible triangles of the mesh, and colours of the first Gaussians, from the frames."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt
import torch

from avatar_runtime import F32, F64, I64, Camera, PoseArrays, posed_mesh
from avatar_runtime.stages import joints
from avatar_trainer.captures.model import Capture, Frame
from avatar_trainer.captures.targets import Target, Targets, evenly
from avatar_trainer.kernels.neighbours import nearest_others
from avatar_trainer.tensors import Splats

FRAMES = 24  # of the training frames, evenly chosen
CELL = 4  # pixels: the nearest Gaussian in such a square hides what lies behind it
SLOPE = 1.5  # a Gaussian as far behind it as the square is wide, times this, still counts as visible
INSIDE = 0.5  # of the mask
GREY = 0.5
BESIDE = 8  # points whose mean colour one gets that no frame shows


def seen_triangles(capture: Capture) -> npt.NDArray[np.bool_]:
    """[F] whether some training frames show a corner of each triangle of the body mesh."""
    rig = capture.rig
    seen: npt.NDArray[np.bool_] = np.zeros(len(rig.vertices), bool)
    for frame, target in _chosen(capture):
        vertices = posed_mesh(rig, frame.pose, joints.joints(rig, frame.pose))
        world = frame.pose.world_from_avatar.astype(np.float32)
        position = vertices @ world[:3, :3].T + world[:3, 3]
        seen[np.flatnonzero(np.isfinite(_looked_up(position, frame.camera, target)[:, 0]))] = True
    result: npt.NDArray[np.bool_] = np.any(seen[rig.triangles], axis=1)
    return result


def frame_colours(capture: Capture, splats: Callable[[PoseArrays], Splats]) -> F32:
    """[N, 3] display-referred: the median of the pixels that show each Gaussian in some training frames.

    `splats`: the avatar in a frame's pose. Gaussians that no frame shows get the colours of those beside them, grey
    without any. 3D Gaussian Splatting begins with the colours of its points, Gaussian Blendshapes with grey: the
    frames' own save some hundred iterations.
    """
    with torch.no_grad():
        found = [
            _looked_up(splats(frame.pose).mean.numpy(), frame.camera, target)
            for frame, target in _chosen(capture)
        ]
        position = splats(capture.train[0].pose).mean.double().numpy()
    return _spread(_median(np.stack(found)), position)


def _chosen(capture: Capture) -> Iterator[tuple[Frame, Target]]:
    with Targets(0) as targets:
        for frame in evenly(capture.train, FRAMES):
            yield frame, targets(frame)


def _looked_up(position: F32, camera: Camera, target: Target) -> F32:
    """[N, 3] the pixel under each position [N, 3], NaN where it is hidden, outside or not of the person."""
    points = np.concatenate([position, np.ones_like(position[:, :1])], axis=1)
    clip, depth = points @ camera.clip_from_world.T, points @ camera.camera_from_world[2]
    colour: F32 = np.full((len(position), 3), np.nan, np.float32)
    front = np.flatnonzero(depth > 0)
    size = np.array([camera.width, camera.height])
    ndc = clip[front, :2] / clip[front, 3:]
    pixel: I64 = np.floor(np.clip((ndc + 1) / 2 * size, -1, size)).astype(np.int64)
    inside = ((pixel >= 0) & (pixel < size)).all(axis=1)
    front, pixel = front[inside], pixel[inside]
    visible = _nearest(pixel, depth[front], camera)
    front, (x, y) = front[visible], pixel[visible].T
    of_person = target.mask.numpy()[y, x] > INSIDE
    colour[front[of_person]] = target.image.numpy()[y, x][of_person]
    return colour


def _nearest(pixel: I64, depth: F32, camera: Camera) -> npt.NDArray[np.bool_]:
    """Which of the points are not hidden by a nearer one in the same square of CELL pixels."""
    columns = camera.width // CELL + 1
    cell = pixel[:, 1] // CELL * columns + pixel[:, 0] // CELL
    nearest = np.full(columns * (camera.height // CELL + 1), np.inf)
    np.minimum.at(nearest, cell, depth)
    width = CELL * 2 * camera.tan_half_fov_x / camera.width  # of the square, at depth 1
    result: npt.NDArray[np.bool_] = depth <= nearest[cell] * (1 + SLOPE * width)
    return result


def _median(seen: F32) -> F32:
    """[N, 3] medians over frames [T, N, 3] that leave NaN out; NaN where there is nothing else."""
    ordered = np.sort(seen, axis=0)  # NaN last
    count = np.isfinite(seen[:, :, 0]).sum(axis=0)
    middle = np.take_along_axis(ordered, (np.maximum(count, 1) - 1)[None, :, None] // 2, axis=0)[0]
    result: F32 = np.where(count[:, None] > 0, middle, np.float32(np.nan))
    return result


def _spread(colour: F32, position: F64) -> F32:
    """Colours [N, 3] of points [N, 3] of which those that are NaN become the mean of their neighbours, step by step."""
    result, near = colour.copy(), nearest_others(position, BESIDE)
    known = np.isfinite(result[:, 0])
    while not known.all():
        count = known[near].sum(axis=1)
        rows = np.flatnonzero(~known & (count > 0))
        if not len(rows):
            result[~known] = GREY
            break
        result[rows] = np.nansum(result[near[rows]], axis=1) / count[rows, None]
        known[rows] = True
    return result
