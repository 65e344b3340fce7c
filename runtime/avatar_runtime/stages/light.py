"""Stages `shadow` and `light`: the colour of each splat in the light of a scene, in float32.

What was trained under the light of the capture is multiplied, in linear light, by light of the scene over light of the
capture. Blending stays display-referred.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, F64, I64, U32, Avatar, Relight
from avatar_runtime.light import SHADOW_SIZE, LightArrays
from avatar_runtime.rotation import matrix_from_quat
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.project import Projected
from avatar_runtime.stages.surface import Surface, triangle_shape, triangle_turns
from avatar_schema import constants

f32 = np.float32
FAR = np.uint32(0x7F000000).view(np.float32)  # no splat is so far away
REACH, SPAN = f32(12), f32(128)  # texels: of a splat to each side, of a triangle in all
DISPLAY_TOE, LINEAR_TOE = f32(0.04045), f32(0.0031308)  # of sRGB
TINY = f32(1e-30)


def light(
    projected: Projected,
    splats: Splats,
    relight: Relight,
    lit: LightArrays,
    shadow: F32 | None,
    facing: F32 | None = None,
) -> Projected:
    """`projected` with the colours that the splats have in the light `lit`.

    shadow: what `shadow_map` gives, or None. facing [N, 3]: what `turned_normals` gives; None: the Gaussians' own turn
    their normals.
    """
    rgb = projected.rgb.copy()
    seen = np.flatnonzero(projected.radius > 0)
    x = splats.mean[seen]
    if facing is None:
        n = normals(splats.quat_wxyz[seen], relight.normal[seen])
    else:
        n = unit(facing[seen])
    scene = ambient(n, lit.ambient[:, :3])
    for k in range(len(lit.place)):
        amount = direct(n, x, lit.place[k])
        if k == 0 and shadow is not None and lit.shadow_offset[2]:
            amount = amount * visible(x, n, lit, shadow)
        scene = scene + amount[:, None] * lit.colour[k, :3]
    captured = ambient(
        _turned(n, lit.turn), relight.ambient
    )  # as they are, so that equal lights give equal bits
    rgb[seen] = relit(rgb[seen], scene, captured)
    return replace(projected, rgb=rgb)


def _turned(n: F32, rows: F32) -> F32:
    """Normals [N, 3] turned by the rows [3, 4], term by term: the identity changes no bit."""
    x, y, z = n.T
    return np.stack([r[0] * x + r[1] * y + r[2] * z for r in rows], axis=1)


def turned_normals(surface: Surface, relight: Relight, vertices: F32, world_from_avatar: F64) -> F32:
    """[N, 3] normals in the world that turn with the triangles of the posed `vertices` [V, 3]."""
    turn = world_from_avatar[:3, :3] @ axes_by_mesh(surface, vertices)
    result: F32 = np.einsum("nij,nj->ni", turn, relight.normal.astype(np.float64)).astype(np.float32)
    return result


def axes_by_mesh(surface: Surface, vertices: F32) -> F64:
    """[N, 3, 3] the axes that Gaussians would have if their triangles turned them, avatar space, as columns."""
    e = surface.embedding
    own = e.local_quat_wxyz.astype(np.float64)
    own /= np.maximum(np.linalg.norm(own, axis=1, keepdims=True), TINY)
    turn = triangle_turns(surface, triangle_shape(vertices, e.triangles, surface.rules))[e.triangle]
    result: F64 = matrix_from_quat(turn) @ matrix_from_quat(own)
    return result


def normals(quat_wxyz: F32, normal: F32) -> F32:
    """[N, 3] unit normals in the world; `normal` [N, 3] in the axes of each splat."""
    w, x, y, z = quat_wxyz.T
    rows = (
        (1 - f32(2) * (y * y + z * z), f32(2) * (x * y - w * z), f32(2) * (x * z + w * y)),
        (f32(2) * (x * y + w * z), 1 - f32(2) * (x * x + z * z), f32(2) * (y * z - w * x)),
        (f32(2) * (x * z - w * y), f32(2) * (y * z + w * x), 1 - f32(2) * (x * x + y * y)),
    )
    turned = [sum(r[k] * normal[:, k] for k in range(3)) for r in rows]
    return unit(np.stack(turned, axis=1).astype(np.float32))


def unit(v: F32) -> F32:
    """Vectors [N, 3] of length 1; the zero vector stays zero."""
    length: F32 = np.maximum(np.sqrt((v * v).sum(axis=1, keepdims=True)), TINY)
    return v / length


def ambient(n: F32, rows: F32) -> F32:
    """[N, 3] irradiance over pi by the unit normals n [N, 3]; `rows` [9, 3]."""
    x, y, z = n.T
    c0, c1, c2 = ([f32(v) for v in constants()[name]] for name in ("sh_c0", "sh_c1", "sh_c2"))
    xx, yy, zz = x * x, y * y, z * z
    terms = [c1[0] * y, c1[1] * z, c1[2] * x]
    terms += (
        c2[0] * (x * y),
        c2[1] * (y * z),
        c2[2] * (f32(2) * zz - xx - yy),
        c2[3] * (x * z),
        c2[4] * (xx - yy),
    )
    total = np.tile(c0[0] * rows[0], (len(n), 1))
    for term, row in zip(terms, rows[1:], strict=True):
        total = total + term[:, None] * row
    return total.astype(np.float32)


def direct(n: F32, x: F32, place: F32) -> F32:
    """[N] what a white light gives to a white matt surface at x [N, 3]; place: towards it and 0, or position and 1."""
    to = place[:3] - place[3] * x
    squared = (to * to).sum(axis=1)
    facing = np.maximum((n * to).sum(axis=1) / np.sqrt(np.maximum(squared, TINY)), f32(0))
    nearest = f32(constants()["light_nearest"]) ** 2
    result: F32 = facing / np.maximum(squared, nearest) if place[3] else facing
    return result


def relit(display: F32, scene: F32, captured: F32) -> F32:
    """Display-referred colours [N, 3] in light `scene` of what was trained in light `captured`, both linear.

    Where they are equal no bit changes.
    """
    ratio = np.maximum(scene, f32(0)) / np.maximum(captured, f32(constants()["light_floor"]))
    raised = (display + f32(0.055)) * ratio ** f32(1 / 2.4)
    upper = np.where(
        raised > DISPLAY_TOE + f32(0.055), raised - f32(0.055), f32(12.92) * (raised / f32(1.055)) ** f32(2.4)
    )
    linear = display / f32(12.92) * ratio
    lower = np.where(
        linear <= LINEAR_TOE, f32(12.92) * linear, f32(1.055) * linear ** f32(1 / 2.4) - f32(0.055)
    )
    found = np.where(display > DISPLAY_TOE, upper, lower)
    result: F32 = np.where((ratio == 1).all(axis=1, keepdims=True), display, found).astype(np.float32)
    return result


def shadow_map(splats: Splats, lit: LightArrays, mesh: tuple[F32, U32] | None = None) -> F32:
    """[S, S] least distance from the first light of the splats, at texels where their alpha is large, and of `mesh`.

    mesh: vertices [V, 3] in the world, triangles [F, 3].
    """
    found = np.full((SHADOW_SIZE, SHADOW_SIZE), FAR, np.float32)
    if mesh is not None:
        _cast_mesh(found, *mesh, lit)
    texel, distance, scale = shadow_points(splats.mean, lit)
    row = lit.shadow_row
    most = f32(2) * np.log(np.maximum(splats.opacity, TINY) / f32(constants()["shadow_alpha"]))
    across, down = ((row[k, :3] - texel[:, k, None] * row[3, :3]) * scale[:, None] for k in (0, 1))
    u, v = (_in_axes(splats.quat_wxyz, gradient) * splats.scale for gradient in (across, down))
    low_pass = f32(constants()["shadow_low_pass"])
    xx, xy, yy = (u * u).sum(axis=1) + low_pass, (u * v).sum(axis=1), (v * v).sum(axis=1) + low_pass
    det = xx * yy - xy * xy
    away = _in_axes(splats.quat_wxyz, np.broadcast_to(row[2, :3], splats.mean.shape)) * splats.scale
    away_x, away_y = (away * u).sum(axis=1), (away * v).sum(axis=1)
    slope = np.stack([yy * away_x - xy * away_y, xx * away_y - xy * away_x], axis=1) / det[:, None]
    casts = (most > 0) & (distance > 0) & (det > 0)
    reach = np.minimum(np.sqrt(np.maximum(most, 0)[:, None] * np.stack([xx, yy], axis=1)), REACH)
    for i, at in _texels(texel - reach, texel + reach, casts):
        dx, dy = (at - texel[i]).T
        inside = dx * (yy[i] * dx - f32(2) * xy[i] * dy) + xx[i] * dy * dy <= most[i] * det[i]
        at_texel = np.maximum(distance[i] + slope[i, 0] * dx + slope[i, 1] * dy, f32(0))
        _least(found, at[inside], at_texel[inside])
    return found


def casting(avatar: Avatar, vertices: F32 | None, world_from_avatar: F64) -> tuple[F32, U32] | None:
    """The mesh of `shadow_map`: the posed `vertices` [V, 3] and the triangles of what poses the avatar, if anything."""
    mesh = avatar.embedding or avatar.rig
    if mesh is None or vertices is None:
        return None
    world = world_from_avatar.astype(np.float32)
    return vertices @ world[:3, :3].T + world[:3, 3], mesh.triangles


def _cast_mesh(found: F32, vertices: F32, triangles: U32, lit: LightArrays) -> None:
    """The triangles [F, 3] of vertices [V, 3] in the world, at the texels whose centres they cover."""
    texel, distance, _ = shadow_points(vertices, lit)
    a, b, c = (texel[triangles[:, k]] for k in range(3))
    far = distance[triangles]
    area = _side(a, b, c)
    casts = (far.min(axis=1) > 0) & (np.abs(area) > 0)
    low, high = np.minimum(a, np.minimum(b, c)), np.maximum(a, np.maximum(b, c))
    for i, at in _texels(low, np.minimum(high, np.clip(np.ceil(low), 0, SHADOW_SIZE) + SPAN), casts):
        weights = [_side(p[i], q[i], at) / area[i] for p, q in ((b, c), (c, a), (a, b))]
        inside = np.minimum(np.minimum(*weights[:2]), weights[2]) >= 0
        at_texel = weights[0] * far[i, 0] + weights[1] * far[i, 1] + weights[2] * far[i, 2]
        _least(found, at[inside], at_texel[inside])


def _side(start: F32, end: F32, at: F32) -> F32:
    """Twice the signed area of triangles of texels [N, 2]."""
    across, along = end - start, at - start
    result: F32 = across[:, 0] * along[:, 1] - across[:, 1] * along[:, 0]
    return result


def _texels(low: F32, high: F32, casts: npt.NDArray[np.bool_]) -> Iterator[tuple[I64, F32]]:
    """(row of the caster [T], texel [T, 2]) of the boxes from low to high [N, 2] of what casts, some at a time."""
    first = np.clip(np.ceil(np.where(casts[:, None], low, 0)), 0, SHADOW_SIZE).astype(np.int64)
    last = np.clip(np.floor(np.where(casts[:, None], high, -1)), -1, SHADOW_SIZE - 1).astype(np.int64)
    size = np.maximum(last - first + 1, 0)
    rows = np.flatnonzero(casts & (size.prod(axis=1) > 0))
    for some in np.array_split(rows, max(1, len(rows) // 4096)):
        count = size[some].prod(axis=1)
        i = np.repeat(some, count)
        k = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        at = first[i] + np.stack([k % size[i, 0], k // size[i, 0]], axis=1)
        yield i, at.astype(np.float32)


def _least(found: F32, at: F32, distance: F32) -> None:
    column, row = at.astype(np.int64).T
    np.minimum.at(found, (row, column), distance)


def shadow_points(x: F32, lit: LightArrays) -> tuple[F32, F32, F32]:
    """(column and row [N, 2] in texels, distance [N], 1 / w [N]) of points x [N, 3] in the shadow map."""
    at = np.concatenate([x, np.ones((len(x), 1), np.float32)], axis=1)
    column, row, distance, w = (at @ lit.shadow_row.T).T
    scale = f32(1) / w
    return np.stack([column * scale, row * scale], axis=1), distance, scale


def visible(x: F32, n: F32, lit: LightArrays, shadow: F32) -> F32:
    """[N] 0 in the shadow to 1 in the light, of points x with unit normals n: a box of 3x3 texels."""
    along_normal, along_light = lit.shadow_offset[:2]
    texel, distance, _ = shadow_points(x + n * along_normal, lit)
    first = np.floor(texel)
    part = texel - first
    weight = [np.stack([1 - part[:, k], np.ones(len(x)), np.ones(len(x)), part[:, k]]) / 3 for k in (0, 1)]
    seen = np.zeros(len(x), np.float32)
    for j in range(4):
        for i in range(4):
            column, row = first[:, 0] + i - 1, first[:, 1] + j - 1
            inside = (column >= 0) & (row >= 0) & (column < SHADOW_SIZE) & (row < SHADOW_SIZE)
            least = shadow[np.where(inside, row, 0).astype(int), np.where(inside, column, 0).astype(int)]
            lit_here = ~inside | (least >= distance - along_light)
            seen += np.where(lit_here, weight[0][i] * weight[1][j], 0).astype(np.float32)
    return seen


def _in_axes(quat_wxyz: F32, v: F32) -> F32:
    """R^T v of each splat."""
    w, axis = quat_wxyz[:, :1], -quat_wxyz[:, 1:]
    twice = f32(2) * np.cross(axis, v)
    result: F32 = v + w * twice + np.cross(axis, twice)
    return result
