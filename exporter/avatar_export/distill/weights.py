"""Skin weights and rest positions from motion: least squares over the simplex, by pairwise active set.

For every Gaussian, minimise sum_t |sum_j w_j A_tj x0 - z_t|^2 + rho |w - prior|^2 over w >= 0, sum w = 1, in turn with
the rest position x0. Sums over the frames are made once, so that a step costs nothing a frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from avatar_export.distill import planes
from avatar_export.distill.solve import Mask
from avatar_runtime.avatar import F32, F64, I64

INFLUENCES = 8  # joints a Gaussian at most
SMALLEST = 1e-3  # weights below are dropped
ROUNDS = 4  # of motion, then of what the drivers move
STEPS = 6  # of weights, then of rest positions, a round
PAIRS = 24  # exchanges of weight between two joints a step
PULL = 1e-6  # towards the prior, times the largest motion between joints
MANY_JOINTS = 32  # above them only likely ones are tried
LIKELY = 8  # joints a Gaussian
AT_ONCE = 256  # Gaussians whose likely joints are tried together
DRIVERS_RIDGE = 1e-3


@dataclass(frozen=True)
class Bound:
    """How Gaussians hang on joints."""

    weight: F64  # [n, J] at least 0, sums 1
    rest: F64  # [n, 3] rest positions without drivers


@dataclass(frozen=True)
class Motion:
    """What does not depend on the Gaussians, made once for all of them."""

    skin_matrix: F64  # [F, J, 4, 4]
    products: F64  # [J, J, 4, 4] sum over t of A_tj^T A_tk, upper three rows
    drivers: F64  # [F, D + 1] one, then the exercised drivers, about their mean
    solver: F64  # [D + 1, F] of the drivers' ridge
    leader: I64  # [J] joints with the same one moved alike
    taught: Mask  # [J] one of those

    @staticmethod
    def of(skin_matrix: F64, drivers: F64, leader: I64 | None = None) -> Motion:
        """Of skin matrices [F, J, 4, 4] and exercised drivers [F, D]."""
        upper = skin_matrix[:, :, :3]
        products = np.einsum("tjab,tkac->jkbc", upper, upper, optimize=True)
        columns = np.concatenate([np.ones((len(drivers), 1)), drivers], axis=1)
        penalty = np.diag([0.0, *[DRIVERS_RIDGE] * drivers.shape[1]])
        solver = np.linalg.solve(columns.T @ columns + penalty, columns.T)
        own = np.arange(skin_matrix.shape[1])
        leader = own if leader is None else leader
        return Motion(skin_matrix, products, columns, solver, leader, leader == own)

    def alone(self, pulled: F64) -> F64:
        """[n, J] what `_alone` says of each joint; infinite if it is not taught."""
        cost = _alone(np.einsum("jjab->jab", self.products), pulled)
        cost[:, ~self.taught] = np.inf
        return cost

    def only(self, joints: I64) -> Motion:
        """The motion of the given joints alone."""
        return replace(
            self,
            skin_matrix=self.skin_matrix[:, joints],
            products=self.products[np.ix_(joints, joints)],
            leader=self.leader[joints],
            taught=self.taught[joints],
        )


def fit(motion: Motion, mean: F32, prior: F64 | None = None) -> Bound:
    """Weights and rest positions of Gaussians that were at `mean` [F, n, 3]; `prior` [n, J] pulls the weights.

    Joints that are not taught get what the prior gives them of the weight of those that moved alike, and nothing
    without a prior. Of many joints, those are tried that explain the motion of one of some Gaussians best when alone.
    """
    count, joints = mean.shape[1], motion.skin_matrix.shape[1]
    weight, rest = np.zeros((count, joints)), np.zeros((count, 3))
    tried = np.flatnonzero(motion.taught) if prior is None else np.arange(joints)
    step = AT_ONCE if len(tried) > MANY_JOINTS else max(count, 1)
    for first in range(0, count, step):
        rows = slice(first, first + step)
        part, pull, used = mean[:, rows], None if prior is None else prior[rows], tried
        if len(tried) > MANY_JOINTS:
            cost = motion.alone(_pulled(motion.skin_matrix, part.astype(np.float64)))
            used = np.unique(np.argpartition(cost, LIKELY, axis=1)[:, :LIKELY])
            if pull is not None:
                used = np.union1d(used, np.flatnonzero(pull.max(axis=0) > SMALLEST))
        bound = _fit(motion.only(used), part, None if pull is None else pull[:, used])
        weight[rows, used], rest[rows] = bound.weight, bound.rest
    return Bound(weight, rest)


def _fit(motion: Motion, mean: F32, prior: F64 | None) -> Bound:
    target = mean.astype(np.float64)
    bound = _fit_still(motion, target, None, prior)
    if motion.skin_matrix.shape[1] == 1:
        return bound
    for _ in range(ROUNDS - 1):
        turn, move = planes.blended(motion.skin_matrix, bound.weight)
        rest = planes.unmoved(turn, move, mean)
        flat = rest.reshape(len(rest), -1)
        learnt = motion.solver @ flat
        driven = (motion.drivers[:, 1:] @ learnt[1:]).reshape(rest.shape)
        target = mean.astype(np.float64) - planes.turned(turn, driven.astype(np.float32))
        bound = _fit_still(motion, target, bound, prior)
    return bound


def _pulled(skin_matrix: F64, target: F64) -> F64:
    """[n, J, 4] sum over the frames of A^T z."""
    frames, joints = skin_matrix.shape[:2]
    count = target.shape[1]
    upper = skin_matrix[:, :, :3].transpose(1, 3, 0, 2).reshape(4 * joints, 3 * frames)
    flat = np.ascontiguousarray(target.transpose(0, 2, 1)).reshape(3 * frames, count)
    result: F64 = (upper @ flat).reshape(joints, 4, count).transpose(2, 0, 1)
    return result


def _fit_still(motion: Motion, target: F64, start: Bound | None, prior: F64 | None) -> Bound:
    """The fit to `target` [F, n, 3] of Gaussians that no driver moves."""
    pulled = _pulled(motion.skin_matrix, target)
    weight = _start(motion, pulled, prior) if start is None else start.weight
    rest = rest_positions(motion, pulled, weight)
    for step in range(STEPS):
        weight = _weights(motion, pulled, rest, weight, prior)
        if step == STEPS - 1:
            weight = _few(weight)
        rest = rest_positions(motion, pulled, weight)
    return Bound(weight, rest)


def left_by_one(skin_matrix: F64, mean: F64) -> F64:
    """[n] RMS distance, metres, that remains where each Gaussian of `mean` [F, n, 3] hangs on its best joint alone."""
    upper = skin_matrix[:, :, :3]
    own = np.einsum("tjab,tjac->jbc", upper, upper, optimize=True)
    square = _alone(own, _pulled(skin_matrix, mean)).min(axis=1) + np.square(mean).sum(axis=(0, 2))
    result: F64 = np.sqrt(np.maximum(square, 0) / len(mean))
    return result


def _start(motion: Motion, pulled: F64, prior: F64 | None) -> F64:
    """[n, J] all weight on the joint that alone explains the motion best; the prior parts it among those that moved
    alike."""
    cost = motion.alone(pulled)
    best = np.argmin(cost, axis=1)
    weight = np.zeros_like(cost)
    weight[np.arange(len(cost)), best] = 1
    if prior is not None and not motion.taught.all():
        alike = prior * (motion.leader == motion.leader[best][:, None])
        total = alike.sum(axis=1, keepdims=True)
        weight = np.where(total > SMALLEST, alike / np.maximum(total, SMALLEST), weight)
    return weight


def _alone(products: F64, pulled: F64) -> F64:
    """[n, J] squared error of each joint with all the weight, less what is the same for all; `products` [J, 4, 4]."""
    cost = np.empty(pulled.shape[:2])
    for joint, own in enumerate(products):
        square = own[:3, :3] + 1e-12 * np.trace(own[:3, :3]) * np.eye(3)
        x = _one(np.linalg.solve(square, (pulled[:, joint, :3] - own[:3, 3]).T).T)
        cost[:, joint] = np.einsum("na,ab,nb->n", x, own, x) - 2 * np.einsum("na,na->n", x, pulled[:, joint])
    return cost


def rest_positions(motion: Motion, pulled: F64, weight: F64) -> F64:
    """[n, 3] the rest positions that fit best under `weight` [n, J]."""
    count, joints = weight.shape
    pairs = (weight[:, :, None] * weight[:, None, :]).reshape(count, joints * joints)
    full = (pairs @ motion.products.reshape(joints * joints, 16)).reshape(count, 4, 4)
    right = np.einsum("nj,nja->na", weight, pulled)[:, :3] - full[:, :3, 3]
    square = full[:, :3, :3] + 1e-12 * np.trace(full[:, :3, :3], axis1=1, axis2=2)[:, None, None] * np.eye(3)
    result: F64 = np.linalg.solve(square, right[..., None])[..., 0]
    return result


def _weights(motion: Motion, pulled: F64, rest: F64, weight: F64, prior: F64 | None) -> F64:
    """Weights [n, J] for rest positions [n, 3]: exchanges between the two joints that gain most."""
    joints = weight.shape[1]
    x = _one(rest)
    outer = (x[:, :, None] * x[:, None, :]).reshape(-1, 16)
    gram = (outer @ motion.products.reshape(joints * joints, 16).T).reshape(-1, joints, joints)
    pull = np.einsum("na,nja->nj", x, pulled)
    own = np.einsum("njj->nj", gram)
    barred = np.zeros(weight.shape, bool)
    if prior is not None:
        barred = ~motion.taught & (prior <= SMALLEST)
        rho = PULL * np.abs(own).max(axis=1)
        gram = gram + rho[:, None, None] * np.eye(joints)
        pull = pull + rho[:, None] * prior
        own = own + rho[:, None]
    slope = np.einsum("njk,nk->nj", gram, weight) - pull
    slope[barred] = np.inf
    row = np.arange(len(weight))
    weight = weight.copy()
    for _ in range(PAIRS):
        to = np.argmin(slope, axis=1)
        gives = np.argmax(np.where(weight > 0, slope, -np.inf), axis=1)
        gain = slope[row, gives] - slope[row, to]
        bend = own[row, gives] + own[row, to] - 2 * gram[row, gives, to]
        tiny = 1e-13 * (own[row, gives] + own[row, to])
        amount = np.where(bend > tiny, np.minimum(gain / np.maximum(bend, 1e-300), weight[row, gives]), 0)
        if not (amount > 1e-9).any():
            break
        weight[row, gives] -= amount
        weight[row, to] += amount
        slope += amount[:, None] * (gram[row, :, to] - gram[row, :, gives])
    return weight


def _few(weight: F64) -> F64:
    """Weights of at most INFLUENCES joints, none below SMALLEST; sums 1."""
    if weight.shape[1] > INFLUENCES:
        least = np.partition(weight, -INFLUENCES, axis=1)[:, -INFLUENCES, None]
        weight = np.where(weight >= least, weight, 0)
    weight = np.where(weight >= SMALLEST, weight, 0)
    result: F64 = weight / weight.sum(axis=1, keepdims=True)
    return result


def _one(points: F64) -> F64:
    return np.concatenate([points, np.ones((len(points), 1))], axis=1)
