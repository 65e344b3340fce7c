"""A rig for an embedded avatar from a separate file: a skinned .glb or .fbx of the same mesh, or an ASM face."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from avatar_export.asm.bake import bake_rig
from avatar_export.asm.files import load
from avatar_export.formats.fbx.file import open_fbx
from avatar_export.notes.note import Note, fact
from avatar_export.rigs.fbx_rig import fbx_rig
from avatar_export.rigs.gltf_rig import GltfRig, read_rig
from avatar_runtime.avatar import F64, I64, Rig
from avatar_runtime.codec import glb
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.whole_files import read_bytes

MAX_FILE_BYTES = 512 << 20


@dataclass(frozen=True)
class RigFile:
    """The result of `read_rig_file`."""

    rig: Rig  # without correctives, late morphs, joint basis and anchors
    morph_names: tuple[str, ...]  # [K] columns of rig.morphs
    vertex_ids: I64 | None  # [V] row of each vertex in the mesh that the file was made from, if stored
    notes: tuple[Note, ...]


def read_rig_file(path: Path) -> RigFile:
    """The rig in a .glb, .fbx or ASM face (.npz): right-handed, Y up, metres; all meshes on one skeleton joined.

    Mesh space is the scene: if the nodes of a .glb do not have its binding pose, the stored mesh moves with the joint
    that has the largest weight (so a mesh that was bound lying, or in centimetres, becomes upright and metric).
    Raises AvatarError for another kind of file, and as `gltf_rig.read_rig` and `fbx_rig.fbx_rig`.
    """
    read = READERS.get(path.suffix.lower())
    if read is None:
        raise AvatarError(f"is not a rig that can be read; pass a {' or '.join(READERS)} file", file=path)
    return read(path)


def _from_glb(path: Path) -> RigFile:
    found = read_rig(glb.decode(read_bytes(path, MAX_FILE_BYTES), path.name), join=True)
    notes = (fact("weights_renormalised", count=found.renormalised),) if found.renormalised else ()
    return RigFile(_standing(found, path.name), found.morph_names, found.vertex_ids, notes)


def _from_fbx(path: Path) -> RigFile:
    found = fbx_rig(open_fbx(path))
    return RigFile(found.rig, found.morph_names, None, found.notes)


def _from_asm(path: Path) -> RigFile:
    return RigFile(bake_rig(load(path)), (), None, (fact("asm_neutral"),))


READERS: dict[str, Callable[[Path], RigFile]] = {".glb": _from_glb, ".fbx": _from_fbx, ".npz": _from_asm}


def _standing(found: GltfRig, file: str) -> Rig:
    """The rig in scene space. Only the mesh space changes; posed vertices stay the same."""
    if not found.node_pose:
        return found.rig
    rig = found.rig
    posed: list[F64] = []
    for joint, parent in enumerate(rig.parents):
        local = rig.rest_local[joint].astype(np.float64) @ found.node_pose[rig.joint_names[joint]]
        posed.append(local if parent < 0 else posed[parent] @ local)
    weight = np.bincount(rig.skin.column, rig.skin.values["weight"], rig.joint_count)
    heaviest = int(np.argmax(weight))
    move = posed[heaviest] @ rig.inverse_bind_matrix[heaviest].astype(np.float64)
    rest = rig.rest_local.astype(np.float64)
    roots = rig.parents < 0
    rest[roots] = move @ rest[roots]
    with np.errstate(all="ignore"):
        bind = rig.inverse_bind_matrix.astype(np.float64) @ np.linalg.inv(move)
        bind[:, 3] = (0, 0, 0, 1)
        rest[:, 3] = (0, 0, 0, 1)
        position = rig.morphs.values["position"] @ move[:3, :3].T
        standing = replace(
            rig,
            vertices=(rig.vertices @ move[:3, :3].T + move[:3, 3]).astype(np.float32),
            morphs=replace(rig.morphs, values={"position": position.astype(np.float32)}),
            rest_local=rest.astype(np.float32),
            inverse_bind_matrix=bind.astype(np.float32),
        )
    numbers = (
        standing.vertices,
        standing.rest_local,
        standing.inverse_bind_matrix,
        standing.morphs.values["position"],
    )
    if not all(np.isfinite(array).all() for array in numbers):
        raise AvatarError("has a rest transform out of the range of float32", file=file, field="nodes")
    return standing
