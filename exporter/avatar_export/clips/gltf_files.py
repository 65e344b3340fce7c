"""The animations of a .glb, or of a zip or folder that LAM wrote: animation.glb, and bsData.json with expressions."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from avatar_export.clips import gltf_clip
from avatar_export.clips.poses import clip_from_poses
from avatar_export.driving import expression_json
from avatar_export.driving.frames import frame_rate
from avatar_export.formats.file_set import MAX_FILE_BYTES, FileSet, holds_together
from avatar_export.formats.gltf.animation import clip_names, read_clip
from avatar_runtime.avatar import Avatar, Clip
from avatar_runtime.codec import glb
from avatar_runtime.codec.glb import Glb
from avatar_runtime.io.whole_files import read_bytes

SKIN = "skin.glb"  # of a LAM zip
CLIPS, EXPRESSIONS = "animation.glb", expression_json.FILE  # optional
FPS = 30.0  # frames per second of a clip whose keys are not evenly spaced
RATES = (5.0, 240.0)  # range of key rates that become the rate of a clip


def holds_gltf(path: Path) -> bool:
    """Whether `path` is a .glb, or a zip or folder that LAM wrote, with clips or without; never raises."""
    return _is_glb(path) or holds_together(path, (SKIN,))


def gltf_of(path: Path) -> Glb | None:
    """The glTF with the clips of `path`; None without clips, and for other files. Raises AvatarError for damage."""
    if _is_glb(path):
        return glb.decode(read_bytes(path, MAX_FILE_BYTES), path.name)
    if not holds_gltf(path):
        return None
    files = FileSet(path, (SKIN,))
    return glb.decode(files.read(CLIPS), CLIPS) if files.has(CLIPS) else None


def expressions_of(path: Path) -> bytes | None:
    """The bsData.json in the zip or folder `path` that LAM wrote; None without one, and for other files."""
    if _is_glb(path) or not holds_gltf(path):
        return None
    files = FileSet(path, (SKIN,))
    return files.read(EXPRESSIONS) if files.has(EXPRESSIONS) else None


def unmatched(avatar: Avatar, path: Path, name: str) -> list[str]:
    """The nodes and targets that a glTF clip moves and `avatar` has no joint or expression for; [] for other files."""
    document = gltf_of(path)
    if document is None or name not in clip_names(document):
        return []
    return gltf_clip.unmatched(avatar, document, name)


def clip_named(avatar: Avatar, document: Glb, name: str) -> Clip:
    """The animation `name` of `document` as a clip of `avatar`, at `rate`. Raises AvatarError as `clip_poses`."""
    fps = rate(document, name)
    return clip_from_poses(avatar, name, fps, gltf_clip.clip_poses(avatar, document, name, fps))


def moves(avatar: Avatar, document: Glb, name: str) -> bool:
    """Whether the clip moves a joint or an expression of the avatar."""
    clip = read_clip(document, name)
    moved = sum(
        bool(set(channels) - {"weights"}) + ("weights" in channels) * len(clip.nodes[node].targets)
        for node, channels in clip.channels.items()
    )
    return moved > len(gltf_clip.unmatched(avatar, document, name))


def rate(document: Glb, name: str) -> float:
    """Frames per second: the key rate of the sampler with the most keys, if it is even, else FPS."""
    samplers = [s for moved in read_clip(document, name).channels.values() for s in moved.values()]
    times = max((s.times for s in samplers), key=len, default=np.zeros(1))
    fps = frame_rate(times)
    frames = times * fps
    even = np.abs(frames - np.round(frames)).max() < 0.01 and RATES[0] <= fps <= RATES[1]
    return fps if even and len(times) > 2 else FPS


def _is_glb(path: Path) -> bool:
    return path.suffix.lower() == ".glb"
