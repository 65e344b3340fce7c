"""Draws the images of the artist's guide: `python -m docs.tools.draw_guides BUNDLE`, the head of `make demo`.

Meshes are drawn from rig.glb alone, by glTF's formulas: joints, morph targets, vertex colours, normals at rest, as an
engine shows them. Gaussians are drawn by `avatar-export render`.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont
from tests.oracles.gltf_pose import File, State

ROOT = Path(__file__).resolve().parents[2]
Array = npt.NDArray[Any]
ARTIST = ROOT / "docs" / "artist"
SIZE, FINER = 300, 2
GREY = np.array([0.80, 0.82, 0.84])
LIGHT = np.array([0.35, 0.45, 0.82])
JAW_OPEN_DEGREES = 28.4  # what the sample's driving matrix gives the jaw for jawOpen 1: 0.4959 rad


def draw(file: File, state: State, yaw: float = 25, colours: bool = True) -> Image.Image:
    """The mesh in a pose, seen along -Z after a turn about Y; orthographic."""
    turn, points = np.radians(-yaw), file.posed(state)
    matrix = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
    seen = (points - VIEW_CENTRE) @ matrix.T
    pixels, size = SIZE * FINER, SIZE * FINER
    xy = seen[:, :2] * [1, -1] * (pixels / VIEW_HEIGHT) + pixels / 2
    base = file.attribute("COLOR_0")[:, :3] if colours else np.full((len(points), 3), 0.75)
    image, depth = np.tile(GREY, (size, size, 1)), np.full((size, size), -np.inf)
    for a, b, c in file.triangles:
        corners, z = xy[[a, b, c]], seen[[a, b, c], 2]
        (u, v), w = corners[1] - corners[0], corners[2] - corners[0]
        area = u * w[1] - v * w[0]
        if area >= 0:  # the back
            continue
        low, high = np.floor(corners.min(axis=0)).astype(int), np.ceil(corners.max(axis=0)).astype(int) + 1
        low, high = np.clip(low, 0, size), np.clip(high, 0, size)
        if (low >= high).any():
            continue
        ys, xs = np.mgrid[low[1] : high[1], low[0] : high[0]]
        p = np.stack([xs + 0.5 - corners[0, 0], ys + 0.5 - corners[0, 1]], axis=-1)
        s, t = (p[..., 0] * w[1] - p[..., 1] * w[0]) / area, (u * p[..., 1] - v * p[..., 0]) / area
        inside = (s >= 0) & (t >= 0) & (s + t <= 1)
        far = z[0] + s * (z[1] - z[0]) + t * (z[2] - z[0])
        region = depth[low[1] : high[1], low[0] : high[0]]
        inside &= far > region
        region[inside] = far[inside]
        face = np.cross(points[b] - points[a], points[c] - points[a])
        shade = 0.45 + 0.55 * max(
            0.0, float(face @ LIGHT / (np.linalg.norm(face) * np.linalg.norm(LIGHT) + 1e-30))
        )
        weight = np.stack([1 - s - t, s, t], axis=-1)[inside]
        image[low[1] : high[1], low[0] : high[0]][inside] = srgb(weight @ base[[a, b, c]]) * shade
    result = Image.fromarray((255 * np.clip(image, 0, 1)).astype(np.uint8))
    return result.resize((SIZE, SIZE), Image.Resampling.BOX)


def srgb(linear: Array) -> Array:
    """COLOR_0 is linear light in glTF; screens are not."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0) ** (1 / 2.4) - 0.055)


VIEW_CENTRE, VIEW_HEIGHT = np.array([0.0, 0.0, 0.0]), 0.3


def jaw(degrees: float) -> dict[str, list[float]]:
    """The jaw node turned about x."""
    half = np.radians(degrees) / 2
    return {"jaw": [float(np.sin(half)), 0.0, 0.0, float(np.cos(half))]}


def row(images: list[tuple[Image.Image, str]]) -> Image.Image:
    """Images side by side with a line of text under each."""
    height = 34
    sheet = Image.new("RGB", (SIZE * len(images), SIZE + height), "white")
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(20)
    for k, (image, text) in enumerate(images):
        sheet.paste(image.convert("RGB").resize((SIZE, SIZE)), (k * SIZE, 0))
        pen.text((k * SIZE + SIZE / 2, SIZE + height / 2), text, "black", font, anchor="mm")
    return sheet


def splats(bundle: Path, *options: str) -> Image.Image:
    """The Gaussians in a pose, by the runtime."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.png"
        command = [sys.executable, "-m", "avatar_export", "render", str(bundle), "-o", str(out)]
        command += ["--size", str(SIZE), "--background", "0.80,0.82,0.84", "--backend", "reference", *options]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        return Image.open(out).convert("RGB").copy()


def pose_of(bundle: Path, *options: str) -> State:
    """What `avatar-export pose` says."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "pose.json"
        command = [sys.executable, "-m", "avatar_export", "pose", str(bundle), "-o", str(out), *options]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        document = json.loads(out.read_text("utf-8"))
    nodes = document["nodes"]
    paths = ("translation", "rotation_xyzw", "scale")
    return State(*({name: node[path] for name, node in nodes.items()} for path in paths), document["weights"])


def main(bundle: Path) -> None:
    global VIEW_CENTRE, VIEW_HEIGHT
    file = File((bundle / "rig.glb").read_bytes())
    rest = file.posed(State())
    low, high = rest.min(axis=0), rest.max(axis=0)
    VIEW_CENTRE, VIEW_HEIGHT = (low + high) / 2, 1.12 * float(max(high - low))
    open_mouth = ("-a", "jawOpen=1")
    whole = VIEW_CENTRE, VIEW_HEIGHT
    VIEW_CENTRE, VIEW_HEIGHT = (low * [1, 0.35, 1] + high * [1, 0.65, 1]) / [2, 1, 2], 0.24
    row(
        [
            (draw(file, State()), "rest"),
            (draw(file, State(weights={"jawOpen": 1.0})), "shape jawOpen alone"),
            (draw(file, State(rotation=jaw(JAW_OPEN_DEGREES))), "bone jaw alone"),
            (draw(file, pose_of(bundle, *open_mouth)), "both"),
        ]
    ).save(ARTIST / "jaw.webp", quality=82)
    VIEW_CENTRE, VIEW_HEIGHT = whole
    smile = ("-a", "jawOpen=0.6", "-a", "mouthSmileLeft=0.9", "-a", "mouthSmileRight=0.9")
    row(
        [
            (splats(bundle, *smile, "--yaw", "25"), "Gaussians, Python runtime"),
            (draw(file, pose_of(bundle, *smile)), "rig.glb moves"),
            (splats(bundle, "--yaw", "25"), "Gaussians stand still"),
        ]
    ).save(ARTIST / "what_you_see.webp", quality=82)
    row(
        [
            (draw(file, State(), colours=False), "default material"),
            (draw(file, State()), "with vertex colours"),
        ]
    ).save(ARTIST / "colours.webp", quality=82)
    clip = [(draw(file, file.state("held_out", second)), f"{second:g} s") for second in (0.0, 0.6, 1.2, 1.8)]
    row(clip).save(ARTIST / "clip.webp", quality=82)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
