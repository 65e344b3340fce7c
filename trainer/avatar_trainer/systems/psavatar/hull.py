"""Where points off the mesh can be seen at all: outside the mesh, and nowhere before the background of the images."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from avatar_runtime import F32, I64, Camera, Rig
from avatar_trainer.captures.mesh_raster import depth_of
from avatar_trainer.captures.model import Capture, Frame
from avatar_trainer.captures.targets import evenly, read
from avatar_trainer.kernels.mesh import kernel_mesh
from avatar_trainer.kernels.mesh_points import Placed, mesh_points_cpu, placed
from avatar_trainer.stages.skin import transform
from avatar_trainer.stages.surface import surface_mesh
from avatar_trainer.systems.psavatar.mesh import body_of

Mask = npt.NDArray[np.bool_]
LOOKED_AT = 128  # frames at most
OUTSIDE = 0.03  # share of the frames that may show a point before the background: masks and tracking err
BEFORE_MESH = 0.1  # share of the frames, at least, in which the mesh does not hide a point
ROUNDS = (
    4  # after each, with every fourth frame, places are left out that cannot come back or that none has shown
)
COVERED = 0.5  # mask of a pixel that shows the person


def seen(capture: Capture, training_per_metre: float, triangle: I64, barycentric: F32, distance: F32) -> Mask:
    """[M] whether the training frames can show something in these places [M] of the mesh.

    `distance` [M] metres along the normals. A place is left out if more than OUTSIDE of the frames show the background
    there, or if in less than BEFORE_MESH of them it is in the image and not behind the mesh. Pixels beside one of the
    person count as his.
    """
    rig, frames = capture.rig, evenly(capture.train, LOOKED_AT)
    mesh = kernel_mesh(surface_mesh(rig.vertices, rig.triangles, training_per_metre))
    outside, before = np.zeros((2, len(triangle)), np.int64)
    kept = np.arange(len(triangle))
    for first in range(ROUNDS):
        at = placed(mesh, torch.from_numpy(triangle[kept]), torch.from_numpy(barycentric[kept]))
        raised = torch.from_numpy(distance[kept])
        for frame in frames[first::ROUNDS]:
            shows_nothing, shows = _shown(rig, frame, at, raised)
            outside[kept] += shows_nothing
            before[kept] += shows
        kept = kept[(outside[kept] <= OUTSIDE * len(frames)) & (before[kept] > 0)]
    result = np.zeros(len(triangle), bool)
    result[kept] = before[kept] >= BEFORE_MESH * len(frames)
    return result


def _shown(rig: Rig, frame: Frame, at: Placed, raised: Tensor) -> tuple[Mask, Mask]:
    """Whether a frame shows the background at points, and whether it shows the person there before the mesh."""
    body = body_of(rig, frame.pose)
    world = torch.from_numpy(frame.pose.world_from_avatar.astype(np.float32))[:3]
    vertices = transform(body.matrix, body.unposed)
    point = transform(world, mesh_points_cpu(vertices, raised, at))
    triangles = rig.triangles.astype(np.int64)
    hiding = depth_of(transform(world, vertices).double().numpy(), triangles, frame.camera)
    row, column, depth, inside = _pixels(point, frame.camera)
    person = _widened(read(frame).mask >= COVERED)[row, column]
    shows = inside & person & (depth <= torch.from_numpy(hiding)[row, column])
    return (inside & ~person).numpy(), shows.numpy()


def _widened(person: Tensor) -> Tensor:
    return torch.nn.functional.max_pool2d(person[None].float(), 3, stride=1, padding=1)[0] > 0


def _pixels(point: Tensor, camera: Camera) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """(row [M], column [M], camera z [M], whether it is in the image [M]) of world points [M, 3]."""
    view, clip = (torch.from_numpy(m) for m in (camera.camera_from_world, camera.clip_from_world))
    depth = point @ view[2, :3] + view[2, 3]
    on_screen = point @ clip[:, :3].T + clip[:, 3]
    ndc = on_screen[:, :2] / on_screen[:, 3:].clamp_min(1e-6)
    size = torch.tensor([camera.width, camera.height])
    column, row = (((ndc + 1) * size - 1) / 2).round().long().unbind(1)
    inside = (column >= 0) & (column < camera.width) & (row >= 0) & (row < camera.height) & (depth > 0)
    return row.clamp(0, camera.height - 1), column.clamp(0, camera.width - 1), depth, inside
