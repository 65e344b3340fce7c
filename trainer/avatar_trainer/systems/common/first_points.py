"""The first Gaussians of SplattingAvatar: random points of the canonical mesh, sized by their neighbours.

Source: SplattingAvatar (arXiv 2403.05087) section 3, "Embedding on mesh"; 3DGS for opacity and scale. Colours are
the frames' (setting `init_colour`): the papers' random or grey ones give the same after some hundred steps.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from avatar_runtime import F32, F64, I64, Camera
from avatar_trainer.systems.common.poisson import neighbour_distance

NEIGHBOURS = 3  # whose mean squared distance is the first variance, as in 3DGS
LEAST_SCALE = 1e-7  # training units, as in 3DGS
CHUNK = 1024  # points whose distances to all others are held at once
SEARCHED = 20_000  # from this number of points on, neighbours are found by a search, not from all distances
GREY = 0.5
INIT_COLOURS = ("frames", "grey")
FACING = 0.2  # least cosine between normal and view for taking a colour: at the silhouette, pixels belong to others


@dataclass(frozen=True)
class View:
    """A frame and its points in that pose, metres."""

    image: Tensor  # [H, W, 3] 0..1
    mask: Tensor  # [H, W] 0..1
    camera: Camera
    point: Tensor  # [N, 3] world
    normal: Tensor  # [N, 3] world


def sampled(
    triangles: npt.NDArray[np.integer],
    vertices: F32,
    count: int,
    how: str,
    density: F64,
    rng: np.random.Generator,
) -> tuple[I64, F64]:
    """(triangle [count], barycentric [count, 3]) at random, uniform within a triangle.

    `how`: `uniform`, every triangle alike, as in the paper, which puts most points where the mesh is finest; `area`, by
    area; times `density` [F] (`detail`). Triangles without area get none. Raises ValueError if no triangle has an area.
    """
    corner = vertices.astype(np.float64)[triangles]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    chance = SAMPLING[how](area) * density
    if not chance.sum() > 0:
        raise ValueError("no triangle of the mesh has an area")
    triangle = rng.choice(len(triangles), count, p=chance / chance.sum())
    u, v = rng.random((2, count))
    root = np.sqrt(u)
    return triangle, np.stack([1 - root, root * (1 - v), root * v], axis=1)


SAMPLING: dict[str, Callable[[F64], F64]] = {
    "uniform": lambda area: (area > 0).astype(np.float64),
    "area": lambda area: area,
}


def neighbour_scale(points: Tensor) -> Tensor:
    """[N] the root of the mean squared distance of each point [N, 3] to its three nearest others."""
    if len(points) >= SEARCHED:
        found = neighbour_distance(points.double().numpy())
        return torch.from_numpy(found).to(points.dtype).clamp_min(LEAST_SCALE)
    near = min(NEIGHBOURS + 1, len(points))
    squared = []
    for part in torch.split(points, CHUNK):
        apart = torch.cdist(part, points, compute_mode="donot_use_mm_for_euclid_dist")
        squared.append(apart.topk(near, largest=False).values.square())
    mean = torch.cat(squared).sum(1) / max(near - 1, 1)  # the nearest is the point itself
    return mean.sqrt().clamp_min(LEAST_SCALE)


def colours(views: Sequence[View], count: int) -> Tensor:
    """[count, 3] colours of the points in the frames, weighted by the cosine of the viewing angle.

    Points that no frame shows get the mean of the others; without frames, grey. Occlusion is not tested: this is only a
    first guess.
    """
    total, weight = torch.zeros(count, 3), torch.zeros(count, 1)
    for view in views:
        colour, seen = _looked_up(view)
        total += seen * colour
        weight += seen
    known = weight[:, 0] > 0
    if not known.any():
        return torch.full((count, 3), GREY)
    mean = total / weight.clamp_min(1e-6)
    return torch.where(known[:, None], mean, mean[known].mean(0))


def _looked_up(view: View) -> tuple[Tensor, Tensor]:
    """(colour [N, 3] of the pixel that each point lies on, weight [N, 1] 0 where it is not seen)."""
    world, clip = (torch.from_numpy(m) for m in (view.camera.camera_from_world, view.camera.clip_from_world))
    in_camera = view.point @ world[:3, :3].T + world[:3, 3]
    in_clip = view.point @ clip[:, :3].T + clip[:, 3]
    height, width = view.mask.shape
    ndc = in_clip[:, :2] / in_clip[:, 3:].clamp_min(1e-6)
    column, row = (((ndc + 1) * torch.tensor([width, height]) - 1) / 2).round().long().unbind(1)
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height) & (in_camera[:, 2] > 0)
    column, row = column.clamp(0, width - 1), row.clamp(0, height - 1)
    towards = -torch.nn.functional.normalize(in_camera, dim=1)
    cosine = ((view.normal @ world[:3, :3].T) * towards).sum(1)
    weight = torch.where(inside & (cosine > FACING), cosine * view.mask[row, column], 0)
    return view.image[row, column], weight[:, None]
