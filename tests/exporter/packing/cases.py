"""Avatars and packs that the tests of packing share."""

from __future__ import annotations

import gzip
import json
from dataclasses import replace
from typing import Any

from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack, prepare, write
from avatar_runtime.avatar import Avatar
from avatar_runtime.subset import subset
from tests.avatars import full_avatar, surface_avatar

COARSE = Fineness(40.0)  # so that steps are wide: every code then differs from its float32
AVATARS = {
    "joints": full_avatar(3),
    "surface": surface_avatar(3),
    "surface without a rig": surface_avatar(3, rigged=False),
}


def levels_of(avatar: Avatar) -> list[Avatar]:
    """The avatar, and a coarser one of every second Gaussian."""
    rows = [row for group in avatar.groups for row in range(group.first, group.first + group.count, 2)]
    whole = avatar.embedding
    part = subset(avatar, rows, range(len(avatar.rig.vertices)) if avatar.rig else []).avatar
    part = replace(part, rig=avatar.rig, packed=None)
    if whole is not None and part.embedding is not None:
        fields = ("barycentric", "displacement", "local_offset", "local_quat_wxyz", "triangle")
        arrays = {name: getattr(whole, name) for name in fields}
        kept = {name: array[rows] if len(array) else array for name, array in arrays.items()}
        part = replace(part, embedding=replace(whole, **kept))
    return [avatar, part]


def opened(file: bytes) -> tuple[dict[str, Any], dict[str, Any], bytes]:
    """(header without the document, document, tensors' bytes) of a pack."""
    body = gzip.decompress(file)
    size = int.from_bytes(body[:8], "little")
    header = json.loads(body[8 : 8 + size])
    document = json.loads(header.pop("__metadata__")["pack"])
    return header, document, body[8 + size :]


def closed(header: dict[str, Any], document: Any, tensors: bytes, level: int = 1) -> bytes:
    """The file of such parts, whatever is in them."""
    text = json.dumps({"__metadata__": {"pack": json.dumps(document)}, **header}).encode()
    return gzip.compress(len(text).to_bytes(8, "little") + text + tensors, level)


__all__ = ["AVATARS", "COARSE", "closed", "levels_of", "opened", "pack", "prepare", "write"]
