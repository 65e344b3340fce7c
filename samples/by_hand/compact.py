"""How samples/data was made from the full head data; run by hand, not part of any build.

    python -m samples.by_hand.compact SOURCE      SOURCE holds ict_lps_head.npz and ict_identity20.npz

Kept: skin, mouth and eye sockets, teeth, gums, tongue, eyeballs, 51 expression shapes, 8 identity shapes.
Dropped: iris balls (the painted cornea replaces them), lashes, lacrimal fluid, unused vertices, UVs,
offsets shorter than a hundredth of a millimetre. As in ARKit, `browInnerUp` and `cheekPuff` are sums of
left and right.
Repaired: the left eye is the mirrored right one, because its registered upper lid is folded into the eyeball;
the cornea's bulge is flattened and lid vertices inside an eyeball are moved onto it, at rest and in
every shape, because closing lids would cut into the eyes; the mouth socket is moved inwards, away from the
cheeks, which it almost touches.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

PARTS = (
    "face",
    "head",
    "mouth_socket",
    "eye_sockets",
    "upper_gums",
    "lower_gums",
    "upper_teeth",
    "lower_teeth",
    "left_eye",
    "right_eye",
)
SHORTEST_CM = 0.001
EYE_REGION_CM = (
    2.2,
    3.4,
)  # within the first, the left eye is the mirrored right one; beyond the second, it is unchanged
SOCKET_CM = 0.2
BALL_CM, LID_CM = 1.47, 1.53  # radii of the eyeball's surface, and of the smallest distance of lids
IDENTITY_MODES = 8
# First vertex of each region of the ICT-FaceKit topology.
HEAD, MOUTH_SOCKET, EYE_SOCKETS, GUMS, TEETH = 9409, 11248, 13294, 14062, 17039
LEFT_EYE, LEFT_IRIS, RIGHT_EYE, RIGHT_IRIS, OTHER = 21451, 22221, 23021, 23791, 24591


def arkit_name(name: str) -> str:
    """The ARKit name of an ICT shape: browDown_L -> browDownLeft."""
    if name[:-2] in ("browInnerUp", "cheekPuff"):
        return name[:-2]
    return name.replace("_L", "Left").replace("_R", "Right")


def expressions(source: np.lib.npyio.NpzFile) -> dict[str, np.ndarray]:
    """ARKit name -> offsets [V, 3] in cm; ARKit has no `cheekRaiser` and no pupils."""
    ptr, index, offset = (source[f"expression_{k}"] for k in ("ptr", "index", "offset"))
    dense: dict[str, np.ndarray] = {}
    for k, ict in enumerate(source["expression_names"].tolist()):
        if ict.startswith(("PupilDilate", "cheekRaiser")):
            continue
        shape = dense.setdefault(arkit_name(ict), np.zeros(source["vertices"].shape, np.float32))
        rows = slice(ptr[k], ptr[k + 1])
        shape[index[rows]] += offset[rows]
    return dense


def components(triangles: np.ndarray, vertices: int) -> np.ndarray:
    """Connected component (its smallest vertex) of every vertex."""
    label = np.arange(vertices)
    while True:
        low = label[triangles].min(axis=1)
        new = label.copy()
        np.minimum.at(new, triangles.ravel(), np.repeat(low, 3))
        if np.array_equal(new, label):
            return label
        label = new


def moves_with_jaw(vertices: np.ndarray, triangles: np.ndarray, jaw_open: np.ndarray) -> np.ndarray:
    """Which triangles follow the lower teeth: those that jawOpen moves at least half as far as it would them.

    Upper and lower gums are one piece in the source, so a whole piece cannot decide.
    """
    label = components(triangles, len(vertices))
    teeth = np.flatnonzero((np.arange(len(vertices)) >= TEETH) & (np.arange(len(vertices)) < LEFT_EYE))
    still = np.bincount(label, np.linalg.norm(jaw_open, axis=1), len(label))[label] == 0
    rigid = teeth[~still[teeth]]
    affine = np.c_[vertices, np.ones(len(vertices))]
    expected = affine @ np.linalg.lstsq(affine[rigid], jaw_open[rigid], rcond=None)[0]
    share = np.sum(jaw_open * expected, axis=1) / np.sum(expected * expected, axis=1)
    moved: np.ndarray = share[triangles].mean(axis=1) > 0.5
    return moved


def part_of_triangle(vertices: np.ndarray, triangles: np.ndarray, jaw_open: np.ndarray) -> np.ndarray:
    """Index into PARTS for every triangle, -1 where dropped."""
    lower = moves_with_jaw(vertices, triangles, jaw_open).astype(int)
    edges = (HEAD, MOUTH_SOCKET, EYE_SOCKETS, GUMS, TEETH, LEFT_EYE, LEFT_IRIS, RIGHT_EYE, RIGHT_IRIS, OTHER)
    region = np.searchsorted(edges, triangles.max(axis=1), side="right")
    # Columns: follows the skull, follows the jaw.
    table = np.array(
        [[0, 0], [1, 1], [2, 2], [3, 3], [4, 5], [6, 7], [8, 8], [-1, -1], [9, 9], [-1, -1], [-1, -1]]
    )
    part: np.ndarray = table[region, lower]
    return part


def mirrored(generic: np.ndarray) -> np.ndarray:
    """The vertex on the other side of each vertex, from the symmetric generic face."""
    other = np.empty(len(generic), np.int64)
    for first, end in ((0, GUMS), (GUMS, LEFT_EYE), (LEFT_EYE, len(generic))):
        goal = generic[first:end] * (-1, 1, 1)
        for row in range(first, end):
            other[row] = first + np.argmin(np.sum((goal - generic[row]) ** 2, axis=1))
    return other


def mirror_right_eye(source: np.lib.npyio.NpzFile) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (f64, cm) and colours (f64, 0..255) with the right eye's lids and ball also on the left."""
    vertices, colors = source["vertices"].astype(np.float64), source["vertex_colors"].astype(np.float64)
    other = mirrored(source["generic_vertices"].astype(np.float64))
    centre = vertices[RIGHT_EYE:RIGHT_IRIS].mean(axis=0) * (-1, 1, 1)
    distance = np.linalg.norm(vertices - centre, axis=1, keepdims=True)
    share = np.clip((EYE_REGION_CM[1] - distance) / (EYE_REGION_CM[1] - EYE_REGION_CM[0]), 0, 1)
    share = share * share * (3 - 2 * share)
    vertices += share * (vertices[other] * (-1, 1, 1) - vertices)
    colors += share * (colors[other] - colors)
    return vertices, colors


def lift(points: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """The points, those in front of an eyeball and inside LID_CM of its centre moved out to it."""
    arm = points - centre
    radius = np.linalg.norm(arm, axis=1, keepdims=True)
    inside = (radius < LID_CM) & (arm[:, 2:] > 0.2 * radius)
    return np.where(inside, centre + arm * (LID_CM / radius), points)


def clear_eyes(vertices: np.ndarray, shapes: dict[str, np.ndarray]) -> None:
    """Flatten the corneas and move the lids off the eyeballs, in place."""
    rest = vertices.copy()
    for first, end in ((LEFT_EYE, LEFT_IRIS), (RIGHT_EYE, RIGHT_IRIS)):
        ball = vertices[first:end]
        behind = ball[ball[:, 2] < ball[:, 2].max() - 0.6]
        system = np.c_[2 * behind, np.ones(len(behind))]
        centre = np.linalg.lstsq(system, (behind**2).sum(axis=1), rcond=None)[0][:3]
        radius = np.linalg.norm(ball - centre, axis=1, keepdims=True)
        vertices[first:end] = centre + (ball - centre) * np.minimum(1, BALL_CM / radius)
        vertices[:HEAD] = lift(vertices[:HEAD], centre)
        for shape in shapes.values():
            shape[:HEAD] = lift(rest[:HEAD] + shape[:HEAD], centre) - rest[:HEAD]
    for shape in shapes.values():
        shape[:HEAD] = np.where(shape[:HEAD] != 0, shape[:HEAD] + rest[:HEAD] - vertices[:HEAD], 0)


def draw_in_socket(vertices: np.ndarray, triangles: np.ndarray) -> None:
    """Move the mouth socket off the cheeks by SOCKET_CM, fading towards the lips; in place."""
    corner = vertices[triangles]
    area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal = np.zeros_like(vertices)
    for i in range(3):
        np.add.at(normal, triangles[:, i], area)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    socket = np.zeros(len(vertices))
    socket[MOUTH_SOCKET:EYE_SOCKETS] = 1
    fade = socket
    for _ in range(4):
        low = np.ones(len(vertices))
        np.minimum.at(low, triangles.ravel(), np.repeat(fade[triangles].min(axis=1), 3))
        fade = np.minimum(socket, (fade + low) / 2)
    vertices += SOCKET_CM * fade[:, None] * normal


def main(source: Path) -> None:
    head = np.load(source / "ict_lps_head.npz", allow_pickle=False)
    identity = np.load(source / "ict_identity20.npz", allow_pickle=False)["identity"][:IDENTITY_MODES]
    shapes = expressions(head)
    vertices, colors = mirror_right_eye(head)
    clear_eyes(vertices, shapes)
    triangles = head["triangles"].astype(np.int64)
    draw_in_socket(vertices, triangles)
    part = part_of_triangle(vertices, triangles, shapes["jawOpen"])
    triangles, part = triangles[part >= 0], part[part >= 0]
    used, flat = np.unique(triangles, return_inverse=True)
    ptr, index, offset = [0], [], []
    for shape in shapes.values():
        kept = np.flatnonzero(np.linalg.norm(shape[used], axis=1) > SHORTEST_CM)
        index.append(kept.astype(np.uint16))
        offset.append(shape[used][kept].astype(np.float16))
        ptr.append(ptr[-1] + len(kept))
    np.savez_compressed(
        Path(__file__).parents[1] / "data" / "head.npz",
        vertices=vertices[used].astype(np.float32),
        colors=np.round(colors[used]).astype(np.uint8),
        triangles=flat.reshape(-1, 3).astype(np.uint16),
        part=part.astype(np.uint8),
        part_names=np.array(PARTS),
        expression_names=np.array(list(shapes)),
        expression_ptr=np.array(ptr, np.int32),
        expression_index=np.concatenate(index),
        expression_offset=np.concatenate(offset),
        identity=identity[:, used],
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
