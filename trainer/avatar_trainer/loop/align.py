"""One step that moves the tracked values of a frame so that the avatar's rendering meets the image.

Lucas and Kanade's registration with the body mesh as its warp: where the rendering and the image differ, and how they
change from pixel to pixel, says how far a point of the mesh is from its place; Gauss-Newton turns that into pose,
joints and expressions. Only the mesh and the rendering are needed, so it is the same for every system.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from torch import Tensor
from torch.nn.functional import adaptive_avg_pool2d, avg_pool2d

from avatar_runtime import F32, F64, I64, Camera, PoseArrays, Rig, posed_mesh
from avatar_runtime.stages import joints, skin
from avatar_trainer.captures.mesh_raster import intrinsics, seen_of
from avatar_trainer.captures.model import Frame
from avatar_trainer.kernels.least_squares import bounded_solution, normal_matrix
from avatar_trainer.loop.values import Values

LONGEST, LONGEST_ALONE = 160, 64  # pixels of the images that are compared; while the head alone moves
FINE, COARSE = 3, 15  # pixels of the two means whose difference is compared
INSIDE = 0.5  # of the mask
FEWEST = 200  # pixels that must show the mesh
GAIN = (0.6, 1.6)  # contrast of the image over that of the rendering: beyond, the avatar is not there yet
OUTLIER = 3.0  # times the median difference: a pixel's weight halves
ALIKE = 150.0  # pixels that err together: of the blur, of light, of what the avatar has not learned
FARTHEST = 2.0  # deviations from the tracked values (`Values`) in one step


@dataclass(frozen=True)
class Places:
    """Where pixels of an image see the mesh."""

    y: I64  # [P]
    x: I64
    vertex: I64  # [P] the nearest one
    lens: F64  # [P, 2, 3] pixels by a movement in avatar space


def better(
    values: Values,
    tracked: Frame,
    change: F64,
    drawn: Tensor,
    wanted: Tensor,
    mask: Tensor,
    head_alone: bool = False,
) -> F64:
    """A better `change` [D] of what was `tracked` in a frame, the head's alone if so asked.

    drawn, wanted: [H, W, 3] the rendering with the present change and the image, over one background; mask [H, W].
    The change itself where the two cannot be compared.
    """
    rig, now = values.rig, values.moved(tracked, change)
    camera = _smaller(now.camera, LONGEST_ALONE if head_alone else LONGEST)
    size = camera.height, camera.width
    mine, other = (_band(image, size) for image in (drawn, wanted))
    inside = _pooled(mask[None], size)[0].numpy() > INSIDE
    state = joints.joints(rig, now.pose)
    vertices = posed_mesh(rig, now.pose, state).astype(np.float64)
    at = _places(vertices, rig, now.pose.world_from_avatar, camera, inside)
    if len(at.y) < FEWEST:
        return change
    theirs, ours = other[:, at.y, at.x].T, mine[:, at.y, at.x].T  # [P, 3]
    gain = float((theirs * ours).sum() / max((ours * ours).sum(), 1e-12))
    if not GAIN[0] < gain < GAIN[1]:
        return change
    slope = _slope((gain * mine + other) / 2, at)
    error = gain * ours - theirs
    far = np.abs(error).mean(axis=1)
    weight = 1 / (1 + (far / max(OUTLIER * float(np.median(far)), 1e-6)) ** 2)
    variance = float((weight[:, None] * error**2).sum() / (3 * weight.sum())) + 1e-8
    share = np.sqrt(weight / (variance * ALIKE))[:, None]
    moved = slope @ (at.lens * share[:, :, None])  # [P, 3 channels, 3] change of a colour by a movement
    rows, where = np.unique(at.vertex, return_inverse=True)
    square = _summed(where, len(rows), moved.transpose(0, 2, 1) @ moved)
    right = _summed(where, len(rows), (moved * (error * share)[:, :, None]).sum(axis=1))
    by = _movements(values, now, state.skin_matrix, vertices, rows)
    return _solved(values, tracked.pose, change, by, square, right, head_alone)


def _solved(
    values: Values, tracked: PoseArrays, change: F64, by: F64, square: F64, right: F64, head_alone: bool
) -> F64:
    """The change that explains the differences, near what was tracked and inside the bounds."""
    matrix = np.zeros((values.count, values.count))
    normal_matrix(by, square, matrix)
    wanted = np.einsum("vci,vc->i", by, right) + np.einsum("ik,k->i", matrix, change)
    matrix[np.diag_indices(values.count)] += 1 / values.deviation**2
    reach, (least, most) = FARTHEST * values.deviation, values.bounds(tracked)
    low, high = np.maximum(least, change - reach), np.minimum(most, change + reach)
    if head_alone:
        low[6:], high[6:] = change[6:], change[6:]
    result = change.copy()
    bounded_solution(matrix, wanted, low, high, result)
    return result


def _movements(values: Values, now: Frame, skin_matrix: F32, vertices: F64, rows: I64) -> F64:
    """[V, 3, D] how the chosen vertices move by each value, avatar space."""
    place = vertices[rows]
    out = np.empty((len(rows), 3, values.count))
    out[:, :, 3:6] = np.eye(3)
    out[:, :, :3] = _turns(place - values.centre)
    rig = values.rig
    chain = joints.chain(rig, now.pose.expression_weights, now.pose.joint_delta)[2]
    for j, joint in enumerate(values.joints):
        arm = (place - chain[joint, :3, 3]) * values.carried[j, rows, None]
        out[:, :, 6 + 3 * j : 9 + 3 * j] = _turns(arm) @ chain[joint, :3, :3]
    first = 6 + 3 * len(values.joints)
    turn = skin.vertex_matrices(rig, skin_matrix)[rows].astype(np.float64)
    count = len(values.columns)
    out[:, :, first : first + count] = np.einsum("vij,vjk->vik", turn, values.morphs[rows])
    out[:, :, first + count :] = values.late[rows]
    return out


def _turns(arm: F64) -> F64:
    """[V, 3, 3] the movement of the end of each arm [V, 3] by a turn about x, y, z."""
    x, y, z = arm.T
    none = np.zeros_like(x)
    return np.stack([none, z, -y, -z, none, x, y, -x, none], axis=1).reshape(-1, 3, 3)


def _places(vertices: F64, rig: Rig, world: F64, camera: Camera, inside: npt.NDArray[np.bool_]) -> Places:
    """The pixels of a camera that show the mesh and lie `inside`."""
    placed = vertices @ world[:3, :3].T + world[:3, 3]
    triangles = rig.triangles.astype(np.int64)
    face = seen_of(placed, triangles, camera)[1]
    face[[0, -1]], face[:, [0, -1]] = -1, -1  # no slope there
    y, x = np.nonzero((face >= 0) & inside)
    k, view = intrinsics(camera), camera.camera_from_world.astype(np.float64) @ world
    seen = vertices @ view[:3, :3].T + view[:3, 3]
    with np.errstate(all="ignore"):
        pixel = seen[:, :2] * np.diag(k)[:2] / seen[:, 2:] + k[:2, 2]
    corner = triangles[face[y, x]]
    away = np.square(pixel[corner] - np.stack([x, y], axis=1)[:, None] - 0.5).sum(axis=2)
    vertex = np.take_along_axis(corner, away.argmin(axis=1)[:, None], axis=1)[:, 0]
    depth = seen[vertex, 2]
    lens = np.zeros((len(y), 2, 3))
    for axis in range(2):
        lens[:, axis, axis] = k[axis, axis] / depth
        lens[:, axis, 2] = -k[axis, axis] * seen[vertex, axis] / depth**2
    return Places(y, x, vertex, lens @ view[:3, :3])


def _slope(image: F64, at: Places) -> F64:
    """[P, 3 channels, 2] change of colour from pixel to pixel."""
    across = (image[:, at.y, at.x + 1] - image[:, at.y, at.x - 1]) / 2
    down = (image[:, at.y + 1, at.x] - image[:, at.y - 1, at.x]) / 2
    return np.stack([across.T, down.T], axis=2)


def _band(image: Tensor, size: tuple[int, int]) -> F64:
    """[3, h, w] the image without its finest and its slowest changes."""
    small = _pooled(image.permute(2, 0, 1), size)
    fine = _mean(_mean(small, FINE), FINE)
    band: F64 = (fine - _mean(fine, COARSE)).numpy().astype(np.float64)
    return band


def _pooled(image: Tensor, size: tuple[int, int]) -> Tensor:
    return adaptive_avg_pool2d(image[None].detach(), size)[0]


def _mean(image: Tensor, width: int) -> Tensor:
    half = width // 2
    across = avg_pool2d(image[None], (1, width), 1, (0, half), count_include_pad=False)
    return avg_pool2d(across, (width, 1), 1, (half, 0), count_include_pad=False)[0]


def _smaller(camera: Camera, longest: int) -> Camera:
    """The camera at `longest` pixels of its longer side at most."""
    share = min(1.0, longest / max(camera.width, camera.height))
    width, height = (max(1, round(side * share)) for side in (camera.width, camera.height))
    return replace(camera, width=width, height=height)


def _summed(where: I64, count: int, rows: F64) -> F64:
    """[count, ...] the sums of the rows that go to each place."""
    out = np.zeros((count, *rows.shape[1:]))
    np.add.at(out, where, rows)
    return out
