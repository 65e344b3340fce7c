"""embedding.json: the tensors of embedding.safetensors as text, for people and for tools without a binary reader."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import Avatar
from avatar_runtime.codec.embedding import embedding_tensors
from avatar_runtime.topology import topology_hash
from avatar_schema import LATEST

FORMAT = "avatar-export.embedding"
SURFACE_RULES = ("rotation", "position", "scale", "quaternion_sign", "sh_direction")


def embedding_json(avatar: Avatar, handedness: str = "right") -> Iterator[bytes] | None:
    """The file in pieces, one tensor each; None for an avatar that is not bound to a surface.

    `avatar` is in the frame that `handedness` names.

    Numbers are the shortest decimals that give the same float32 again. `schema/avatar_schema/v1/
    embedding.schema.json` describes it.
    """
    return None if avatar.embedding is None else _pieces(avatar, handedness)


def _pieces(avatar: Avatar, handedness: str) -> Iterator[bytes]:
    assert avatar.embedding is not None
    rules = asdict(avatar.rules)
    e = avatar.embedding
    head = {
        "format": FORMAT,
        "version": LATEST,
        "handedness": handedness,
        "length_unit": "metre",
        "training_per_bundle": avatar.training_per_bundle,
        "rules": {name: rules[name] for name in SURFACE_RULES},
        "topology_hash": topology_hash(e.triangles, len(e.canonical_vertices)),
    }
    yield json.dumps(head, indent=1, ensure_ascii=False)[:-2].encode()
    for name, array in embedding_tensors(e).items():
        yield f',\n "{name}": '.encode() + _array(array)
    yield b"\n}\n"


def _array(array: npt.NDArray[Any]) -> bytes:
    """JSON of an array of one or two axes, a line for each row of the latter."""
    text = array.reshape(-1).astype(np.str_).tolist()
    if array.ndim == 1:
        return ("[" + ",".join(text) + "]").encode()
    width = array.shape[1]
    rows = (",".join(text[at : at + width]) for at in range(0, len(text), width))
    return ("[" + ",\n  ".join(f"[{row}]" for row in rows) + "]").encode()
