"""A pinhole camera in the trainer's convention: +x right, +y down, +z forward, pixel centres at integers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, F64
from avatar_runtime.checks import arguments

CLIP_NEAR, CLIP_FAR = (
    0.01,
    100.0,
)  # of the projection matrix only; RasterSettings.near decides what is drawn
WIDEST = 1 << 15  # pixels; an image of such sides has 2^30, which indices of 32 bits count
ROTATION_TOLERANCE = 1e-3  # of any entry of R R^T - I


@dataclass(frozen=True)
class Camera:
    """Row-major matrices for column vectors, float32 as the rasteriser takes them.

    Raises TypeError or ValueError for arrays of another shape and for sizes that are not 1 to WIDEST pixels.
    """

    camera_from_world: F32  # [4, 4]
    clip_from_world: F32  # [4, 4] projection @ camera_from_world
    centre: F32  # [3] world
    tan_half_fov_x: float  # width / (2 fx)
    tan_half_fov_y: float  # height / (2 fy)
    width: int
    height: int

    def __post_init__(self) -> None:
        """Brings every field to its type."""
        for name, shape in (("camera_from_world", (4, 4)), ("clip_from_world", (4, 4)), ("centre", (3,))):
            value = getattr(self, name)
            if not (isinstance(value, np.ndarray) and value.dtype == np.float32 and value.shape == shape):
                with np.errstate(over="ignore"):  # beyond float32 becomes infinite, and nothing is drawn
                    self._set(name, arguments.array(name, value, shape).astype(np.float32))
        for name in ("tan_half_fov_x", "tan_half_fov_y"):
            self._set(name, arguments.real(name, getattr(self, name)))
        for name in ("width", "height"):
            self._set(name, arguments.whole(name, getattr(self, name), 1, WIDEST))

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def mirrored(self) -> Camera:
        """The camera that sees the same image of the mirrored world, whose x is negated (`handedness.mirrored`).

        Camera space stays as it is, so camera_from_world takes S = diag(-1, 1, 1) first: its determinant is -1.
        """
        signs = np.array([-1, 1, 1, 1], np.float32)
        return replace(
            self,
            camera_from_world=self.camera_from_world * signs,
            clip_from_world=self.clip_from_world * signs,
            centre=self.centre * signs[:3],
        )

    @staticmethod
    def from_opencv(
        rotation: npt.NDArray[Any],  # [3, 3]
        translation: npt.NDArray[Any],  # [3]
        intrinsics: npt.NDArray[Any],  # [3, 3] K, pixels, pixel centres at half integers
        width: int,
        height: int,
    ) -> Camera:
        """x_camera = rotation @ x_world + translation, x_pixel = K x_camera / z - 0.5.

        The principal point moves the centres; the Jacobian's clamp stays about the optical axis, as trained.
        Raises TypeError or ValueError for an argument of another type or shape, for a rotation that is none, and for
        intrinsics that are not [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] with positive focal lengths.
        """
        width, height = (
            arguments.whole(name, size, 1, WIDEST) for name, size in (("width", width), ("height", height))
        )
        view = np.eye(4)
        view[:3, :3] = _rotation(rotation)
        view[:3, 3] = arguments.finite_array("translation", translation, (3,))
        k = _intrinsics(intrinsics)
        fx, fy, skew, cx, cy = k[0, 0], k[1, 1], k[0, 1], k[0, 2], k[1, 2]
        rows = [
            [2 * fx / width, 2 * skew / width, 2 * cx / width - 1, 0],
            [0, 2 * fy / height, 2 * cy / height - 1, 0],
        ]
        with np.errstate(over="ignore"):  # beyond float32 becomes infinite, and nothing is drawn
            centre = -view[:3, :3].T @ view[:3, 3]
            return _camera(view, centre, rows, (width / (2 * fx), height / (2 * fy)), width, height)

    @staticmethod
    def from_opengl(
        view: npt.NDArray[Any],  # [4, 4] camera from world
        projection: npt.NDArray[Any],  # [4, 4]
        width: int,
        height: int,
    ) -> Camera:
        """The camera of an engine: matrices for column vectors as OpenGL has them, y up, looking along -z.

        A projection for cameras that look along +z is recognised by its last row. Its depth range does not matter.
        Raises TypeError or ValueError for an argument of another type or shape, for numbers that are not finite or
        whose camera is beyond float32, for a view without an inverse, and for a projection without perspective and one
        that mirrors the image or turns it over.
        """
        width, height = (
            arguments.whole(name, size, 1, WIDEST) for name, size in (("width", width), ("height", height))
        )
        seen = arguments.finite_array("view", view, (4, 4))
        given = arguments.finite_array("projection", projection, (4, 4))
        along = given[3, 2]  # clip w = along * z of the engine's camera
        if not abs(along) > 1e-6 or abs(given[3, 3]) > 1e-6:
            raise ValueError("projection has no perspective; an orthographic camera cannot show an avatar")
        axes = np.array([1, -1, np.sign(along)])  # ours in the engine's camera
        rows = given[:2, :3] * axes[:2, None] * axes / abs(along)
        if not (rows[0, 0] > 0 and rows[1, 1] > 0):
            raise ValueError("projection mirrors the image or turns it over; give that of an image with y up")
        own = np.eye(4)
        own[:3] = seen[:3] * axes[:, None]
        with np.errstate(all="ignore"):  # refused below
            centre = -_inverse(own[:3, :3]) @ own[:3, 3]
            tangents = 1 / rows[0, 0], 1 / rows[1, 1]
            made = _camera(own, centre, np.pad(rows, ((0, 0), (0, 1))), tangents, width, height)
        parts = (made.camera_from_world, made.clip_from_world, made.centre)
        if not all(np.isfinite(part).all() for part in parts):
            raise ValueError("view has no inverse, or the camera holds a number beyond float32")
        return made

    @staticmethod
    def orbit(
        target: npt.NDArray[Any],  # [3] world
        distance: float,
        yaw: float,  # radians about +Y; positive moves the camera to +X
        pitch: float,  # radians; positive moves the camera up
        fov_y: float,  # radians
        width: int,
        height: int,
    ) -> Camera:
        """A camera that looks at `target`; at yaw 0 it is in front of a face that looks along +Z.

        Raises TypeError or ValueError for an argument of another type or shape, a number that is not finite, and an
        `fov_y` that is not between 0 and pi.
        """
        target = arguments.finite_array("target", target, (3,))
        for name, value in (("distance", distance), ("yaw", yaw), ("pitch", pitch), ("fov_y", fov_y)):
            arguments.finite(name, value)
        if not 0 < fov_y < np.pi:
            raise ValueError(f"fov_y is {fov_y} radians; more than 0 and less than pi is needed")
        width, height = (
            arguments.whole(name, size, 1, WIDEST) for name, size in (("width", width), ("height", height))
        )
        away = np.array([np.sin(yaw) * np.cos(pitch), np.sin(pitch), np.cos(yaw) * np.cos(pitch)])
        right = np.array([np.cos(yaw), 0.0, -np.sin(yaw)])
        forward = -away
        down = np.cross(forward, right)
        rotation = np.stack([right, down, forward])
        eye = target + distance * away
        focal = height / (2 * np.tan(fov_y / 2))
        k = np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]])
        return Camera.from_opencv(rotation, -rotation @ eye, k, width, height)


def _camera(
    view: F64, centre: F64, rows: Any, tangents: tuple[float, float], width: int, height: int
) -> Camera:
    """Everything that follows from camera_from_world and the first two rows of the projection."""
    depth = CLIP_FAR / (CLIP_FAR - CLIP_NEAR)
    projection = np.array([*rows, [0, 0, depth, -depth * CLIP_NEAR], [0, 0, 1, 0]])
    return Camera(
        view.astype(np.float32),
        (projection @ view).astype(np.float32),
        centre.astype(np.float32),
        float(np.float32(tangents[0])),
        float(np.float32(tangents[1])),
        width,
        height,
    )


def _inverse(linear: F64) -> F64:
    """Of [3, 3]; of a matrix without one, NaN."""
    try:
        return np.linalg.inv(linear).astype(np.float64, copy=False)
    except np.linalg.LinAlgError:
        return np.full((3, 3), np.nan)


def _rotation(value: Any) -> F64:
    """`value` as a rotation [3, 3]; raises as `Camera.from_opencv`."""
    found = arguments.finite_array("rotation", value, (3, 3))
    with np.errstate(over="ignore", invalid="ignore"):
        off = float(np.abs(found @ found.T - np.eye(3)).max())
    if not off <= ROTATION_TOLERANCE:
        raise ValueError(f"rotation is not a rotation matrix: an entry of R R^T - I is {off:.3g}")
    if np.linalg.det(found) < 0:
        raise ValueError("rotation is not a rotation matrix: its determinant is -1, it mirrors")
    return found


def _intrinsics(value: Any) -> F64:
    """`value` as a camera matrix K [3, 3]; raises as `Camera.from_opencv`."""
    found = arguments.finite_array("intrinsics", value, (3, 3))
    if found[1, 0] != 0 or found[2].tolist() != [0, 0, 1]:
        raise ValueError("intrinsics are not [[fx, skew, cx], [0, fy, cy], [0, 0, 1]]")
    if not (found[0, 0] > 0 and found[1, 1] > 0):
        raise ValueError(
            f"intrinsics: the focal lengths are {found[0, 0]:g} and {found[1, 1]:g} pixels; positive ones are needed"
        )
    return found
