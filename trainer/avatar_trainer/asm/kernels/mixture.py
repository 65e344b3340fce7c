"""Skinning weights from mixtures in the uv plane: `systems.asm_model.weights` of the rule `normalised`."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numba
import numpy as np
import torch
from torch import Tensor

from avatar_runtime import F32, F64
from avatar_runtime.backends.cpu import kernel
from avatar_trainer.kernels.arrays import plain

CHUNK = 512  # vertices that one thread owns at a time
NOTHING = -40.0  # log of a share that is 0 in float32 beside 1


class Mixtures(NamedTuple):
    """All components of all bones, G = J K of them, a bone's in a row."""

    uv: F32  # [V, 2]
    log_pi: F32  # [G]
    centre: F32  # [G, 2] uv
    scale_tril: F32  # [G, 3] log L_00, log L_11, L_10


def mixture_weights_cpu(
    uv: Tensor,  # [V, 2]
    pi_logit: Tensor,  # [J, K]
    centre: Tensor,  # [J, K, 2] mu + zeta
    scale_tril: Tensor,  # [J, K, 3]
) -> Tensor:
    """W^g [V, J] of ASM Eq. 4 and 6, float32; differentiable in all but uv.

    Raises ValueError for another type or shape, and for a uv with a gradient.
    """
    if uv.requires_grad:
        raise ValueError("mixture_weights_cpu has no gradient for uv; asm_model.weights has")
    values = pi_logit.log_softmax(-1), centre, scale_tril
    weights: Tensor = _Mix.apply(uv, *values)  # type: ignore[no-untyped-call]
    return weights.T


class _Mix(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, uv: Tensor, log_pi: Tensor, centre: Tensor, scale_tril: Tensor) -> Tensor:
        bones, components = log_pi.shape
        count = bones * components
        ctx.mixtures = Mixtures(
            plain(uv, len(uv), 2), plain(log_pi, count), plain(centre, count, 2), plain(scale_tril, count, 3)
        )
        ctx.share = np.empty((count, len(uv)), np.float32)
        ctx.weights = np.empty((bones, len(uv)), np.float32)
        _shares(ctx.mixtures, ctx.share, ctx.weights)
        return torch.from_numpy(ctx.weights)

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor | None, ...]:
        bones, vertices = ctx.weights.shape
        outer = plain(gradients[0], bones, vertices)
        back = np.empty((len(ctx.share), 6))
        _shares_back(ctx.mixtures, ctx.share, ctx.weights, outer, back)
        found = torch.from_numpy(back.reshape(bones, -1, 6)).float()
        return None, found[..., 0], found[..., 1:3], found[..., 3:]


@kernel(parallel=True)
def _shares(mixtures: Mixtures, share: F32, weights: F32) -> None:
    """`share` [G, V] of each component in each vertex, all of a vertex adding up to 1, and `weights` [J, V]."""
    count, vertices = share.shape
    each = count // len(weights)
    for chunk in numba.prange((vertices + CHUNK - 1) // CHUNK):
        first, last = chunk * CHUNK, min((chunk + 1) * CHUNK, vertices)
        top, total = np.full(last - first, -np.inf, np.float32), np.zeros(last - first, np.float32)
        for g in range(count):
            log_a, log_b, c = mixtures.scale_tril[g, 0], mixtures.scale_tril[g, 1], mixtures.scale_tril[g, 2]
            a, b = np.float32(math.exp(-log_a)), np.float32(math.exp(-log_b))
            x0, y0, most = mixtures.centre[g, 0], mixtures.centre[g, 1], mixtures.log_pi[g] - log_a - log_b
            for v in range(first, last):
                x = (mixtures.uv[v, 0] - x0) * a
                y = (mixtures.uv[v, 1] - y0 - c * x) * b
                log_density = most - np.float32(0.5) * (x * x + y * y)
                share[g, v] = log_density
                top[v - first] = max(top[v - first], log_density)
        for g in range(count):
            for v in range(first, last):
                below = share[g, v] - top[v - first]
                share[g, v] = np.float32(math.exp(below)) if below > NOTHING else np.float32(0)
                total[v - first] += share[g, v]
        for j in range(len(weights)):
            weights[j, first:last] = 0
            for g in range(j * each, (j + 1) * each):
                for v in range(first, last):
                    share[g, v] /= total[v - first]
                    weights[j, v] += share[g, v]


@kernel(parallel=True)
def _shares_back(mixtures: Mixtures, share: F32, weights: F32, outer: F32, back: F64) -> None:
    """From the gradient `outer` [J, V] of the weights that of log_pi, centre and scale_tril, `back` [G, 6]."""
    count, vertices = share.shape
    each = count // len(weights)
    mean = np.zeros(vertices, np.float32)
    for chunk in numba.prange((vertices + CHUNK - 1) // CHUNK):
        for j in range(len(weights)):
            for v in range(chunk * CHUNK, min((chunk + 1) * CHUNK, vertices)):
                mean[v] += outer[j, v] * weights[j, v]
    for g in numba.prange(count):
        log_a, log_b, c = mixtures.scale_tril[g, 0], mixtures.scale_tril[g, 1], mixtures.scale_tril[g, 2]
        a, b = np.float32(math.exp(-log_a)), np.float32(math.exp(-log_b))
        x0, y0 = mixtures.centre[g, 0], mixtures.centre[g, 1]
        pi, to_x, to_y, to_a, to_b, to_c = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for v in range(vertices):
            if share[g, v] == 0:
                continue
            pull = share[g, v] * (outer[g // each, v] - mean[v])
            x = (mixtures.uv[v, 0] - x0) * a
            y = (mixtures.uv[v, 1] - y0 - c * x) * b
            along = x - y * c * b
            pi += pull
            to_x += pull * along * a
            to_y += pull * y * b
            to_a += pull * (along * x - 1)
            to_b += pull * (y * y - 1)
            to_c += pull * x * y * b
        back[g, 0], back[g, 1], back[g, 2] = pi, to_x, to_y
        back[g, 3], back[g, 4], back[g, 5] = to_a, to_b, to_c
