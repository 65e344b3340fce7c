"""Fits the table to pictures: surface points by least squares, then what is left by pose and MediaPipe's weights."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_trainer.film.fit.landmark_map import COUNT, SKIN, features, seen_from
from avatar_trainer.head import Head
from tools.landmark_map.faces import Faces

Array = npt.NDArray[Any]

FRONT = np.radians((15.0, 9.0))  # yaw and pitch of the pictures that make the template
NEAREST = 8  # vertices whose triangles are tried for a landmark
ROUNDS, HUBER = 3, 2.0  # of reweighting; medians beyond which a picture counts less
LOST = 0.055  # median error in sizes of the face above which MediaPipe lost the face
SHUT = 0.4  # blink from which on an iris is not judged
RIDGE, FLOOR = 100.0, 0.1  # strength; least deviation that a feature is divided by
MANY = 12  # pictures that make a film
TINY = 1e-12  # keeps a system solvable
LEAST = 0.03  # deviation of a predicted weight, at least
ENOUGH = 600  # pictures that say where a surface point is


@dataclass(frozen=True)
class Upright:
    """Landmarks and vertices in the face's own axes, its size 1; complex, x + iy."""

    template: Array  # [478]
    landmarks: Array  # [N, 478]
    vertices: Array  # [N, V]
    inputs: Array  # [N, C] of the corrections

    def chosen(self, mask: Array | slice) -> Upright:
        """The pictures in `mask` [N]."""
        return Upright(self.template, self.landmarks[mask], self.vertices[mask], self.inputs[mask])


def upright(faces: Faces) -> Upright:
    """Pictures in the axes of a template that they make."""
    points = faces.landmarks[..., 0] + 1j * faces.landmarks[..., 1].astype(np.float64)
    middle = points[:, :SKIN].mean(axis=1, keepdims=True)
    points -= middle
    yaw, pitch = seen_from(faces.rotation, faces.translation)
    front = points[(np.abs(yaw) < FRONT[0]) & (np.abs(pitch) < FRONT[1])]
    template = front[0]
    for _ in range(3):
        mean = (front / similarity(front, template)[:, None]).mean(axis=0)
        template = mean * 1j / (mean[152] - mean[10])
    turn = similarity(points, template)[:, None]
    vertices = (faces.pixels[..., 0] + 1j * faces.pixels[..., 1] - middle) / turn
    return Upright(template, points / turn, vertices.astype(np.complex64), features(yaw, pitch, faces.scores))


def similarity(points: Array, template: Array) -> Array:
    """[N] what scales and turns the template [478] into points [N, 478]."""
    own = template[:SKIN]
    result: Array = points[:, :SKIN] @ own.conj() / np.sum(np.abs(own) ** 2)
    return result


def surface_points(seen: Upright, faces: Faces, head: Head) -> tuple[Array, Array]:
    """(vertices [478, 3], barycentrics [478, 3]) of the head that are nearest to each landmark, over all pictures."""
    step = max(len(seen.landmarks) // ENOUGH, 1)
    seen, faces = seen.chosen(slice(None, None, step)), faces.chosen(slice(None, None, step))
    blinks = [head.expression_names.index(f"eyeBlink{side}") for side in ("Left", "Right")]
    open_eyes = (faces.weights[:, blinks].max(axis=1) < SHUT).astype(np.float64)
    corners, bary = np.zeros((COUNT, 3), np.int64), np.zeros((COUNT, 3))
    every = np.ones(len(open_eyes))
    for parts, rows, counts in (
        (("face", "head"), range(SKIN), every),
        (("left_eye", "right_eye"), range(SKIN, COUNT), open_eyes),
    ):
        triangles = head.triangles[head.triangles_in(*parts)]
        vertices = np.unique(triangles)
        far = distances(seen.landmarks[:, rows], seen.vertices[:, vertices], counts)
        for row, order in zip(rows, far.argsort(axis=1)[:, :NEAREST], strict=True):
            near = triangles[np.isin(triangles, vertices[order]).any(axis=1)]
            corners[row], bary[row] = nearest(seen.landmarks[:, row], seen.vertices, near, counts)
    return corners, bary


def distances(points: Array, vertices: Array, counts: Array) -> Array:
    """[L, V] mean square distances of landmarks [N, L] and vertices [N, V]; N pictures that count so much."""
    root = np.sqrt(counts / counts.sum())[:, None]
    a, b = ((root * x).astype(np.complex64) for x in (points, vertices))
    cross = (a.conj().T @ b).real
    result: Array = (np.abs(a) ** 2).sum(axis=0)[:, None] + (np.abs(b) ** 2).sum(axis=0) - 2 * cross
    return result


def nearest(points: Array, vertices: Array, triangles: Array, counts: Array) -> tuple[Array, Array]:
    """(corners [3], barycentrics [3]) of the best point on the triangles for one landmark [N]; outliers count less."""
    rows = np.unique(triangles)
    away = points[:, None] - vertices[:, rows]
    weight, found = counts, (triangles[0], np.array([1.0, 0, 0]))
    for _ in range(ROUNDS):
        gram = ((away.conj() * weight[:, None]).T @ away).real / weight.sum()
        best = np.inf
        for corners in np.searchsorted(rows, triangles):
            error, bary = in_triangle(gram[np.ix_(corners, corners)], best)
            if error < best:
                best, found, off = error, (rows[corners], bary), np.abs(away[:, corners] @ bary)
        weight = counts / np.maximum(1, off / (HUBER * np.median(off)))
    return found


def in_triangle(gram: Array, best: float) -> tuple[float, Array]:
    """(least b' gram b, b [3]) over b >= 0 of sum 1, if it is less than `best`."""
    found = np.zeros(3)
    for count in (3, 2, 1):
        for chosen in map(list, combinations(range(3), count)):
            share = np.linalg.solve(gram[np.ix_(chosen, chosen)] + TINY * np.eye(count), np.ones(count))
            error = 1 / share.sum()
            if error >= best:  # of the plane or the line: no part of it is nearer
                continue
            if (share >= 0).all():
                best, found = error, np.zeros(3)
                found[chosen] = share * error
    return float(best), found


def ridge(inputs: Array, goals: Array) -> Array:
    """[G, C] least squares from inputs [N, C], whose first is 1, to goals [N, G]; the other inputs kept small."""
    middle, scale = inputs[:, 1:].mean(axis=0), np.maximum(inputs[:, 1:].std(axis=0), FLOOR)
    x, mean = (inputs[:, 1:] - middle) / scale, goals.mean(axis=0)
    gain = np.linalg.solve(x.T @ x + RIDGE * np.eye(x.shape[1]), x.T @ (goals - mean)) / scale[:, None]
    return np.concatenate([(mean - middle @ gain)[:, None], gain.T], axis=1)


def errors(seen: Upright, corners: Array, bary: Array) -> Array:
    """[N, 478] complex: landmark less the place of its surface point."""
    result: Array = seen.landmarks - np.einsum("nlc,lc->nl", seen.vertices[:, corners], bary)
    return result


def correction(inputs: Array, error: Array) -> Array:
    """[478, 2, C] from errors [N, 478]."""
    gain = ridge(inputs, np.concatenate([error.real, error.imag], axis=1))
    return np.moveaxis(gain.reshape(2, COUNT, -1), 0, 1)


def predicted(table: Array, inputs: Array) -> Array:
    """[N, 478] complex errors by a correction [478, 2, C]."""
    x, y = np.moveaxis(np.einsum("lxc,nc->nlx", table, inputs), -1, 0)
    return np.asarray(x + 1j * y)


def covariance(error: Array) -> Array:
    """[478, 3] xx, xy, yy of errors [N, 478]; the farthest hundredth is left out."""
    size = np.abs(error)
    keep = size <= np.quantile(size, 0.99, axis=0)
    x, y = error.real * keep, error.imag * keep
    return np.stack([(x * x).sum(0), (x * y).sum(0), (y * y).sum(0)], axis=1) / keep.sum(0)[:, None]


def variance_by_yaw(error: Array, yaw: Array) -> Array:
    """[478, 3] mean square along one axis of errors [N, 478]: a polynomial of the yaw [N]."""
    square = np.abs(error) ** 2 / 2
    square = np.minimum(square, np.quantile(square, 0.99, axis=0))
    return np.linalg.lstsq(yaw[:, None] ** np.arange(3), square, rcond=None)[0].T


def film_share(seen: Upright, faces: Faces, error: Array) -> Array:
    """[478] share of the variance left after the correction which stays the same over a film."""
    left = error - predicted(correction(seen.inputs, error), seen.inputs)
    within, whole = np.full(COUNT, 1e-12), np.full(COUNT, 1e-12)
    for number in np.unique(faces.identity):
        own = faces.identity == number
        if own.sum() < MANY or len(np.unique(faces.skin[own])) > 1:
            continue
        rest = left[own] - left[own].mean(axis=0)
        within += (np.abs(rest) ** 2).sum(axis=0) * own.sum() / (own.sum() - 1)
        whole += (np.abs(left[own]) ** 2).sum(axis=0)
    return np.asarray(np.clip(1 - within / whole, 0, 1))


def weight_variance(weights: Array, true: Array) -> Array:
    """[51, 2] mean square error of predicted weights [N, 51]: at 0, and more by weight."""
    result = np.zeros((weights.shape[1], 2))
    for row, given, error in zip(result, weights.T, ((weights - true) ** 2).T, strict=True):
        base, slope = np.linalg.lstsq(np.stack([np.ones_like(given), given], axis=1), error, rcond=None)[0]
        row[:] = (base, slope) if slope > 0 else (error.mean(), 0)
    return np.maximum(result, (LEAST**2, 0))


def found(seen: Upright, faces: Faces, head: Head) -> Array:
    """[N] whether MediaPipe's points lie on the face at all."""
    off = np.abs(errors(seen, *surface_points(seen, faces, head)))
    return np.asarray(np.median(off, axis=1) < LOST)
