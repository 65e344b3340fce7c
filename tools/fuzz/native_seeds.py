"""What the native player's fuzzer begins with: packs whose rows and texts are few, so that an input costs little."""

from __future__ import annotations

import gzip
import json
import struct
import zlib
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
from tests.avatars import full_avatar, surface_avatar

from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_runtime.avatar import Avatar, Clip
from avatar_runtime.subset import subset
from tools.fuzz.pack_mutants import mutant

MUTANTS = 2000
ROWS, FRAMES, DRIVEN = 1, 2, 2  # of a group, of a clip, of the driving matrix
COARSE = Fineness(40.0)
READ = (
    "name", "frame", "rules", "expressions", "late_morphs", "joints", "clips", "driving", "background", "bounds",
)  # what players read of the avatar, a name and its licence aside  # fmt: skip


def tiny() -> list[bytes]:
    """Packs of avatars of the tests: every binding, with and without a rig, and float32 throughout."""
    full = full_avatar(3)
    return [small(one) for one in (full, surface_avatar(3), surface_avatar(3, rigged=False))] + [
        small(full, None)
    ]


def write_seeds(folder: Path, packs: list[bytes]) -> None:
    """The lean body of each pack, and mutants; the smallest ones also as gzip files, of each kind of block."""
    bodies = sorted((lean(file) for file in packs), key=len)
    rng = Random(9)
    for number in range(MUTANTS):
        body = bodies[number % min(len(packs), 4)]
        with suppress(OSError, EOFError, zlib.error):
            (folder / f"{number}.mutant").write_bytes(gzip.decompress(mutant(gzip.compress(body, 1), rng)))
    for number, body in enumerate(bodies):
        (folder / f"{number}.body").write_bytes(body)
    for level in (0, 1, 9):
        (folder / f"{level}.gz").write_bytes(gzip.compress(bodies[0], level, mtime=0))


def small(avatar: Avatar, fine: Fineness | None = COARSE) -> bytes:
    """The pack of a few rows of an avatar, under all its rules."""
    firsts = [np.arange(group.first, group.first + min(ROWS, group.count)) for group in avatar.groups]
    anchors = [] if avatar.rig is None else [np.arange(ROWS), avatar.rig.anchor_vertices]
    vertices = np.unique(np.concatenate(anchors)) if anchors else np.zeros(0, np.int64)
    part = subset(avatar, np.concatenate(firsts), vertices).avatar
    driving = avatar.driving
    if driving.matrix is not None:
        few = driving.matrix[:DRIVEN, :DRIVEN]
        driving = replace(
            driving, inputs=driving.inputs[:DRIVEN], outputs=driving.outputs[:DRIVEN], matrix=few
        )
    part = replace(part, clips=tuple(map(_short, part.clips[:1])), driving=driving)
    return pack([part], fine).file


def _short(clip: Clip) -> Clip:
    return replace(
        clip,
        expression_weights=clip.expression_weights[:FRAMES],
        late_weights=clip.late_weights[:FRAMES],
        joint_delta=clip.joint_delta[:FRAMES],
        world_from_avatar=clip.world_from_avatar[:FRAMES],
    )


def lean(file: bytes) -> bytes:
    """The body of a pack, its tensors under short names, without what players do not read."""
    body = gzip.decompress(file)
    (length,) = struct.unpack_from("<Q", body)
    header: dict[str, Any] = json.loads(body[8 : 8 + length])
    document = json.loads(header.pop("__metadata__")["pack"])
    names = {name: f"t{number}" for number, name in enumerate(header)}
    sections = [one for buffer in document["program"]["buffers"] for one in buffer.get("sections", [])]
    for one in [*sections, *document["arrays"].values()]:
        if "tensor" in one:
            one["tensor"] = names[one["tensor"]]
    document["avatar"] = {key: value for key, value in document["avatar"].items() if key in READ}
    document = {key: value for key, value in document.items() if key not in ("error", "packing")}
    text = _packed(document).decode()
    new = _packed({"__metadata__": {"pack": text}, **{names[name]: header[name] for name in header}})
    return struct.pack("<Q", len(new)) + new + body[8 + length :]


def _packed(value: Any) -> bytes:
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False).encode()
