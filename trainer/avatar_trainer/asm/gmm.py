"""Mixtures in the uv plane fitted to skinning weights: the first values of ASM's parameters pi, mu and Sigma.

Source: ASM (arXiv 2304.09423) section 3.3. Expectation maximisation, bone by bone, over the vertices. Each mixture
holds one unit of mass (Eq. 4), however wide its bone is. So it is fitted to w_j S instead of the bone's weights w_j,
where S(v) > 0, the sum in Eq. 6, is chosen such that w_j S holds about one unit for every bone. Some steps of Adam
on the divergence of W^g (Eq. 6) from the weights then remove most of the remaining error. Deterministic.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import torch

from avatar_export.asm import Binding
from avatar_runtime import F64
from avatar_trainer.asm.kernels.mixture import mixture_weights_cpu
from avatar_trainer.asm.model import Face

ROUNDS = 60  # of expectation maximisation
SHARES = 200  # rounds in which S is found
LEAST_DEVIATION = 0.004  # of a mixture's component, uv
NOTHING = 1e-6  # of the plane's mass of weights; a bone with less moves nothing
IDLE_DEVIATION = 1.0  # of bones that move nothing: so thin everywhere that they hardly count in Eq. 6
LEAST_PI = 1e-3
POLISHED = 200  # steps of Adam
STEP = 0.03  # of Adam: of logarithms, and in deviations of the component's for centres
FAINT = 1e-4  # smaller weights count as 0 in the divergence

Array = npt.NDArray[Any]


@dataclass(frozen=True)
class Misfit:
    """How far W^g of a binding is from the weights that it was fitted to."""

    mean: float  # over vertices and area, of half the sum of |W^g - w| over bones: the share of weight misplaced
    worst: float  # over vertices, of the same
    idle: tuple[int, ...]  # bones that move nothing


def fit(uv: Array, area: Array, weights: Array, zeta: Array, components: int) -> Binding:
    """Mixtures of `components` for each bone.

    uv [V, 2]; area [V] how much of the plane a vertex stands for; weights [V, J] adding up to 1; zeta [J, 2].
    Bones without weight get one wide component about zeta. Raises ValueError for components < 1.
    """
    if components < 1:
        raise ValueError(f"components {components} must be at least 1")
    place, area, share = (a.astype(np.float64) for a in (uv, area / area.sum(), weights))
    mass = share * (area * _common_sum(area, share))[:, None]
    joints = share.shape[1]
    pi = np.full((joints, components), 1 / components)
    mu = np.zeros((joints, components, 2))
    covariance = np.zeros((joints, components, 3))
    covariance[..., (0, 2)] = IDLE_DEVIATION**2
    for j in range(joints):
        held = mass[:, j] > 0
        if not _moves(area, share[:, j]):
            continue
        found = _mixture(place[held], mass[held, j] / mass[held, j].sum(), components)
        pi[j], mu[j], covariance[j] = found[0], found[1] - zeta[j], found[2]
    return Binding(np.array(zeta, np.float64), pi, mu, covariance)


def polish(binding: Binding, uv: Array, area: Array, weights: Array, steps: int = POLISHED) -> Binding:
    """A binding of the same bones whose W^g is nearer to `weights` [V, J]; arguments as of `fit`. Runs in float32."""
    start = Face.of(binding)
    shift = torch.zeros_like(start.mu, requires_grad=True)  # in deviations
    pi = start.pi_logit.clone().requires_grad_()
    tril = start.scale_tril.clone().requires_grad_()
    deviation = start.scale_tril[..., :2].exp()
    place, wanted = (torch.from_numpy(np.ascontiguousarray(a, np.float32)) for a in (uv, weights))
    share = torch.from_numpy((area / area.sum()).astype(np.float32))
    optimiser = torch.optim.Adam([shift, pi, tril], lr=STEP)
    decay = torch.optim.lr_scheduler.LambdaLR(optimiser, lambda i: 0.1 ** (i / max(steps, 1)))
    for _ in range(steps):
        mu = start.mu + shift * deviation
        found = mixture_weights_cpu(place, pi, mu + start.zeta[:, None], tril)
        loss = -(share * (wanted * (found + FAINT).log()).sum(1)).sum()
        optimiser.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        optimiser.step()
        decay.step()
        with torch.no_grad():
            tril[..., :2].clamp_(min=float(np.log(LEAST_DEVIATION)))
    with torch.no_grad():
        mu = start.mu + shift * deviation
    polished = Face(start.zeta, pi.detach(), mu, tril.detach(), *(start.translation,) * 3).binding()
    floor = np.maximum(polished.pi, LEAST_PI)
    return Binding(binding.zeta, floor / floor.sum(axis=1, keepdims=True), polished.mu, polished.covariance)


def misfit(area: Array, weights: Array, fitted: Array) -> Misfit:
    """The error of `fitted` W^g [V, J] against `weights` [V, J]."""
    apart = 0.5 * np.abs(fitted - weights).sum(axis=1)
    share = area / area.sum()
    idle = tuple(j for j in range(weights.shape[1]) if not _moves(share, weights[:, j]))
    return Misfit(float(np.sum(share * apart)), float(apart.max()), idle)


def _moves(area: F64, share: F64) -> bool:
    return bool(np.sum(area * share) > NOTHING)


def _common_sum(area: F64, share: F64) -> F64:
    """S [V] as a sum of the bones' weights, with factors c >= 0 such that sum_v area w_j S is as near to 1 as possible.

    Multiplicative steps (Lee and Seung 2001); none of them increases the squared error.
    """
    moving = share[:, [j for j in range(share.shape[1]) if _moves(area, share[:, j])]]
    together = moving.T @ (area[:, None] * moving)
    factor = np.ones(len(together))
    for _ in range(SHARES):
        factor *= together.sum(axis=0) / (together @ (together @ factor))
    total: F64 = moving @ factor
    return total


def _mixture(place: F64, mass: F64, components: int) -> tuple[F64, F64, F64]:
    """(pi [K], centres [K, 2], covariances [K, 3]) of points [N, 2] that hold `mass` [N], 1 in all."""
    responsibility = _split(place, mass, components)
    for _ in range(ROUNDS):
        pi, centre, covariance = _moments(place, responsibility * mass[:, None])
        density = pi * _normal(place, centre, covariance)
        responsibility = density / np.maximum(density.sum(axis=1, keepdims=True), 1e-300)
    pi = np.maximum(pi, LEAST_PI)
    return pi / pi.sum(), centre, covariance


def _split(place: F64, mass: F64, components: int) -> F64:
    """First responsibilities [N, K]: equal parts along the points' longest axis, with soft ends."""
    from_middle = place - mass @ place
    spread = (from_middle * mass[:, None]).T @ from_middle
    axis = np.linalg.eigh(spread)[1][:, 1]
    along = from_middle @ (axis if axis[np.abs(axis).argmax()] > 0 else -axis)
    order = np.argsort(along, kind="stable")
    quantile = np.empty(len(along))
    quantile[order] = np.cumsum(mass[order]) - 0.5 * mass[order]
    middle = (np.arange(components) + 0.5) / components
    near = np.exp(-0.5 * np.square((quantile[:, None] - middle) * 2 * components))
    result: F64 = near / near.sum(axis=1, keepdims=True)
    return result


def _moments(place: F64, held: F64) -> tuple[F64, F64, F64]:
    """(pi [K], centres [K, 2], covariances [K, 3]) of each component's share of the points [N, K]."""
    pi = held.sum(axis=0)
    share = held / np.maximum(pi, 1e-300)
    centre = share.T @ place
    x, y = (place[:, None, k] - centre[:, k] for k in range(2))
    xx, xy, yy = ((share * product).sum(axis=0) for product in (x * x, x * y, y * y))
    covariance: F64 = np.stack([xx + LEAST_DEVIATION**2, xy, yy + LEAST_DEVIATION**2], axis=1)
    return pi, centre, covariance


def _normal(place: F64, centre: F64, covariance: F64) -> F64:
    """Densities [N, K] at points [N, 2]."""
    xx, xy, yy = covariance.T
    determinant = xx * yy - xy * xy
    x, y = (place[:, None, k] - centre[:, k] for k in range(2))
    exponent = (yy * x * x - 2 * xy * x * y + xx * y * y) / determinant
    density: F64 = np.exp(-0.5 * exponent) / (2 * np.pi * np.sqrt(determinant))
    return density
