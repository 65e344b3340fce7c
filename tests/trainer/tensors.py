"""Small inputs of the trainer's stages as tensors, from the avatars of the other tests, and gradients of scalars."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from avatar_runtime import avatar as runtime
from avatar_runtime.clips import frame_pose
from avatar_runtime.pose import PoseArrays, resolve
from avatar_trainer.stages.blend import Deltas
from avatar_trainer.tensors import Gaussians

ATTRIBUTES = ("mean", "log_scale", "quat_wxyz", "opacity_logit", "sh")


def tensor(array: npt.NDArray[Any], dtype: torch.dtype = torch.float32) -> Tensor:
    return torch.from_numpy(np.array(array)).to(dtype)


def gaussians(source: runtime.Gaussians, dtype: torch.dtype = torch.float32) -> Gaussians:
    return Gaussians(**{name: tensor(getattr(source, name), dtype) for name in ATTRIBUTES})


def dense(sparse: runtime.SparseRows, attribute: str) -> npt.NDArray[np.float32]:
    """[R, columns, ...], entry by entry."""
    values = sparse.values[attribute]
    result = np.zeros((sparse.rows, sparse.columns, *values.shape[1:]), np.float32)
    for row in range(sparse.rows):
        for entry in range(sparse.row_ptr[row], sparse.row_ptr[row + 1]):
            result[row, sparse.column[entry]] = values[entry]
    return result


def deltas(shapes: runtime.Blendshapes, dtype: torch.dtype = torch.float32) -> Deltas:
    """Both patterns of an avatar in one."""
    full = {name: dense(shapes.geometry, name) for name in ("mean", "quat_wxyz")}
    full |= {name: dense(shapes.appearance, name) for name in ("log_scale", "opacity_logit", "sh")}
    used = np.stack([(v != 0).reshape(*v.shape[:2], -1).any(axis=2) for v in full.values()]).any(axis=0)
    ptr = np.concatenate([[0], np.cumsum(used.sum(axis=1))])
    values = {name: tensor(v[used], dtype) for name, v in full.items()}
    return Deltas(tensor(ptr, torch.int64), tensor(np.nonzero(used)[1], torch.int64), **values)


def poses(avatar: runtime.Avatar) -> list[PoseArrays]:
    """Every frame of the avatar's clips."""
    return [resolve(frame_pose(avatar, clip, t), avatar) for clip in avatar.clips for t in range(clip.frames)]


def normal(seed: int, *shape: int, dtype: torch.dtype = torch.float64) -> Tensor:
    generator = torch.Generator().manual_seed(seed)
    return torch.randn(shape, generator=generator, dtype=torch.float64).to(dtype)


def leaves(tensors: Iterable[Tensor], dtype: torch.dtype = torch.float64) -> tuple[Tensor, ...]:
    """Copies that take a gradient."""
    return tuple(t.detach().to(dtype).clone().requires_grad_() for t in tensors)


def gradients(run: Callable[..., Mapping[str, Tensor]], inputs: tuple[Tensor, ...]) -> list[Tensor]:
    """Of a fixed random projection of all outputs, by each input; float64."""
    outputs = run(*inputs)
    total = sum(
        (value.double() * normal(at, *value.shape)).sum() for at, value in enumerate(outputs.values())
    )
    assert isinstance(total, Tensor)
    return [g.double() for g in torch.autograd.grad(total, inputs)]


def relative(value: Tensor, expected: Tensor) -> float:
    """The largest difference, as a part of the largest value expected."""
    wanted = expected.detach().double()
    return float((value.detach() - wanted).abs().max() / wanted.abs().max().clamp_min(1e-30))


def largest(value: Tensor, expected: npt.NDArray[Any]) -> float:
    """The largest absolute difference."""
    return float(np.abs(value.detach().numpy() - expected).max(initial=0))


def same(a: Any, b: Any) -> bool:
    """Whether two states are the same: types, keys in their order, and every bit of tensors."""
    if isinstance(a, Tensor):
        return isinstance(b, Tensor) and a.dtype == b.dtype and torch.equal(a, b)
    if isinstance(a, dict):
        return type(b) is type(a) and list(a) == list(b) and all(same(a[k], b[k]) for k in a)
    if isinstance(a, list):
        return isinstance(b, list) and len(a) == len(b) and all(map(same, a, b))
    return type(a) is type(b) and a == b
