"""Still images of one head from many sides: `python -m samples.capture.views OUT --views 20 --identity SEED`.

The data that a phone and a landmark detector give of a person who keeps still: images, the 2D positions of 68
landmarks, masks, the camera's K; no poses. schema/CAPTURE.md has the layout (views.json). The true
cameras and mesh are in truth.json and truth.npz, only for measuring; no fit may read them.

The head is the scanned one with the identity modes of ICT-FaceKit added, textured as in samples.capture. The light
is fixed to the head and nothing shines: a point has the same colour in every image, as photometric
consistency assumes.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from avatar_runtime.camera import Camera
from avatar_runtime.rotation import matrix_from_rotvec
from avatar_trainer.asm.kernels.zbuffer import depth_buffers, in_front
from avatar_trainer.captures.mesh_raster import MeshImage, Surface, draw
from avatar_trainer.head import Head, build_body_model
from samples.capture.head import AUTHOR, CONSENT, LICENSE
from samples.capture.model import Model, matt
from samples.capture.shots import camera_towards, rays_per_pixel
from samples.subjects.head import load_head

Array = npt.NDArray[Any]

YAW, PITCH, ROLL = np.radians(60.0), np.radians(18.0), np.radians(4.0)  # the most of each
DISTANCE, NEARER = 0.80, 0.08  # metres; share of it
TARGET = (0.0, -0.005, 0.03)
FOV_Y = 0.36  # the face fills the image
BASES = (2, 3, 7, 5)  # of the sequences that yaw, pitch, roll and distance follow
CAMERAS = 20  # that the facial region is seen by
FACE_REACH = 0.095  # metres about the tip of the nose: the facial region that errors are measured in
NOSE_TIP = 30  # of the landmarks
# Landmarks in the order of the 68-point annotation: vertices of the head (idx_to_landmark_verts of ICT-FaceKit).
LANDMARKS = (
    1225, 1888, 1052, 367, 1719, 1722, 2199, 1447, 966, 3661, 4390, 3927, 3924, 2608, 3272, 4088, 3443,
    268, 493, 1914, 2044, 1401, 3615, 4240, 4114, 2734, 2509, 978, 4527, 4942, 4857, 1140, 2075, 1147,
    4269, 3360, 1507, 1542, 1537, 1528, 1518, 1511, 3742, 3751, 3756, 3721, 3725, 3732, 5708, 5695, 2081,
    0, 4275, 6200, 6213, 6346, 6461, 5518, 5957, 5841, 5702, 5711, 5533, 6216, 6207, 6470, 5517, 5966,
)  # fmt: skip
HIDDEN_BEHIND = 0.004  # metres; a surface this far in front of a landmark hides it
FACING = 0.05  # least cosine between a visible landmark's normal and the direction to the camera
SOURCE = "synthetic: computed pictures of a scanned head changed by identity modes, no footage"


@dataclass(frozen=True)
class View:
    """One image and what is known of it."""

    camera: tuple[Array, Array]  # R [3, 3], t [3], OpenCV
    image: MeshImage
    landmarks: Array  # [68, 2] pixels, as found
    visible: Array  # bool [68]


def person(seed: int) -> Head:
    """The scanned head with identity modes of weights drawn from a standard normal distribution."""
    head = load_head()
    weights = np.random.default_rng(seed).standard_normal(len(head.identity))
    return replace(head, vertices=head.vertices + np.einsum("m,mvc->vc", weights, head.identity))


def radical_inverse(index: int, base: int) -> float:
    """The radical inverse of the index: a sequence whose first members already fill 0..1 evenly."""
    value, share = 0.0, 1.0 / base
    while index:
        index, digit = divmod(index, base)
        value += digit * share
        share /= base
    return value


def camera_at(view: int, size: int) -> tuple[Array, Array, Array]:
    """(K, R, t), OpenCV, of one view; the first is in front, and the first n are well spread for every n."""
    yaw, pitch, roll, nearer = (2 * radical_inverse(view + 1, base) - 1 for base in BASES)
    if view == 0:
        pitch = roll = 0.0
    distance = DISTANCE * (1 + NEARER * nearer)
    k, rotation, translation = camera_towards(
        np.array(TARGET), distance, YAW * yaw, PITCH * pitch, FOV_Y, size
    )
    turn = matrix_from_rotvec(np.array([0, 0, ROLL * roll]))
    return k, turn @ rotation, turn @ translation


def surface_of(model: Model) -> Surface:
    """The head at rest, lit by a light that is fixed to it."""
    head = model.head
    texture, uv = model.texture
    return Surface(
        head.vertices,
        head.triangles,
        uv,
        texture,
        matt(head.vertex_normals).astype(np.float32),
        np.zeros(len(head.vertices), np.float32),
        model.opacity,
    )


def projected(points: Array, k: Array, rotation: Array, translation: Array) -> tuple[Array, Array]:
    """(pixels [N, 2], pixel centres at half integers; depth [N] metres) of points [N, 3] in the world."""
    x = points @ rotation.T + translation
    return x[:, :2] / x[:, 2:] @ k[:2, :2].T + k[:2, 2], x[:, 2]


def in_sight(head: Head, rows: Array, eye: Array) -> Array:
    """Whether the vertices `rows` [N] are seen from `eye` [3]: facing it, with no triangle in front of them."""
    corner = head.vertices[head.triangles]
    edge, other = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    seen = np.zeros(len(rows), bool)
    for i, row in enumerate(rows):
        way = head.vertices[row] - eye
        far = np.linalg.norm(way)
        facing = head.vertex_normals[row] @ -way / far >= FACING
        # Moeller and Trumbore: the ray from the eye meets the triangle at share t of the way.
        p = np.cross(way, other)
        det = np.sum(edge * p, axis=1)
        safe = np.where(np.abs(det) > 1e-18, det, np.inf)
        s = eye - corner[:, 0]
        u, q = np.sum(s * p, axis=1) / safe, np.cross(s, edge)
        v, t = q @ way / safe, np.sum(other * q, axis=1) / safe
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & ((1 - t) * far > HIDDEN_BEHIND)
        seen[i] = facing and not hit.any()
    return seen


def views(head: Head, count: int, size: int, noise: float, seed: int) -> list[View]:
    """The images of a head; landmarks have a normal error with a deviation of `noise` pixels in each axis."""
    model = Model(head, build_body_model(head))
    surface, rows = surface_of(model), np.array(LANDMARKS)
    rng = np.random.default_rng(seed)
    result = []
    for i in range(count):
        k, rotation, translation = camera_at(i, size)
        camera = Camera.from_opencv(rotation, translation, k, size, size)
        place, _ = projected(head.vertices[rows], k, rotation, translation)
        found = place + noise * rng.standard_normal(place.shape)
        visible = in_sight(head, rows, -rotation.T @ translation)
        result.append(
            View((rotation, translation), draw(surface, camera, rays_per_pixel(size)), found, visible)
        )
    return result


def write_views(out: Path, count: int, identity: int, size: int, noise: float) -> Path:
    """Write images, masks, views.json, truth.json and truth.npz into `out`; the path of views.json.

    Raises ValueError for fewer than one view.
    """
    if count < 1:
        raise ValueError(f"{count} views: one is the least")
    head = person(identity)
    taken = views(head, count, size, noise, identity)
    for part in ("images", "masks"):
        (out / part).mkdir(parents=True, exist_ok=True)
    entries = []
    for i, view in enumerate(taken):
        colour, alpha = view.image.colour * view.image.alpha[..., None], view.image.alpha
        names = {"image": f"images/{i:02d}.png", "mask": f"masks/{i:02d}.png"}
        for name, values in zip(names.values(), (colour, alpha), strict=True):
            Image.fromarray(np.round(np.clip(values, 0, 1) * 255).astype(np.uint8)).save(out / name)
        points = [
            [round(float(c), 3) for c in p] if seen else None
            for p, seen in zip(view.landmarks, view.visible, strict=True)
        ]
        entries.append({**names, "landmarks": points})
    document = {
        "version": "1.0",
        "name": f"scanned head, identity {identity}, synthetic",
        "width": size,
        "height": size,
        "source": SOURCE,
        "licence": LICENSE,
        "author": AUTHOR,
        "consent": CONSENT,
        "K": camera_at(0, size)[0].tolist(),
        "landmarks": [f"ibug_{i}" for i in range(len(LANDMARKS))],
        "views": entries,
    }
    (out / "views.json").write_text(json.dumps(document, indent=1) + "\n")
    write_truth(out, head, taken)
    return out / "views.json"


def seen_from_outside(head: Head) -> Array:
    """Mask [V] of the vertices that one of CAMERAS cameras sees: not the inside of nostrils and mouth, as in a scan."""
    shown = np.zeros(len(head.vertices), bool)
    for i in range(CAMERAS):
        k, rotation, translation = camera_at(i, 384)
        pixels, far = projected(head.vertices, k, rotation, translation)
        points = (head.vertices @ rotation.T + translation)[None]
        shown |= in_front(
            depth_buffers(points, head.triangles, k, (384, 384)), pixels[None], far[None], 0.001
        )[0]
    return shown


def write_truth(out: Path, head: Head, taken: list[View]) -> None:
    """The truth, which no fit may read: truth.json, the cameras; truth.npz, the mesh in metres and the facial part."""
    cameras = [{"R": view.camera[0].tolist(), "t": view.camera[1].tolist()} for view in taken]
    (out / "truth.json").write_text(json.dumps({"cameras": cameras}, indent=1) + "\n")
    tip = head.vertices[LANDMARKS[NOSE_TIP]]
    near = np.linalg.norm(head.vertices - tip, axis=1) <= FACE_REACH
    shown = seen_from_outside(head)
    np.savez_compressed(
        out / "truth.npz",
        vertices=head.vertices,
        triangles=head.triangles[head.triangles_in("face")],
        facial=near & shown & head.in_part("face"),
        landmarks=np.array(LANDMARKS),
    )


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m samples.capture.views", description=__doc__)
    parser.add_argument("out", type=Path, help="folder to write into")
    parser.add_argument("--views", type=int, default=20)
    parser.add_argument(
        "--identity", type=int, default=0, help="seed of the person's shape and the landmarks"
    )
    parser.add_argument("--size", type=int, default=384, help="pixels along an edge of the square images")
    parser.add_argument("--noise", type=float, default=1.0, help="pixels: deviation of the landmarks")
    given = parser.parse_args()
    print(write_views(given.out, given.views, given.identity, given.size, given.noise))


if __name__ == "__main__":
    main()
