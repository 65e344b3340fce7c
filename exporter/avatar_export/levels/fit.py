"""Fits a merged avatar to images of its source: colours, opacities, scales and rotations, by the gradient.

Means stay where merging put them. Moving them was tried, in the world and along each Gaussian's own axes, and made
other poses worse where Gaussians are embedded: one high above a mesh moves on a lever, differently in every pose.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from avatar_export.levels.compositing import Flat, FlatGradient, squared_error
from avatar_export.levels.mixing import entry_rows, unit
from avatar_export.levels.views import LEVEL_POSES, SIZE, View, flattened, views
from avatar_export.ops.normals import turned_axes
from avatar_runtime.avatar import F32, F64, Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.player import Player
from avatar_runtime.rotation import matrix_from_quat, quat_multiply
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.raster import Image
from avatar_schema import constants

# A step looks at every first, second or third pixel across and down, so that about this many show the avatar: bodies
# are thin. Which ones changes from step to step.
LOOKED_AT, STRIDE = 9000, 3
# The largest change of a step: of log scales, of radians about a Gaussian's own axes, of opacity logits, of DC colour.
RATES = {"log_scale": 0.03, "turn": 0.03, "opacity_logit": 0.1, "colour": 0.01}
# Pixels along the edge of the images, in turn. The rasteriser's low-pass dilates small Gaussians in small images, which
# are those that coarse levels are shown in.
SIZES = (SIZE, SIZE, SIZE, 160, SIZE, 80)
LAST_RATE = 0.1  # of the first, at the end of a half cosine
FIRST_DECAY, SECOND_DECAY = 0.8, 0.95  # Adam's
QUIET = 0.3  # of the mean gradient: what lies well below it hardly moves
SEED = 3
BLACK = (0.0, 0.0, 0.0)

Change = Mapping[str, F64]


def fitted(source: Avatar, level: Avatar, steps: int) -> Avatar:
    """`level` after `steps` steps of Adam (Kingma and Ba, 2015) towards images of `source`, another view each."""
    n = level.gaussians.count
    shapes = {name: (n, 3) if name != "opacity_logit" else (n,) for name in RATES}
    first = {name: np.zeros(shape) for name, shape in shapes.items()}
    second = {name: np.zeros(shape) for name, shape in shapes.items()}
    truth, rng = Player(source), np.random.default_rng(SEED)
    for step, view in enumerate(views(source, steps, SIZES, LEVEL_POSES)):
        image = truth.frame(view.pose, view.camera, BLACK).image
        covered = int(np.count_nonzero(image.transmittance < 0.5))
        stride = min(STRIDE, max(1, round(np.sqrt(covered / LOOKED_AT))))
        x, y = rng.integers(0, stride, 2).tolist()
        gradient = _gradient(level, image, view, stride, (x, y))
        rate = LAST_RATE + (1 - LAST_RATE) * (1 + np.cos(np.pi * step / steps)) / 2
        change = {}
        for name, slope in gradient.items():
            first[name] = FIRST_DECAY * first[name] + (1 - FIRST_DECAY) * slope
            second[name] = SECOND_DECAY * second[name] + (1 - SECOND_DECAY) * slope**2
            size = np.sqrt(second[name] / (1 - SECOND_DECAY ** (step + 1)))
            quiet = QUIET * np.sqrt(np.mean(size**2)) + 1e-30
            mean = first[name] / (1 - FIRST_DECAY ** (step + 1))
            change[name] = -RATES[name] * rate * mean / (size + quiet)
        level = changed(level, change)
    return level


def changed(avatar: Avatar, change: Change) -> Avatar:
    """`avatar` with `change` added to what stands under the names of RATES, in every pose alike."""
    g, shapes, embedding = avatar.gaussians, avatar.blendshapes, avatar.embedding
    half = np.concatenate([np.ones((g.count, 1)), change["turn"] / 2], axis=1)
    turn = unit(half)
    sh = g.sh.copy()
    sh[:, 0] += (change["colour"] / constants()["sh_c0"][0]).astype(np.float32)
    gaussians = replace(
        g,
        log_scale=(g.log_scale + change["log_scale"]).astype(np.float32),
        quat_wxyz=_multiplied(g.quat_wxyz, turn),
        opacity_logit=(g.opacity_logit + change["opacity_logit"]).astype(np.float32),
        sh=sh,
    )
    deltas = shapes.geometry.values["quat_wxyz"]
    if len(deltas):
        turned = _multiplied(deltas, turn[entry_rows(shapes.geometry)])
        values = {**shapes.geometry.values, "quat_wxyz": turned}
        shapes = replace(shapes, geometry=replace(shapes.geometry, values=values))
    if embedding is not None:
        embedding = replace(embedding, local_quat_wxyz=_multiplied(embedding.local_quat_wxyz, turn))
    relight = None if avatar.relight is None else turned_axes(avatar.relight, turn)
    return replace(avatar, gaussians=gaussians, blendshapes=shapes, embedding=embedding, relight=relight)


def _multiplied(quat: F32, turn: F64) -> F32:
    result: F32 = quat_multiply(quat.astype(np.float64), turn).astype(np.float32)
    return result


def _gradient(level: Avatar, image: Image, view: View, stride: int, first: tuple[int, int]) -> Change:
    """The gradient of the squared error against `image` at every `stride`-th pixel from `first` on, by RATES."""
    x, y = first
    splats = Player(level).animate(view.pose)
    flat = flattened(level, splats, view.camera, stride, first)
    target, left = image.colour[y::stride, x::stride], image.transmittance[y::stride, x::stride]
    slopes = of_gaussians(splats, view.camera, stride, flat, squared_error(flat, target, left)[1])
    result = {}
    for name, slope in slopes.items():
        result[name] = np.zeros((len(splats.mean), *slope.shape[1:]))
        result[name][flat.row] = slope
    return result


def of_gaussians(splats: Splats, camera: Camera, stride: int, flat: Flat, gradient: FlatGradient) -> Change:
    """From a gradient on the screen, of splats `flat` that `camera` sees at every `stride`-th pixel: [n, ...] by RATES.

    The Jacobian of the projection and the direction of SH count as fixed.
    """
    a, b, c = flat.conic.T.astype(np.float64)
    by_a, by_b, by_c = gradient.conic.T
    conic, slope = _symmetric(a, b, c), _symmetric(by_a, by_b / 2, by_c)
    by_covariance = -conic @ slope @ conic * stride**-2  # in full pixels
    rows = flat.row
    axes = matrix_from_quat(unit(splats.quat_wxyz[rows]))
    local = _pixels_by_world(splats.mean[rows].astype(np.float64), camera) @ axes  # [n, 2, 3]
    by_local = np.swapaxes(local, 1, 2) @ by_covariance @ local  # of R^T Sigma R
    variance = splats.scale[rows].astype(np.float64) ** 2
    i, j = [1, 2, 0], [2, 0, 1]
    opacity = flat.opacity.astype(np.float64)
    return {
        "log_scale": 2 * variance * by_local[:, [0, 1, 2], [0, 1, 2]],
        "turn": 2 * (variance[:, i] - variance[:, j]) * by_local[:, i, j],
        "opacity_logit": gradient.opacity * opacity * (1 - opacity),
        "colour": np.where(flat.rgb > 0, gradient.rgb, 0),
    }


def _symmetric(a: F64, b: F64, c: F64) -> F64:
    """[n, 2, 2] of xx, xy, yy."""
    return np.stack([np.stack([a, b], axis=-1), np.stack([b, c], axis=-1)], axis=-2)


def _pixels_by_world(mean: F64, camera: Camera) -> npt.NDArray[np.float64]:
    """[n, 2, 3] the Jacobian of the projection at world positions [n, 3]."""
    view = camera.camera_from_world.astype(np.float64)
    x, y, z = (mean @ view[:3, :3].T + view[:3, 3]).T
    focal_x, focal_y = (
        camera.width / (2 * camera.tan_half_fov_x),
        camera.height / (2 * camera.tan_half_fov_y),
    )
    zero = np.zeros(len(z))
    across = np.stack([focal_x / z, zero, -focal_x * x / z**2], axis=1)
    down = np.stack([zero, focal_y / z, -focal_y * y / z**2], axis=1)
    return np.stack([across, down], axis=1) @ view[:3, :3]
