"""What the Unity player's core must find beside `core_cases`: proxy meshes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from avatar_runtime.avatar import Avatar, Rig, SparseRows
from avatar_runtime.codec import safetensors
from avatar_runtime.packs import decode_pack
from tests.players.core_cases import Case, facts
from tests.players.unity_pose_cases import write_pose_cases

BONES = 4  # of a vertex of the proxy
Array = np.ndarray[Any, Any]


def write_unity_cases(core: Path, folder: Path) -> None:
    """All cases in `folder`; those of the web player's core, which lie in `core`, too."""
    for path in core.iterdir():
        if path.is_file():
            (folder / path.name).symlink_to(path)
            continue
        (folder / path.name).mkdir()
        for file in path.iterdir():
            (folder / path.name / file.name).symlink_to(file)
    files = {}
    for name in json.loads((core / "packs.json").read_text())["packs"]:
        files[name] = (core / name / "pack.avatar").read_bytes()
        avatar = decode_pack(files[name], name).avatar
        if avatar.rig is not None:
            data = b"".join(safetensors.encode(proxy(avatar, avatar.rig)))
            (folder / name / "proxy.safetensors").write_bytes(data)
    write_pose_cases(folder, files)


def write_contents(files: dict[str, bytes], folder: Path) -> None:
    """Packs by name, each with what Python reads from it."""
    for name, file in files.items():
        (folder / name).mkdir()
        (folder / name / "pack.avatar").write_bytes(file)
        (folder / name / "facts.json").write_text(
            json.dumps(facts(Case(name, file, decode_pack(file, name))))
        )
    (folder / "packs.json").write_text(json.dumps({"packs": list(files)}))


def proxy(avatar: Avatar, rig: Rig) -> dict[str, Array]:
    """Positions, triangles, dense deltas of expressions and late morphs, weights of the four largest joints."""
    vertices = len(rig.vertices)
    deltas = [
        dense(rig.morphs, "position", vertices, len(avatar.expressions)),
        dense(rig.late_morphs, "position", vertices, len(avatar.eyelids)),
    ]
    weights = dense(rig.skin, "weight", vertices, rig.joint_count)[..., 0].T
    smaller = np.argsort(-weights, axis=1, kind="stable")[:, BONES:]  # of equal ones the first stay
    np.put_along_axis(weights, smaller, 0, axis=1)
    return {
        "positions": rig.vertices,
        "triangles": rig.triangles.astype(np.uint32),
        "deltas": np.concatenate(deltas).astype(np.float32),
        "bones": (weights / weights.sum(1, keepdims=True)).astype(np.float32),
    }


def dense(rows: SparseRows, name: str, count: int, columns: int) -> Array:
    """[columns, rows, channels] of sparse rows."""
    values = rows.values[name].astype(np.float64)
    values = values.reshape(len(values), -1)
    found = np.zeros((columns, count, values.shape[1] if values.size else 3))
    row = np.repeat(np.arange(count), rows.row_ptr[1:] - rows.row_ptr[:-1])
    np.add.at(found, (rows.column.astype(np.int64), row), values)
    return found
