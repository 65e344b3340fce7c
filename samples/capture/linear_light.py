"""What a posed, textured mesh reflects to a camera, in linear light."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.camera import Camera
from avatar_runtime.light import Light
from avatar_trainer.captures.mesh_raster import Surface, Visible, depth_of
from avatar_trainer.head import unit
from samples.capture.model import Part
from samples.capture.shots import camera_towards

Array = npt.NDArray[Any]

SHADE_POWER = 2.2  # of the shades of the captures, which are factors on display values
# A floor: metres of its height and of half its edge; cells along it; least height of a light, as share of its length.
FLOOR_Y, FLOOR_HALF, FLOOR_CELLS, LOWEST = -0.3, 0.6, 320, 0.4
LAMP, MAP, BIAS = 30.0, 1024, 0.0015  # metres to the camera of a direction's shadows; pixels; metres


def linear(display: Array) -> Array:
    """sRGB decoded."""
    low: Array = np.where(display <= 0.04045, display / 12.92, ((display + 0.055) / 1.055) ** 2.4)
    return low


def display(light: Array) -> Array:
    """sRGB encoded, 0..1."""
    x = np.clip(light, 0, 1)
    result: Array = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    return result


def harmonics(n: Array) -> Array:
    """[..., 9] real spherical harmonics of unit vectors, in the order and with the signs of 3DGS."""
    x, y, z = np.moveaxis(n, -1, 0)
    a, b, c = np.sqrt(np.array([1 / 4, 3 / 4, 15 / 4]) / np.pi)
    ones, two = np.ones_like(x), [c * x * y, -c * y * z, c / np.sqrt(12) * (3 * z * z - 1), -c * x * z]
    return np.stack([a * ones, -b * y, b * z, -b * x, *two, c / 2 * (x * x - y * y)], axis=-1)


@dataclass(frozen=True)
class Hits:
    """What the rays of an image meet in one layer, n of them."""

    row: Array  # [n] of the rays
    column: Array
    at: Array  # [n, 3] world
    normal: Array  # [n, 3]
    albedo: Array  # [n, 3] linear
    alpha: Array  # [n]
    shade: Array  # [n] factor on all light
    strength: Array  # [n] of the highlight of a light of colour 1
    exponent: Array


def hits(surface: Surface, parts: tuple[Part, ...], seen: Visible) -> list[Hits]:
    """The layers of `seen`, front to back."""

    def each(name: str) -> Array:
        return np.concatenate([np.broadcast_to(getattr(p, name), len(p.vertices)) for p in parts])

    normal, found = np.concatenate([p.vertex_normals for p in parts]), []
    table = np.column_stack([surface.vertices, normal, *map(each, ("shade", "strength", "exponent"))])
    table = np.column_stack([table, surface.opacity])
    for layer in seen.layers:
        row, column = np.nonzero(layer >= 0)
        face = layer[row, column]
        ray = np.stack([seen.rays[0][column], seen.rays[1][row], np.ones(len(row))], axis=1)
        weight = np.einsum("nij,nj->ni", seen.planes[face, :3], ray)
        weight /= weight.sum(axis=1, keepdims=True)
        value = np.einsum("nc,ncx->nx", weight, table[surface.triangles[face]])
        colour = _texel(surface.texture, np.einsum("nc,ncx->nx", weight, surface.uv[face]))
        at, turned, rest = value[:, :3], unit(value[:, 3:6]), value[:, 6:].T
        # The captures add a highlight to display values. Here its peak is as bright.
        albedo = linear(colour)
        peak = (linear(np.minimum(colour + rest[1][:, None], 1)) - albedo).mean(axis=1)
        found.append(Hits(row, column, at, turned, albedo, rest[3], rest[0] ** SHADE_POWER, peak, rest[2]))
    return found


def _texel(texture: Array, uv: Array) -> Array:
    """[n, 3] bilinear."""
    size = np.array(texture.shape[1::-1])
    place = np.clip(uv * size - 0.5, 0, size - 1)
    first = place.astype(int)
    second, (u, v) = np.minimum(first + 1, size - 1), (place - first).T[:, :, None]
    (left, t), (right, b) = first.T, second.T
    upper, lower = ((1 - u) * texture[y, left] + u * texture[y, right] for y in (t, b))
    result: Array = (1 - v) * upper + v * lower
    return result


def shaded(found: Hits, light: Light, eye: Array, free: Array | float = 1.0) -> Array:
    """[n, 3] linear colours seen from `eye`; `free` [n] is the share of the first light that reaches a point."""
    matt, shine = harmonics(found.normal) @ light.ambient.astype(np.float64), np.zeros((len(found.at), 3))
    for k, one in enumerate(light.lights):
        to = np.array(one.place) - (found.at if one.point else np.zeros(3))
        squared = np.sum(to * to, axis=-1)
        way = to / np.sqrt(squared)[..., None]
        amount = np.clip(np.sum(found.normal * way, axis=1), 0, 1) * (free if k == 0 else 1.0)
        amount = amount / np.maximum(squared, 1e-4) if one.point else amount
        half = np.clip(np.sum(found.normal * unit(way + unit(eye - found.at)), axis=1), 0, 1)
        matt += amount[:, None] * one.colour
        shine += (found.strength * half**found.exponent * amount)[:, None] * one.colour
    result: Array = found.shade[:, None] * (found.albedo * np.maximum(matt, 0) + shine)
    return result


def floor(light: Light) -> Array | None:
    """[FLOOR_CELLS^2, 3] points of a floor, row by row, about the shadow of the origin by the first light.

    None for lights that throw no shadow nearby.
    """
    one = light.lights[0] if light.lights else None
    towards = unit(np.array(one.place, np.float64)) if one and not one.point else np.zeros(3)
    if towards[1] < LOWEST:
        return None
    x, y, z = towards * FLOOR_Y / towards[1]
    along = FLOOR_HALF * (2 * (np.arange(FLOOR_CELLS) + 0.5) / FLOOR_CELLS - 1)
    places = np.meshgrid(z + along, x + along, indexing="ij")
    return np.stack([places[1].ravel(), np.full(FLOOR_CELLS**2, y), places[0].ravel()], axis=1)


@dataclass(frozen=True)
class Lamp:
    """What the first light of a scene sees of a mesh: nothing else is lit by it."""

    view: tuple[Array, Array, Array]  # K, R, t
    depth: Array  # [MAP, MAP] metres


def lamp(light: Light, surface: Surface) -> Lamp:
    """The first light of `light`; one from a direction is LAMP metres away here."""
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    middle, radius, one = (low + high) / 2, float(np.linalg.norm(high - low)) / 2, light.lights[0]
    to = np.array(one.place) - middle if one.point else LAMP * unit(np.array(one.place, np.float64))
    away = float(np.linalg.norm(to))
    x, y, z = to / away
    fov = 2 * np.arcsin(min(radius / away, 0.95))
    view = camera_towards(middle, away, np.arctan2(x, z), np.arcsin(y), fov, MAP)
    k, rotation, shift = view
    camera = Camera.from_opencv(rotation, shift, k, MAP, MAP)
    return Lamp(view, depth_of(surface.vertices, surface.triangles, camera))


def reached(at: Array, by: Lamp) -> Array:
    """[n] 1 where a lamp reaches points at [n, 3], 0 in the shadow of the mesh."""
    k, rotation, shift = by.view
    seen = at @ rotation.T + shift
    column, row = np.floor(seen[:, :2] / seen[:, 2:] @ k[:2, :2].T + k[:2, 2]).astype(int).T
    inside = (seen[:, 2] > 0) & (np.minimum(column, row) >= 0) & (np.maximum(column, row) < MAP)
    nearest = by.depth[np.where(inside, row, 0), np.where(inside, column, 0)]
    return np.where(inside & (seen[:, 2] > nearest + BIAS), 0.0, 1.0)
