"""Tracked cameras, as captures store them beside their images.

- capture.json (this project): K in pixels, R and t camera from world, OpenCV axes, metres.
- transforms*.json (NeRF, as VHAP and GaussianAvatars' data sets write it): fl_x, fl_y, cx, cy, w, h;
  transform_matrix is world from camera with the axes of OpenGL.
- flame_params.json (IMavatar): intrinsics as fractions of the image; world_mat is camera from world with y up and z
  backwards, of a world four times as large.
- NAME.frame (metrical-tracker): opencv.K, R and t as in capture.json.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from avatar_export.formats.json_text import parse_json
from avatar_export.formats.npy import ComputedArray, StoredArray
from avatar_export.formats.pth import read_frame
from avatar_runtime.avatar import F64
from avatar_runtime.camera import Camera
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.whole_files import read_bytes

MAX_FILE_BYTES = 512 << 20
MAX_CAMERAS = 100_000
MAX_VALUE = 1e6
MAX_SIDE = 8192  # pixels of an image
IMAVATAR_UNITS = 4.0  # of flame_params.json in a metre
IMAVATAR_AXES = np.array([[1.0], [-1.0], [-1.0]])  # signs of the rows of world_mat
OPENGL_AXES = np.diag([1.0, -1.0, -1.0, 1.0])  # y up, z backwards
ROTATION_TOLERANCE = 1e-3  # of any entry of R R^T - I
# The files of a capture's folder that hold its cameras; the first pattern that matches is read.
PATTERNS = (
    "capture.json",
    "checkpoint/*.frame",
    "flame_params.json",
    "transforms.json",
    "transforms_test.json",
)
Object = Mapping[str, Any]


@dataclass(frozen=True)
class TrackedCamera:
    """One tracked camera."""

    intrinsics: F64  # [3, 3] pixels, pixel centres at half integers; without `size`, fractions of the image
    camera_from_world: F64  # [4, 4] OpenCV axes, metres
    size: tuple[int, int] | None  # width, height of the images it was tracked in

    def of_size(self, width: int, height: int) -> Camera:
        """The same view on `width` x `height` pixels."""
        across, down = self.size or (1, 1)
        k = np.diag([width / across, height / down, 1.0]) @ self.intrinsics
        return Camera.from_opencv(
            self.camera_from_world[:3, :3], self.camera_from_world[:3, 3], k, width, height
        )


def read_cameras(path: Path) -> list[TrackedCamera]:
    """The cameras in one of the files above, or in a capture's folder, in the order of the frames.

    Raises AvatarError for any other file, for missing or unusable numbers, and for an R that is no rotation.
    """
    if path.is_dir():
        found = next((files for pattern in PATTERNS if (files := sorted(path.glob(pattern)))), None)
        if found is None:
            raise AvatarError(f"holds no tracked cameras: none of {', '.join(PATTERNS)}", file=path)
        return [camera for file in found[:MAX_CAMERAS] for camera in _of_file(file)]
    return _of_file(path)


def from_transform(matrix: F64) -> F64:
    """[4, 4] camera from world, OpenCV, of a NeRF transform_matrix. Raises LinAlgError for a singular one."""
    return np.linalg.inv(matrix @ OPENGL_AXES).astype(np.float64)


def from_world_mat(world_mat: F64) -> F64:
    """[4, 4] camera from world, OpenCV, metres, of an IMavatar world_mat [3, 4]."""
    result = np.eye(4)
    result[:3] = world_mat * IMAVATAR_AXES
    result[:3, 3] /= IMAVATAR_UNITS
    return result


def numbers(value: object, shape: tuple[int, ...], file: Path, field: str) -> F64:
    """Numbers from JSON, of `shape` and finite. Raises AvatarError for anything else."""
    try:
        found = np.array(value, np.float64)
    except (TypeError, ValueError, OverflowError):
        found = np.zeros(0)
    if found.shape != shape or not (np.abs(found) <= MAX_VALUE).all():
        wanted = ", ".join(map(str, shape)) or "one"
        raise AvatarError(f"does not hold usable numbers [{wanted}]", file=file, field=field)
    return found


def pinhole(fx: float, fy: float, cx: float, cy: float) -> F64:
    """K [3, 3]."""
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])


def transform_camera(frame: Object, whole: Object, file: Path, at: str) -> TrackedCamera:
    """The camera of one frame of a transforms.json; numbers that the frame lacks are those of the `whole` document."""

    def number(name: str) -> float:
        return float(numbers(frame.get(name, whole.get(name)), (), file, f"{at}.{name}"))

    width, height = number("w"), number("h")
    if not all(1 <= side <= MAX_SIDE and side == int(side) for side in (width, height)):
        raise AvatarError(
            f"are {width:g} and {height:g}, expected sizes in pixels", file=file, field=f"{at}.w, h"
        )
    k = pinhole(number("fl_x"), number("fl_y"), number("cx"), number("cy"))
    matrix = numbers(frame.get("transform_matrix"), (4, 4), file, f"{at}.transform_matrix")
    if (matrix[3] != (0, 0, 0, 1)).any() or abs(np.linalg.det(matrix)) < 1e-6:
        raise AvatarError(
            "is not a rigid motion with a last row 0 0 0 1", file=file, field=f"{at}.transform_matrix"
        )
    return TrackedCamera(k, from_transform(matrix), (int(width), int(height)))


def _of_file(path: Path) -> list[TrackedCamera]:
    if path.suffix.lower() == ".frame":
        return [_checked(_of_tracker(path), path, "opencv")]
    document = parse_json(read_bytes(path, MAX_FILE_BYTES), path)
    frames = document.get("frames") if isinstance(document, dict) else None
    if not isinstance(frames, list) or not frames or not all(isinstance(frame, dict) for frame in frames):
        raise AvatarError("holds no list of frames with cameras", file=path, field="frames")
    if len(frames) > MAX_CAMERAS:
        raise AvatarError(
            f"has {len(frames)} entries; up to {MAX_CAMERAS} are read", file=path, field="frames"
        )
    for key, read in KINDS.items():
        if key in frames[0]:
            cameras = (read(frame, document, path, f"frames[{t}]") for t, frame in enumerate(frames))
            return [_checked(camera, path, f"frames[{t}]") for t, camera in enumerate(cameras)]
    raise AvatarError(
        f"holds no cameras: its frames have none of {', '.join(KINDS)}", file=path, field="frames"
    )


def _own(frame: Object, whole: Object, file: Path, at: str) -> TrackedCamera:
    camera = frame.get("camera")
    parts: Object = camera if isinstance(camera, dict) else {}
    view = np.eye(4)
    view[:3, :3] = numbers(parts.get("R"), (3, 3), file, f"{at}.camera.R")
    view[:3, 3] = numbers(parts.get("t"), (3,), file, f"{at}.camera.t")
    width, height = (int(numbers(whole.get(side), (), file, side)) for side in ("width", "height"))
    return TrackedCamera(numbers(parts.get("K"), (3, 3), file, f"{at}.camera.K"), view, (width, height))


def _imavatar(frame: Object, whole: Object, file: Path, at: str) -> TrackedCamera:
    k = pinhole(*np.abs(numbers(whole.get("intrinsics"), (4,), file, "intrinsics")))
    return TrackedCamera(
        k, from_world_mat(numbers(frame.get("world_mat"), (3, 4), file, f"{at}.world_mat")), None
    )


def _of_tracker(path: Path) -> TrackedCamera:
    content = read_frame(path)
    opencv = content.get("opencv")
    parts: Object = opencv if isinstance(opencv, dict) else {}

    def values(name: str, shape: tuple[int, ...], holder: Object, field: str) -> F64:
        source = holder.get(name)
        read = source.read() if isinstance(source, (StoredArray, ComputedArray)) else source
        flat = np.asarray(read).ravel() if isinstance(read, np.ndarray) else read
        count = (math.prod(shape),)
        return numbers(flat, count, path, field).reshape(shape)

    view = np.eye(4)
    view[:3, :3] = values("R", (3, 3), parts, "opencv.R")
    view[:3, 3] = values("t", (3,), parts, "opencv.t")
    height, width = values("img_size", (2,), content, "img_size")
    return TrackedCamera(values("K", (3, 3), parts, "opencv.K"), view, (int(width), int(height)))


KINDS: dict[str, Callable[[Object, Object, Path, str], TrackedCamera]] = {
    "camera": _own,
    "transform_matrix": transform_camera,
    "world_mat": _imavatar,
}


def _checked(camera: TrackedCamera, file: Path, at: str) -> TrackedCamera:
    turn, k = camera.camera_from_world[:3, :3], camera.intrinsics
    off = float(np.abs(turn @ turn.T - np.eye(3)).max())
    if not off <= ROTATION_TOLERANCE or np.linalg.det(turn) < 0:
        raise AvatarError(
            f"its matrix is not a rotation: an entry of R R^T - I is {off:.3g}", file=file, field=at
        )
    if not (k[0, 0] > 0 and k[1, 1] > 0) or (k[2] != (0, 0, 1)).any() or k[1, 0] != 0:
        raise AvatarError(
            "its K is not [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] with fx, fy > 0", file=file, field=at
        )
    if camera.size is not None and not all(1 <= side <= MAX_SIDE for side in camera.size):
        raise AvatarError(f"has images of {camera.size[0]}x{camera.size[1]} pixels", file=file, field=at)
    return camera


def common_size(cameras: Sequence[TrackedCamera], path: Path) -> tuple[int, int] | None:
    """Width and height of all cameras' images; None if the file does not say. Raises AvatarError for two sizes."""
    sizes = {camera.size for camera in cameras}
    if len(sizes) > 1:
        raise AvatarError("has images of several sizes; pass --size", file=path)
    return sizes.pop()
