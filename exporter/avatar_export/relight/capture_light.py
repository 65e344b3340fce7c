"""The light of a capture, estimated from the colours that an avatar learned in it.

Albedo and light are known only as a product. What is taken here: most of what is seen of a person has one albedo, skin
or cloth, and the light is white on the whole. So a smooth function of the normal is fitted to the logarithm of the
colours, which what is of another albedo (hair, brows, lips) pulls little, and which stays even without reason.
"""

from __future__ import annotations

import numpy as np

from avatar_export.ops.normals import bound_normals
from avatar_export.ops.vertex_colour import linear_from_display
from avatar_runtime.avatar import F32, F64, Avatar
from avatar_runtime.light import AMBIENT_TERMS, even, sh_bases
from avatar_schema import constants

DARKEST = 0.02  # display-referred: colours below say nothing of the light
# How much the fit would rather be even: in brightness; in what differs from left to right, which no albedo of a person
# explains; and in colour.
EVEN, EVEN_SIDES, EVEN_COLOUR = 0.05, 0.015, 0.3
SIDES = np.array([0, 0, 0, 1, 1, 0, 0, 1, 0], bool)  # the SH bases that are odd in x
OUTLYING = 0.8  # standard deviations from which on a colour pulls less (Cauchy's weights)
ROUNDS = 20
EXTREMES = (0.2, 5.0)  # times the mean: no estimate goes beyond
LIT = 0.8  # so much of what is seen gets less light than 1: one exposes for the side that is lit
UNSEEN = 0.1  # what normals that nothing has count in all
SPHERE = 500  # normals


def estimated(avatar: Avatar, weight: F64) -> F32:
    """[9, 3] ambient light in which the Gaussians of `avatar`, which has normals, may have got their colours.

    weight [N]: how much is seen of each. The light is grey in the mean of what is seen, and 1 on its lit side: so the
    avatar is as bright as in its capture where a light of 1 falls on it.
    """
    normal, weight = bound_normals(avatar), np.asarray(weight, np.float64)
    if not weight.sum() > 0:
        return even((1.0, 1.0, 1.0))
    weight = weight / weight.sum()
    shown = constants()["sh_c0"][0] * avatar.gaussians.sh[:, 0].astype(np.float64) + 0.5
    colour = np.log(linear_from_display(np.clip(shown, DARKEST, 1)))
    grey, bases = colour.mean(axis=1), sh_bases(normal)
    prior = np.where(SIDES, EVEN_SIDES, EVEN)
    bright = _fitted(bases, grey, weight, prior)
    tints = [
        _fitted(bases, colour[:, k] - grey, weight, np.full(AMBIENT_TERMS, EVEN_COLOUR)) for k in range(3)
    ]
    sphere = sh_bases(_sphere())
    logarithm = np.stack([bright + tint for tint in tints], axis=1)
    return _projected(np.concatenate([bases, sphere]), logarithm, weight)


def _fitted(bases: F64, values: F64, weight: F64, prior: F64) -> F64:
    """[9] the SH whose sum comes near most `values` [N]; weights [N] add up to 1."""
    constant = constants()["sh_c0"][0]
    found = np.zeros(AMBIENT_TERMS)
    found[0] = _quantile(values, weight, 0.5) / constant
    ridge = np.diag(np.where(np.arange(AMBIENT_TERMS) > 0, prior, 0))
    for _ in range(ROUNDS):
        off = values - bases @ found
        spread = max(1.48 * _quantile(np.abs(off), weight, 0.5), 1e-3)
        trust = weight / (1 + np.square(off / (OUTLYING * spread)))
        trusted = trust[:, None] * bases
        found = np.linalg.solve(bases.T @ trusted + ridge * trust.sum(), trusted.T @ values)
    return found


def _projected(bases: F64, logarithm: F64, weight: F64) -> F32:
    """[9, 3] the light of a `logarithm` [9, 3], at the normals seen, of these weights, and those of the sphere."""
    seen = len(weight)
    light = np.exp(bases @ logarithm)
    light = np.clip(light / (weight @ light[:seen]), *EXTREMES)
    share = np.concatenate([weight, np.full(len(bases) - seen, UNSEEN / (len(bases) - seen))])
    rows = np.linalg.solve(bases.T @ (share[:, None] * bases), bases.T @ (share[:, None] * light))
    found = bases[:seen] @ rows
    grey = rows / (weight @ found)
    return (grey / _quantile((bases[:seen] @ grey).mean(axis=1), weight, LIT)).astype(np.float32)


def _quantile(values: F64, weight: F64, share: float) -> float:
    order = np.argsort(values)
    reached = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(reached, share * reached[-1])])


def _sphere() -> F64:
    """[SPHERE, 3] directions spread evenly."""
    at = np.arange(SPHERE) + 0.5
    z, angle = 1 - 2 * at / SPHERE, at * np.pi * (3 - np.sqrt(5))
    flat = np.sqrt(1 - z * z)
    return np.stack([flat * np.cos(angle), flat * np.sin(angle), z], axis=1)
