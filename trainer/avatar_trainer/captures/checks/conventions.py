"""The other conventions in which cameras are written, and the right camera for numbers that are in one of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from avatar_runtime import F64

OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])  # camera axes: y up, z backwards
Y_FROM_Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # world axes


@dataclass(frozen=True)
class View:
    """A camera as numbers, whatever convention they are read in."""

    intrinsics: F64  # [3, 3] pixels
    camera_from_world: F64  # [4, 4]
    world_from_avatar: F64  # [4, 4]
    width: int
    height: int


@dataclass(frozen=True)
class Convention:
    """Another way to write a camera. `read` gives the right camera, if the capture's were written in this one."""

    what: str  # the numbers are, in words
    mend: str  # what to write
    read: Callable[[View], View]


def _view(change: Callable[[F64], F64]) -> Callable[[View], View]:
    return lambda view: replace(view, camera_from_world=change(view.camera_from_world))


def _lengths(factor: float) -> Callable[[View], View]:
    scale = np.ones((4, 4))
    scale[:3, 3] = factor
    return lambda view: replace(
        view,
        camera_from_world=view.camera_from_world * scale,
        world_from_avatar=view.world_from_avatar * scale,
    )


def _pixels(factor: float) -> Callable[[View], View]:
    return lambda view: replace(view, intrinsics=np.diag([factor, factor, 1.0]) @ view.intrinsics)


def _normalised(view: View) -> View:
    return replace(view, intrinsics=np.diag([view.width, view.height, 1.0]) @ view.intrinsics)


def _clip_space(view: View) -> View:
    half = np.array([[view.width / 2, 0, view.width / 2], [0, view.height / 2, view.height / 2], [0, 0, 1]])
    return replace(view, intrinsics=half @ view.intrinsics)


def _mirrored(view: View) -> View:
    flip = np.array([[-1.0, 0, view.width], [0, 1, 0], [0, 0, 1]])
    return replace(view, intrinsics=flip @ view.intrinsics)


def _swapped_axes(view: View) -> View:
    k = view.intrinsics
    return replace(view, intrinsics=np.array([[k[1, 1], k[0, 1], k[1, 2]], [0, k[0, 0], k[0, 2]], [0, 0, 1]]))


def _inverse(matrix: F64) -> F64:
    return np.linalg.inv(matrix).astype(np.float64)


def _transposed_rotation(matrix: F64) -> F64:
    result = matrix.copy()
    result[:3, :3] = matrix[:3, :3].T
    return result


def _centre(matrix: F64) -> F64:
    result = matrix.copy()
    result[:3, 3] = -matrix[:3, :3] @ matrix[:3, 3]
    return result


def _inverse_motion(view: View) -> View:
    return replace(view, world_from_avatar=_inverse(view.world_from_avatar))


CONVENTIONS = (
    Convention(
        "cameras of OpenGL (y up, z backwards)", "negate rows 1 and 2 of R and t", _view(lambda m: OPENGL @ m)
    ),
    Convention("world from camera", "write the inverse: R transposed, t = -R^T t", _view(_inverse)),
    Convention(
        "world from camera with the axes of OpenGL (NeRF's transform_matrix)",
        "negate columns 1 and 2, then write the inverse",
        _view(lambda m: _inverse(m @ OPENGL)),
    ),
    Convention("rotations of world from camera", "transpose R", _view(_transposed_rotation)),
    Convention("the camera's position in the world as t", "write t = -R position", _view(_centre)),
    Convention("of a world with z up", "turn the world: y up", _view(lambda m: m @ Y_FROM_Z_UP)),
    Convention("of a world with y down", "turn the world: y up", _view(lambda m: m @ OPENGL)),
    Convention("translations in millimetres", "divide t by 1000: lengths are metres", _lengths(1e-3)),
    Convention("translations in centimetres", "divide t by 100: lengths are metres", _lengths(1e-2)),
    Convention(
        "translations of a world 4 times as large (IMavatar's)",
        "divide t by 4: lengths are metres",
        _lengths(0.25),
    ),
    Convention("in metres beside a body in millimetres", "divide the body's lengths by 1000", _lengths(1e3)),
    Convention("in metres beside a body in centimetres", "divide the body's lengths by 100", _lengths(1e2)),
    Convention("K in fractions of the image", "multiply K by width and height", _normalised),
    Convention("K in clip space (-1 to 1)", "write K in pixels", _clip_space),
    Convention("K of images twice as large", "divide K by 2", _pixels(0.5)),
    Convention("K of images four times as large", "divide K by 4", _pixels(0.25)),
    Convention("K of images half as large", "multiply K by 2", _pixels(2.0)),
    Convention("K of images a quarter as large", "multiply K by 4", _pixels(4.0)),
    Convention("K with width and height exchanged", "exchange fx with fy and cx with cy", _swapped_axes),
    Convention("cameras of images that are not mirrored", "mirror images and masks back", _mirrored),
    Convention(
        "avatar from world in world_from_avatar", "write the inverse of world_from_avatar", _inverse_motion
    ),
)
