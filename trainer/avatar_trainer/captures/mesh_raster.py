"""Images of a textured triangle mesh, for captures with known ground truth.

Every sample is a ray through a pixel, tested against the planes through the camera and a triangle's edges:
no projection of vertices, so triangles that reach behind the camera need no clipping, and two triangles that
share an edge leave no gap. Depth and texture are perspective-correct. Each pixel is the mean of samples x
samples rays, in display values, as the trainer composites them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import prange

from avatar_runtime import F32, F64, I32, I64, Camera
from avatar_runtime.backends.cpu import kernel

LAYERS = 4  # translucent surfaces that are composited in front of the opaque one
NEAR = 0.01  # metres
BAND = 16  # rows of samples that one thread computes at a time


@dataclass(frozen=True)
class Surface:
    """A textured mesh, posed, in world space."""

    vertices: F64  # [V, 3] metres
    triangles: I64  # [F, 3]; both sides are seen
    uv: F32  # [F, 3, 2] of the corners, 0..1: u to the right of the texture, v down
    texture: F32  # [h, w, 3] display-referred, 0..1
    gain: F32  # [V] factor on the texture's colour: light
    gloss: F32  # [V] added to it: what shines
    opacity: F32  # [V] 0..1


@dataclass(frozen=True)
class MeshImage:
    """The result of `draw`."""

    colour: F32  # [H, W, 3] of the surface alone, not multiplied by alpha; 0 where alpha is 0
    alpha: F32  # [H, W] share of the pixel that the surface covers


@dataclass(frozen=True)
class Visible:
    """The triangles that rays meet, front to back."""

    planes: (
        F64  # [F, 4, 3] on the ray r = (x, y, 1), planes[:3] @ r are in the ratio of the barycentric weights
    )
    rays: tuple[F64, F64]  # x [W S] and y [H S] of the rays
    layers: tuple[I32, ...]  # [H S, W S] each: the triangle, or -1; the last one is opaque


def draw(surface: Surface, camera: Camera, samples: int = 3, near: float = NEAR) -> MeshImage:
    """The image of `surface`; `samples` rays across a pixel, nothing nearer than `near` metres.

    Translucent triangles (a corner with opacity < 1) are composited front to back, LAYERS at most. The result does
    not depend on the number of threads. Raises ValueError for samples < 1, near <= 0, a camera with skew, and
    arrays that do not fit one another.
    """
    seen = visible(surface, camera, samples, near)
    colour = np.zeros((*seen.layers[0].shape, 3), np.float32)
    through = np.ones(seen.layers[0].shape, np.float32)
    for face in seen.layers:
        _shade(surface, seen.planes, seen.rays, face, colour, through)
    return pixels(colour, through, samples)


def visible(surface: Surface, camera: Camera, samples: int, near: float = NEAR) -> Visible:
    """What each ray of `draw` meets. Raises as `draw`."""
    if samples < 1 or near <= 0:
        raise ValueError(f"samples {samples} and near {near} must be positive")
    _check(surface)
    width, height = camera.width * samples, camera.height * samples
    view = camera.camera_from_world.astype(np.float64)
    vertices = surface.vertices @ view[:3, :3].T + view[:3, 3]
    planes, box = _prepared(vertices, surface.triangles, intrinsics(camera), samples, (width, height), near)
    rays = ray_grid(camera, samples)
    opaque = (surface.opacity[surface.triangles] >= 1).all(axis=1)
    depth, face = np.full((height, width), np.inf), np.full((height, width), -1, np.int32)
    none = np.zeros((height, width))
    _nearest(planes, box, np.flatnonzero(opaque), rays[0], rays[1], near, none, depth, face)
    faded, front, layers = np.flatnonzero(~opaque), none, list[I32]()
    for _ in range(LAYERS if len(faded) else 0):
        layer, hit = depth.copy(), np.full((height, width), -1, np.int32)
        _nearest(planes, box, faded, rays[0], rays[1], near, front, layer, hit)
        if (hit < 0).all():
            break
        layers.append(hit)
        front = np.where(hit >= 0, layer, np.inf)
    return Visible(planes, rays, (*layers, face))


def depth_of(vertices: F64, triangles: I64, camera: Camera) -> F64:
    """[H, W] depth (camera z, metres) of a posed mesh at the middle of each pixel; infinite where it is not.

    Vertices [V, 3] in world space. Raises ValueError for a camera with skew.
    """
    return seen_of(vertices, triangles, camera)[0]


def seen_of(vertices: F64, triangles: I64, camera: Camera) -> tuple[F64, I32]:
    """(depth, triangle) [H, W] as `depth_of`; the triangle is -1 where there is none."""
    view = camera.camera_from_world.astype(np.float64)
    placed = vertices @ view[:3, :3].T + view[:3, 3]
    size = camera.width, camera.height
    planes, box = _prepared(placed, triangles, intrinsics(camera), 1, size, NEAR)
    depth = np.full((camera.height, camera.width), np.inf)
    face, front = np.full(depth.shape, -1, np.int32), np.zeros_like(depth)
    _nearest(planes, box, np.arange(len(triangles)), *ray_grid(camera, 1), NEAR, front, depth, face)
    return depth, face


def _check(surface: Surface) -> None:
    v, f = len(surface.vertices), len(surface.triangles)
    shapes = {
        "vertices": (v, 3),
        "triangles": (f, 3),
        "uv": (f, 3, 2),
        "gain": (v,),
        "gloss": (v,),
        "opacity": (v,),
    }
    for name, shape in shapes.items():
        if getattr(surface, name).shape != shape:
            raise ValueError(f"{name} is {getattr(surface, name).shape}, expected {shape}")
    if f and not 0 <= surface.triangles.min() <= surface.triangles.max() < v:
        raise ValueError(f"triangles name vertices beyond the {v} there are")


def intrinsics(camera: Camera) -> F64:
    """K [3, 3] in pixels, pixel centres at half integers, as `Camera.from_opencv` took it."""
    projection = camera.clip_from_world.astype(np.float64) @ np.linalg.inv(
        camera.camera_from_world.astype(np.float64)
    )
    to_pixels = np.array(
        [[camera.width / 2, 0, camera.width / 2], [0, camera.height / 2, camera.height / 2], [0, 0, 1]]
    )
    k: F64 = to_pixels @ projection[[0, 1, 3], :3]
    return k


def ray_grid(camera: Camera, samples: int) -> tuple[F64, F64]:
    """Directions (x [W S], y [H S]) of the rays (x, y, 1) in camera space; a skewed K is refused."""
    k = intrinsics(camera)
    if abs(k[0, 1]) > 1e-4 * abs(k[0, 0]):
        raise ValueError("a camera with skew cannot be drawn")
    x = (np.arange(camera.width * samples) + 0.5) / samples
    y = (np.arange(camera.height * samples) + 0.5) / samples
    return (x - k[0, 2]) / k[0, 0], (y - k[1, 2]) / k[1, 1]


def _prepared(
    placed: F64, triangles: I64, lens: F64, samples: int, size: tuple[int, int], near: float
) -> tuple[F64, I32]:
    """(planes [F, 4, 3], boxes [F, 4]) of `_planes`."""
    planes, box = np.zeros((len(triangles), 4, 3)), np.empty((len(triangles), 4), np.int32)
    _planes(placed, triangles.astype(np.int64), lens, samples, size, near, planes, box)
    return planes, box


@kernel()
def _planes(
    placed: F64,  # [V, 3] in camera space
    triangles: I64,  # [F, 3]
    lens: F64,  # [3, 3] K
    samples: int,
    size: tuple[int, int],  # samples across and down
    near: float,
    planes: F64,  # [F, 4, 3] zeros, changed
    box: I32,  # [F, 4] changed: samples x0 y0 x1 y1, ends excluded
) -> None:
    """Planes 0..2 go through the camera and the edge opposite a corner; on the ray r, planes[:3] @ r are in the
    ratio of the barycentric weights. Plane 3 [0] is the volume that, over their sum, is the depth."""
    for f in range(len(triangles)):
        nearest, farthest = np.inf, -np.inf
        for i in range(3):
            p, q = placed[triangles[f, (i + 1) % 3]], placed[triangles[f, (i + 2) % 3]]
            for k in range(3):  # p x q; exactly -(q x p), which keeps shared edges closed
                j, o = (k + 1) % 3, (k + 2) % 3
                planes[f, i, k] = p[j] * q[o] - p[o] * q[j]
            depth = placed[triangles[f, i], 2]
            nearest, farthest = min(nearest, depth), max(farthest, depth)
        a = placed[triangles[f, 0]]
        planes[f, 3, 0] = a[0] * planes[f, 0, 0] + a[1] * planes[f, 0, 1] + a[2] * planes[f, 0, 2]
        for axis in range(2):
            low, high = np.inf, -np.inf
            for i in range(3):
                corner = placed[triangles[f, i]]
                safe = corner[2] if corner[2] > near else np.inf
                place = (lens[axis, axis] * corner[axis] / safe + lens[axis, 2]) * samples
                low, high = min(low, place), max(high, place)
            most = float(size[axis])
            low, high = np.floor(low) - 1, np.ceil(high) + 1
            if nearest <= near:  # it reaches behind the camera
                low, high = 0.0, most
            if farthest <= near:
                high = 0.0
            box[f, axis] = int(min(max(low, 0.0), most))
            box[f, 2 + axis] = int(min(max(high, 0.0), most))


@kernel(parallel=True)
def _nearest(
    planes: F64,  # [F, 4, 3]
    box: I32,  # [F, 4]
    chosen: I64,  # triangles that count; the first wins at equal depth
    ray_x: F64,  # [w]
    ray_y: F64,  # [h]
    near: float,
    front: F64,  # [h, w] only what lies beyond counts
    depth: F64,  # [h, w] changed: of the nearest
    face: I32,  # [h, w] changed: its triangle
) -> None:
    rows = len(ray_y)
    for band in prange((rows + BAND - 1) // BAND):
        first, last = band * BAND, min((band + 1) * BAND, rows)
        for f in chosen:
            volume = planes[f, 3, 0]
            if box[f, 1] >= last or box[f, 3] <= first or volume == 0:
                continue
            for y in range(max(first, box[f, 1]), min(last, box[f, 3])):
                for x in range(box[f, 0], box[f, 2]):
                    rx, ry = ray_x[x], ray_y[y]
                    a = planes[f, 0, 0] * rx + planes[f, 0, 1] * ry + planes[f, 0, 2]
                    b = planes[f, 1, 0] * rx + planes[f, 1, 1] * ry + planes[f, 1, 2]
                    c = planes[f, 2, 0] * rx + planes[f, 2, 1] * ry + planes[f, 2, 2]
                    if not ((a >= 0 and b >= 0 and c >= 0) or (a <= 0 and b <= 0 and c <= 0)):
                        continue
                    total = a + b + c
                    if total == 0:
                        continue
                    z = volume / total
                    if z >= near and z > front[y, x] and z < depth[y, x]:
                        depth[y, x] = z
                        face[y, x] = f


def _shade(
    surface: Surface, planes: F64, rays: tuple[F64, F64], face: I32, colour: F32, through: F32
) -> None:
    """Composite the triangles `face` [h, w] behind `colour` [h, w, 3], which `through` [h, w] lets pass; in place."""
    _shade_rows(
        planes,
        surface.triangles,
        surface.uv,
        surface.texture,
        surface.gain,
        surface.gloss,
        surface.opacity,
        rays[0],
        rays[1],
        face,
        colour,
        through,
    )


@kernel(parallel=True)
def _shade_rows(
    planes: F64,
    triangles: I64,
    uv: F32,
    texture: F32,
    gain: F32,
    gloss: F32,
    opacity: F32,
    ray_x: F64,
    ray_y: F64,
    face: I32,
    colour: F32,
    through: F32,
) -> None:
    h, w = texture.shape[:2]
    for y in prange(len(ray_y)):
        for x in range(len(ray_x)):
            f = face[y, x]
            if f < 0:
                continue
            u, v, light, shine, cover, total = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for i in range(3):
                share = planes[f, i, 0] * ray_x[x] + planes[f, i, 1] * ray_y[y] + planes[f, i, 2]
                corner = triangles[f, i]
                total += share
                u += share * uv[f, i, 0]
                v += share * uv[f, i, 1]
                light += share * gain[corner]
                shine += share * gloss[corner]
                cover += share * opacity[corner]
            tx = min(max(u / total * w - 0.5, 0.0), w - 1.0)
            ty = min(max(v / total * h - 0.5, 0.0), h - 1.0)
            left, top = int(tx), int(ty)
            right, bottom = min(left + 1, w - 1), min(top + 1, h - 1)
            sx, sy = tx - left, ty - top
            share = cover / total * through[y, x]
            for channel in range(3):
                above = texture[top, left, channel] * (1 - sx) + texture[top, right, channel] * sx
                below = texture[bottom, left, channel] * (1 - sx) + texture[bottom, right, channel] * sx
                lit = (above * (1 - sy) + below * sy) * light / total + shine / total
                colour[y, x, channel] += share * min(max(lit, 0.0), 1.0)
            through[y, x] -= share


def pixels(colour: F32, through: F32, samples: int) -> MeshImage:
    """The mean over each pixel's rays of `colour` [H S, W S, 3], which is multiplied by alpha, 1 - `through`."""
    height, width = (n // samples for n in through.shape)
    alpha = 1 - through.reshape(height, samples, width, samples).mean(axis=(1, 3), dtype=np.float64)
    mean = colour.reshape(height, samples, width, samples, 3).mean(axis=(1, 3), dtype=np.float64)
    straight = np.divide(mean, alpha[..., None], out=np.zeros_like(mean), where=alpha[..., None] > 1e-6)
    return MeshImage(straight.astype(np.float32), np.clip(alpha, 0, 1).astype(np.float32))
