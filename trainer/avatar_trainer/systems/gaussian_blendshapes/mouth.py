"""The inside of the mouth, and its first Gaussians: on the mesh's own teeth, or on two billboards."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from avatar_runtime import F64, I64, AvatarError, Rig
from avatar_trainer.systems.common.poisson import Samples, poisson_disk

LOWER_WEIGHT = (
    0.25  # of the jaw: triangles of the mouth's inside with a larger weight belong to the lower teeth
)
LIPS_SPREAD = 0.2  # of jaw weight around a hole of the mesh: it is the mouth
# Of the lips' width: the cylinder behind them, when the mesh has no teeth.
RADIUS, HALF_HEIGHT, MARGIN = 0.55, 0.4, 1.1
BILLBOARD_DEPTH = 0.5  # of the radius, in front of the axis


@dataclass(frozen=True)
class Cylinder:
    """The volume that keeps the mouth's Gaussians, its axis along +Y; mesh space, metres (Eq. 5)."""

    centre: tuple[float, float, float]
    radius: float
    half_height: float

    @staticmethod
    def around(points: F64) -> Cylinder:
        """The cylinder around points [N, 3], a little larger."""
        low, high = points.min(axis=0), points.max(axis=0)
        centre = (low + high) / 2
        radius = np.linalg.norm((points - centre)[:, [0, 2]], axis=1).max()
        x, y, z = (float(c) for c in centre)
        return Cylinder((x, y, z), float(radius) * MARGIN, float(high[1] - low[1]) / 2 * MARGIN)


@dataclass(frozen=True)
class Mouth:
    """The inside of a mesh's mouth."""

    upper: F64  # [T, 3, 3] corners of the triangles that the upper teeth's Gaussians begin on
    lower: F64
    cylinder: Cylinder

    def samples(self, count: int, generator: np.random.Generator) -> tuple[Samples, Samples]:
        """`count` points for the upper teeth, and as many for the lower."""
        upper, lower = (
            poisson_disk(
                corners.reshape(-1, 3),
                np.arange(3 * len(corners)).reshape(-1, 3),
                np.arange(len(corners)),
                count,
                generator,
            )
            for corners in (self.upper, self.lower)
        )
        return upper, lower


def find_mouth(rig: Rig, given: Cylinder | None = None) -> Mouth:
    """The mouth of a body mesh.

    If the mesh has teeth, they are used: the parts among those that the jaw moves, except the head itself. Otherwise,
    as for FLAME, two billboards stand in a cylinder behind the lips: the one `given`, or one as wide as the hole
    between the lips needs.
    Raises AvatarError if the mesh has neither.
    """
    vertices, triangles = rig.vertices.astype(np.float64), rig.triangles.astype(np.int64)
    jaw = _jaw_weight(rig)
    interior = mouth_interior(rig)
    if interior.any() and given is None:
        corners = vertices[triangles]
        below = jaw[triangles].mean(axis=1) > LOWER_WEIGHT
        upper, lower = corners[interior & ~below], corners[interior & below]
        if len(upper) and len(lower):
            return Mouth(upper, lower, Cylinder.around(corners[interior].reshape(-1, 3)))
    cylinder = given or _behind_lips(vertices, triangles, jaw)
    upper, lower = _billboards(cylinder)
    return Mouth(upper, lower, cylinder)


def parts(triangles: I64, vertices: int) -> I64:
    """[V] the smallest vertex of each vertex's connected part."""
    label: I64 = np.arange(vertices)
    while True:
        lower = label.copy()
        smallest = label[triangles].min(axis=1)
        for corner in range(3):
            np.minimum.at(lower, triangles[:, corner], smallest)
        lower = lower[lower]
        if np.array_equal(lower, label):
            return label
        label = lower


def mouth_interior(rig: Rig) -> npt.NDArray[np.bool_]:
    """[F] triangles of teeth, gums and tongue; none for a mesh in one part."""
    vertices, triangles = rig.vertices.astype(np.float64), rig.triangles.astype(np.int64)
    jaw, eyes = _jaw_weight(rig), _eye_vertices(rig)
    label = parts(triangles, len(vertices))
    found, size = np.unique(label[triangles[:, 0]], return_counts=True)
    others = [part for part in found[found != found[np.argmax(size)]] if not eyes[label == part].all()]
    moved = [part for part in others if jaw[label == part].mean() > LOWER_WEIGHT]
    if not moved:
        return np.zeros(len(triangles), bool)
    points = vertices[np.isin(label, moved)]
    low, high = points.min(axis=0), points.max(axis=0)
    low, high = low - (high - low), high + (high - low)
    inside = []
    for part in others:
        centre = vertices[label == part].mean(axis=0)
        if ((centre > low) & (centre < high)).all():
            inside.append(part)
    result: npt.NDArray[np.bool_] = np.isin(label[triangles[:, 0]], inside)
    return result


def _behind_lips(vertices: F64, triangles: I64, jaw: F64) -> Cylinder:
    """The cylinder behind the hole between the lips: its rim is where the jaw's weight differs most."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, uses = np.unique(edges, axis=0, return_counts=True)
    rim = edges[uses == 1]
    label = parts(np.concatenate([rim, rim[:, :1]], axis=1), len(vertices)) if len(rim) else rim
    best, lips = LIPS_SPREAD, None
    for loop in np.unique(label[rim[:, 0]]) if len(rim) else []:
        rows = label == loop
        if float(np.std(jaw[rows])) > best:
            best, lips = float(np.std(jaw[rows])), vertices[rows]
    if lips is None:
        raise AvatarError(
            "the body mesh has neither teeth nor a hole between its lips to find the mouth by; give "
            "mouth_cylinder (centre x,y,z, radius, half height; metres) or switch the rule mouth off",
            field="mouth_cylinder",
        )
    width = float(np.ptp(lips[:, 0]))
    x, y, z = (float(c) for c in (lips.min(axis=0) + lips.max(axis=0)) / 2)
    return Cylinder((x, y, z - RADIUS * width), RADIUS * width, HALF_HEIGHT * width)


def _billboards(cylinder: Cylinder) -> tuple[F64, F64]:
    """Two upright rectangles that face +Z, above and below the cylinder's middle: [2, 3, 3] corners each."""
    x, y, z = cylinder.centre
    z += BILLBOARD_DEPTH * cylinder.radius
    half = cylinder.radius * float(np.sqrt(1 - BILLBOARD_DEPTH**2)) / MARGIN
    boards = []
    for end in (y + cylinder.half_height / MARGIN, y - cylinder.half_height / MARGIN):
        a, b, c, d = [(x - half, y, z), (x + half, y, z), (x + half, end, z), (x - half, end, z)]
        boards.append(np.array([[a, b, c], [a, c, d]]))
    return boards[0], boards[1]


def _jaw_weight(rig: Rig) -> F64:
    """[V] skin weight of the joint named jaw."""
    return _weight_of(rig, ("jaw",))


def _eye_vertices(rig: Rig) -> npt.NDArray[np.bool_]:
    """[V] vertices that an eye's joint holds."""
    return _weight_of(rig, ("leftEye", "rightEye")) > 0.5


def _weight_of(rig: Rig, names: tuple[str, ...]) -> F64:
    joints = [index for index, name in enumerate(rig.joint_names) if name in names]
    row = np.repeat(np.arange(rig.skin.rows), np.diff(rig.skin.row_ptr.astype(np.int64)).astype(np.int64))
    weight = np.where(np.isin(rig.skin.column, joints), rig.skin.values["weight"], 0)
    result: F64 = np.bincount(row, weight, rig.skin.rows).astype(np.float64)
    return result
