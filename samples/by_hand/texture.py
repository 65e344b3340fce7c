"""How the head's texture was made from the scan; run by hand, not part of any build.

    python -m samples.by_hand.texture SOURCE

SOURCE holds ict_lps_head.npz, lee_perry_smith.glb and lee_perry_smith_color.jpg. Written: data/head_texture.webp
and data/head_uv.npz (uv f32 [F, 3, 2] of the corners of the head's triangles, u to the right, v down).

ICT-FaceKit's texture coordinates are packed into one image. Every texel of skin takes the scan's colour at
the nearest point of the scan (the left eye, which is the mirrored right one, takes the right one's); parts that
the scan lacks - eyes, teeth, gums, the sockets - are painted by `samples.subjects.colour`.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from samples.by_hand.compact import (
    EYE_REGION_CM,
    RIGHT_EYE,
    RIGHT_IRIS,
    clear_eyes,
    draw_in_socket,
    expressions,
    mirror_right_eye,
    mirrored,
    part_of_triangle,
)
from samples.by_hand.compact import HEAD as HEAD_SKIN
from samples.by_hand.texture_scan import FAR_LIMIT_CM, Scan, load_scan, scan_colour
from samples.capture.eyes import texels
from samples.subjects.colour import surface_colour
from samples.subjects.head import DATA, Head, Mesh, load_head, smoothstep
from samples.subjects.surface import Samples

Array = npt.NDArray[Any]

SIZE = 1024
# ICT's tiles (u // 1; eyes share the face's) -> place in the image: x, y, width, height in pixels.
FACE, BACK, GUMS, TEETH, LEFT, RIGHT = range(6)
PLACES = np.array(
    [(0, 0, 704, 704), (704, 0, 320, 704), (0, 704, 320, 320), (320, 704, 320, 320), (640, 704, 192, 320),
     (832, 704, 192, 320)], np.float64
)  # fmt: skip
MARGIN = 4  # texels by which colours extend over the edge of their piece of the image
QUALITY = 94
FAR_CM = 0.35  # distance from the scan from which its colour fades out


def packed_uv(uv: Array, part: Array, part_names: tuple[str, ...]) -> Array:
    """ICT's coordinates [F, 3, 2] (v up) of triangles in the head's parts -> the image's, 0..1, v down."""
    tile = np.minimum(np.floor(uv[:, :, 0].mean(axis=1)).astype(int), TEETH)
    tile[part == part_names.index("left_eye")] = LEFT
    tile[part == part_names.index("right_eye")] = RIGHT
    x, y, w, h = (PLACES[tile] / SIZE).T[:, :, None]
    return np.stack([x + w * (uv[:, :, 0] % 1), y + h * (1 - uv[:, :, 1] % 1)], axis=-1)


@dataclass(frozen=True)
class Registered:
    """The head's triangles in the numbering of ICT-FaceKit, as registered to the scan, centimetres."""

    vertices: Array  # f64 [V, 3]
    normals: Array  # f64 [V, 3]
    triangles: Array  # i64 [F, 3] in the order of the head's
    uv: Array  # f64 [F, 3, 2] ICT's, v up
    twin: Array  # i64 [V] the vertex on the other side
    mirrored: Array  # f64 [V] share that comes from the other side: 1 around the left eye


def load_registered(source: Path, head: Head) -> Registered:
    """The triangles that `samples.by_hand.compact` keeps; ValueError if they are not those of `head`."""
    with np.load(source / "ict_lps_head.npz", allow_pickle=False) as file:
        data = {name: file[name] for name in file.files}
    raw = data["vertices"].astype(np.float64)
    everything = data["triangles"].astype(np.int64)
    shapes = expressions(data)
    vertices, _ = mirror_right_eye(data)
    clear_eyes(vertices, shapes)
    draw_in_socket(vertices, everything)
    kept = part_of_triangle(vertices, everything, shapes["jawOpen"]) >= 0
    _, flat = np.unique(everything[kept], return_inverse=True)
    if not np.array_equal(flat.reshape(-1, 3), head.triangles):
        raise ValueError("data/head.npz was not made from this source")
    centre = raw[RIGHT_EYE:RIGHT_IRIS].mean(axis=0) * (-1, 1, 1)
    share = smoothstep(np.linalg.norm(raw - centre, axis=1), EYE_REGION_CM[1], EYE_REGION_CM[0])
    uv = data["uv"].astype(np.float64)[data["uv_triangles"][kept].astype(np.int64)]
    normals = Mesh(raw, everything).vertex_normals
    return Registered(
        raw, normals, everything[kept], uv, mirrored(data["generic_vertices"].astype(np.float64)), share
    )


def bake(source: Path) -> tuple[Array, Array]:
    """(image u8 [SIZE, SIZE, 3], uv f32 [F, 3, 2])."""
    head = load_head()
    ict = load_registered(source, head)
    scan = load_scan(source, ict.vertices[:HEAD_SKIN])
    corner = packed_uv(ict.uv, head.part, head.part_names)
    face, bary = np.full((SIZE, SIZE), -1), np.zeros((SIZE, SIZE, 3))
    texels(corner, SIZE, face, bary)
    y, x = np.nonzero(face >= 0)
    f, b = face[y, x], bary[y, x]
    colour = painted(head, f, b)
    skin = head.triangles_in("face", "head")[f]
    colour[skin] = skin_colour(head, ict, scan, f[skin], b[skin], colour[skin])
    image = np.zeros((SIZE, SIZE, 3))
    image[y, x] = colour
    image = dilated(image, face >= 0)
    return np.round(np.clip(image, 0, 1) * 255).astype(np.uint8), corner.astype(np.float32)


def painted(head: Head, face: Array, bary: Array) -> Array:
    """Colours [N, 3] of points on the head by `samples.subjects.colour`."""
    position = np.einsum("nc,ncx->nx", bary, head.vertices[head.triangles[face]])
    blank = np.zeros((len(face), 3, 3))
    return surface_colour(head, Samples(face, bary, position, blank, np.zeros(len(face))))


def skin_colour(head: Head, ict: Registered, scan: Scan, face: Array, bary: Array, fallback: Array) -> Array:
    """Colours [N, 3] of points on the skin from the scan, `fallback` [N, 3] where it is too far."""
    rows = ict.triangles[face]

    def seen(corner: Array, bary: Array) -> tuple[Array, Array]:
        points = np.einsum("nc,ncx->nx", bary, ict.vertices[corner])
        return scan_colour(scan, points, np.einsum("nc,ncx->nx", bary, ict.normals[corner]))

    colour, far = seen(rows, bary)
    share = np.einsum("nc,nc->n", bary, ict.mirrored[rows])
    some = np.flatnonzero(share > 0)
    other, other_far = seen(ict.twin[rows[some]], bary[some])
    colour[some] += share[some, None] * (other - colour[some])
    far[some] = np.where(share[some] >= 1, other_far, np.maximum(far[some], other_far))
    trust = smoothstep(far, FAR_LIMIT_CM, FAR_CM)[:, None]
    return fallback + trust * (colour - fallback)


def dilated(image: Array, known: Array) -> Array:
    """The image with the colour of known texels extended by MARGIN texels; farther away, the mean."""
    image, known = image.copy(), known.copy()
    mean = image[known].mean(axis=0)
    for _ in range(MARGIN):
        total, count = np.zeros_like(image), np.zeros(known.shape)
        for dy, dx in ((0, 1), (0, -1), (1, 0), (-1, 0)):
            total += np.roll(image * known[..., None], (dy, dx), (0, 1))
            count += np.roll(known, (dy, dx), (0, 1))
        grown = ~known & (count > 0)
        image[grown] = total[grown] / count[grown][:, None]
        known |= grown
    image[~known] = mean
    return image


def main(source: Path) -> None:
    image, uv = bake(source)
    Image.fromarray(image).save(DATA / "head_texture.webp", quality=QUALITY, method=6)
    np.savez_compressed(DATA / "head_uv.npz", uv=uv)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
