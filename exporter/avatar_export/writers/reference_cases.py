"""The poses and cameras of a bundle's reference, which follow from the avatar."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from avatar_export.images import FARTHEST, animated_rows, frame_camera, seen
from avatar_runtime.avatar import Avatar, RasterSettings
from avatar_runtime.camera import Camera
from avatar_runtime.clips import frame_pose
from avatar_runtime.conformance import Case
from avatar_runtime.conformance.make import ROWS
from avatar_runtime.conformance.rows import thinned
from avatar_runtime.light import DirectLight, Light
from avatar_runtime.player import ABSURD
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.project import project
from avatar_schema import constants

SIZE = 256  # pixels, of an image
# Its last tiles reach far beyond it, so that splats beside the image are drawn.
CLOSE_SIZE = 2 * int(constants()["tile"]) + 1
GOLDEN = (np.sqrt(5) - 1) / 2  # its multiples modulo 1 are all different and evenly spaced
LARGEST_WEIGHT = 3.0  # ranges of expressions are clamped to +- this
MOST_TURN = np.radians(9.0)  # of a joint
WORLD_TURN = (0.15, 0.6, -0.1)  # rotation vector, radians
WORLD_MOVE = (0.04, -0.03, 0.06)  # metres
FRONT = (0.0, 0.0)  # yaw, pitch of the camera, radians
ASIDE = (0.35, 0.2)
NARROWEST, WIDEST = 1e-3, 4.0  # tangent of half the field of view
STEPS = 64  # candidates for the camera inside the avatar
Points = npt.NDArray[np.float64]
# Sun from above the left cheek, blue light from behind, and a lamp at half a metre; more light from above than below.
LIGHT = Light(
    np.outer([0.9, -0.25, 0.1, -0.08, 0.03, -0.05, 0.06, 0.04, -0.02], [0.8, 0.95, 1.2]).astype(np.float32),
    (
        DirectLight((0.7, 0.9, 0.8), (1.2, 1.05, 0.85)),
        DirectLight((-0.6, 0.3, -0.7), (0.2, 0.3, 0.7)),
        DirectLight((-0.4, 0.1, 0.5), (0.12, 0.06, 0.02), point=True),
    ),
    shadow=True,
)
DRAWN = ("rest", "posed", "clip")  # cases with images


def reference_cases(avatar: Avatar) -> tuple[Case, ...]:
    """The cases: at rest, with every input of `avatar`, the same from inside it, and a frame inside its first clip.

    The case from inside has vectors only; an avatar without clips has no case `clip`. An avatar that takes a light is
    at rest as trained, from inside in a light without a shadow, posed in one with a shadow.
    """
    lit = None if avatar.relight is None else LIGHT
    still = None if lit is None else replace(lit, shadow=False)
    posed = every_input(avatar)
    rest = "nothing is posed: files, camera, SH from the front, raster"
    every = "every expression, joint and late morph that there is, the whole turned and moved: SH follow"
    close = "from within: behind the camera, before the near plane, beyond the Jacobian's clamp, on no tile"
    cases = [
        Case("rest", rest, Pose(), _framed(avatar, Pose(), FRONT)),
        Case("posed", every, posed, _framed(avatar, posed, ASIDE), light=lit),
        Case("close", close, posed, close_camera(avatar, posed), images=False, light=still),
    ]
    if avatar.clips:
        clip = avatar.clips[0]
        frame = clip.frames // 2
        pose = frame_pose(avatar, clip, frame)
        why = f"frame {frame} of clip {clip.name!r}"
        cases.append(Case("clip", why, pose, _framed(avatar, pose, ASIDE)))
    return tuple(cases)


def _framed(avatar: Avatar, pose: Pose, view: tuple[float, float]) -> Camera:
    return frame_camera(seen(avatar, pose), SIZE, SIZE, *view)


def every_input(avatar: Avatar) -> Pose:
    """A pose in which no weight is 0, no two are equal, and every joint rotates about another axis.

    Weights are in their ranges; they get smaller the more there are, so that the avatar stays recognisable.
    """
    expressions, late = avatar.expressions, avatar.eyelids
    ends = np.clip([e.range[1] or e.range[0] for e in expressions], -LARGEST_WEIGHT, LARGEST_WEIGHT)
    weights = ends * _spread(len(expressions)) * min(1.0, 4.0 / np.sqrt(max(1, len(expressions))))
    joints = avatar.rig.joint_names if avatar.rig else ()
    turn = MOST_TURN * np.stack([_spread(len(joints), k) - 0.6 for k in range(3)], axis=-1)
    return Pose(
        dict(zip(avatar.expression_names, weights.tolist(), strict=True)),
        dict(zip(joints, homogeneous(matrix_from_rotvec(turn)), strict=True)),
        dict(zip(late, _spread(len(late)).tolist(), strict=True)),
        homogeneous(matrix_from_rotvec(np.array(WORLD_TURN)), np.array(WORLD_MOVE)),
    )


@ABSURD
def close_camera(avatar: Avatar, pose: Pose) -> Camera:
    """A camera among the Gaussians that a reference keeps, to test the thresholds of stage project.

    It looks along the longest axis. Its position and field of view are chosen so that none of these cases is rare:
    behind the camera, before the near plane, drawn, drawn beyond the Jacobian's clamp, on no tile.
    """
    splats = animated_rows(avatar, thinned(avatar, ROWS).rows, pose)[0]
    mean = np.clip(np.nan_to_num(splats.mean.astype(np.float64)), -FARTHEST, FARTHEST)
    middle = np.median(mean, axis=0)
    along = np.linalg.svd(mean - middle, full_matrices=False)[2][0]
    near, depth = avatar.raster.near, (mean - middle) @ along
    low, high = np.percentile(depth, [2, 98])
    eye = max(np.linspace(low - near, high, STEPS), key=lambda at: _along(depth - at, near))
    yaw, pitch = np.arctan2(-along[0], -along[2]), np.arcsin(np.clip(-along[1], -1, 1))
    orbit = (middle, -float(eye), float(yaw), float(pitch))
    cameras = [
        Camera.orbit(*orbit, float(2 * np.arctan(tangent)), CLOSE_SIZE, CLOSE_SIZE)
        for tangent in np.geomspace(NARROWEST, WIDEST, STEPS)
    ]
    return max(cameras, key=lambda camera: _across(splats, camera, avatar.raster))


def _along(z: Points, near: float) -> float:
    """How evenly depths are spread; those beyond the near plane count twice, since `_across` divides them."""
    behind, beyond = int((z <= 0).sum()), int((z > near).sum())
    return _evenly(behind, len(z) - behind - beyond, beyond, beyond)


def _across(splats: Splats, camera: Camera, settings: RasterSettings) -> float:
    """How evenly Gaussians beyond the near plane are spread over: in the image, beyond the clamp, on no tile."""
    drawn = project(splats, camera, settings, 0).radius > 0
    view = camera.camera_from_world
    x, y, z = (splats.mean @ view[:3, :3].T + view[:3, 3]).T
    tangent = constants()["frustum_clamp"] * camera.tan_half_fov_x
    aside = np.maximum(np.abs(x), np.abs(y)) > tangent * z
    hidden = ~drawn & (z > settings.near)
    return _evenly(int((drawn & ~aside).sum()), int((drawn & aside).sum()), int(hidden.sum()))


def _evenly(*counts: int) -> float:
    """A score that is largest for even counts; a count of 0 is worst."""
    return float(np.sum(np.log1p(counts)))


def _spread(count: int, offset: int = 0) -> npt.NDArray[np.float64]:
    """`count` different numbers in 0.1..1."""
    part: npt.NDArray[np.float64] = (np.arange(count) + 1 + 0.3 * offset) * GOLDEN * (1 + offset) % 1
    return 0.1 + 0.9 * part
