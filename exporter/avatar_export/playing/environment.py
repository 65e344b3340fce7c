"""Environment maps: a Radiance picture .hdr of all directions as the ambient light of a scene.

OpenCV decodes it. The middle of the picture is +X, a quarter to its right +Z (where a face looks), its upper edge +Y:
as three.js and Blender place it. A map that is white all around is the ambient light 1.
"""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import numpy as np

from avatar_runtime.avatar import F32, F64
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.whole_files import read_bytes
from avatar_runtime.light import COSINE, Light, sh_bases
from avatar_schema.extras import how_to_install

SUFFIX = ".hdr"
LARGEST_FILE = 256 << 20  # bytes
MOST_ROWS = 8192
ROWS = 128  # that are summed: light of second order is smooth
SIZE = re.compile(rb"#\?(?:RADIANCE|RGBE)\n.*?\n\n-Y ([0-9]{1,6}) \+X ([0-9]{1,6})\n", re.DOTALL)
HEADER = 1 << 16  # bytes
BRIGHTEST = 1e8  # times white: a sun has 1e5


def environment_light(path: Path) -> Light:
    """The light of the environment map at `path`. Raises AvatarError for a file that is none."""
    data = read_bytes(path, LARGEST_FILE)
    found = SIZE.match(data[:HEADER])
    if found is None:
        raise AvatarError("is no Radiance picture (.hdr); other pictures hold no light", file=path.name)
    height, width = int(found[1]), int(found[2])
    if width != 2 * height or height > MOST_ROWS:
        message = (
            f"is {width}x{height}; a map of all directions is twice as wide as high, up to {MOST_ROWS} high"
        )
        raise AvatarError(message, file=path.name)
    return Light(ambient(_decoded(data, path)))


def ambient(radiance: F32) -> F32:
    """[9, 3] what a white matt surface reflects under `radiance` [H, 2 H, 3], as SH of its normal."""
    height, width = radiance.shape[:2]
    edge = np.cos(np.linspace(0, np.pi, height + 1))
    up = np.cos((np.arange(height) + 0.5) * np.pi / height)
    turn = ((np.arange(width) + 0.5) / width - 0.5) * 2 * np.pi
    level = np.sqrt(1 - up**2)[:, None]
    way = np.stack(
        [level * np.cos(turn), np.broadcast_to(up[:, None], radiance.shape[:2]), level * np.sin(turn)], -1
    )
    angle = (edge[:-1] - edge[1:]) * 2 * np.pi / width  # solid, of a pixel of each row
    rows: F64 = np.einsum("hwk,hwc,h->kc", sh_bases(way), radiance.astype(np.float64), angle)
    return (COSINE[:, None] * rows).astype(np.float32)


def _decoded(data: bytes, path: Path) -> F32:
    """[H, W, 3] linear rgb, at most ROWS high."""
    if importlib.util.find_spec("cv2") is None:
        raise AvatarError(f"reading .hdr needs the extra [hdr]: {how_to_install('hdr')}", file=path.name)
    import cv2

    logs = cv2.utils.logging  # of a damaged picture it prints lines of its own
    level = logs.setLogLevel(logs.LOG_LEVEL_SILENT)
    try:
        pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        pixels = None
    finally:
        logs.setLogLevel(level)
    if pixels is None or pixels.dtype != np.float32 or pixels.ndim != 3 or not np.isfinite(pixels).all():
        raise AvatarError("is damaged: it cannot be decoded", file=path.name)
    if pixels.max() > BRIGHTEST:
        most = f"{BRIGHTEST:g} is the most"
        raise AvatarError(f"has a pixel of {pixels.max():g} times white; {most}", file=path.name)
    if len(pixels) > ROWS:
        pixels = cv2.resize(pixels, (2 * ROWS, ROWS), interpolation=cv2.INTER_AREA)
    return pixels[..., ::-1].astype(np.float32)
