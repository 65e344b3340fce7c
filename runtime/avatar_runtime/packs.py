"""Packs in memory: what a `NAME.avatar` file says, and the avatar at each of its levels."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, Avatar, Clip, Driving, Group, Packed, Relight, Rig
from avatar_runtime.checks.avatar import check_avatar, check_driving, check_groups
from avatar_runtime.codec import manifest as codec
from avatar_runtime.codec import pack as file_codec
from avatar_runtime.codec.clips import ARRAYS as CLIP_ARRAYS
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.whole_files import read_bytes
from avatar_runtime.program.check import MOST_WORK, check_program
from avatar_runtime.program.model import Program
from avatar_runtime.program.read import Columns, read_level, read_mesh
from avatar_runtime.stages.surface import binding_pose

SUFFIX = ".avatar"
FILE_LIMIT = 1 << 30  # bytes
WORK_RATIO = 16  # rows and entries of a frame that a level may have a byte of the file
# What the GPU does not need: the skeleton for stage joints, and the triangles of a mesh that no Gaussian is bound to.
RIG_ARRAYS = (
    "parents",
    "rest_local",
    "inverse_bind_matrix",
    "joint_basis",
    "corrective_joints",
    "anchor_vertices",
)
Array = npt.NDArray[Any]


@dataclass(frozen=True)
class Pack:
    """A pack that was read: its document, and its avatar."""

    document: Mapping[str, Any]
    avatar: Avatar  # as stored: `placed` gives embedded Gaussians their positions
    preview: bytes | None  # webp


def is_pack(path: Path) -> bool:
    """Whether a regular file begins as packs do; a pipe is not opened."""
    try:
        if not path.is_file():
            return False
        with path.open("rb") as file:
            return file.read(2) == file_codec.MAGIC
    except OSError:
        return False


def read_pack(path: Path) -> Pack:
    """The pack at `path`, its avatar at the finest level. Raises AvatarError for anything out of order."""
    return decode_pack(read_bytes(path, FILE_LIMIT), str(path))


def decode_pack(data: bytes, name: str) -> Pack:
    """The pack in `data`; `name` is the file in messages. Raises AvatarError as `read_pack`."""
    held = file_codec.decode(data, name)
    try:
        groups = min(len(level["groups"]) for level in held.document["levels"])
        check_program(held.program, groups, min(MOST_WORK, WORK_RATIO * len(data)))
        avatar = _avatar(held, 0)
        _check_levels(held, avatar)
        _check_pose(held.program, avatar)
    except AvatarError as error:
        raise AvatarError(error.message, file=name, field=error.field) from None
    preview = held.arrays.get("preview")
    is_file = preview is not None and preview.dtype == np.uint8
    return Pack(held.document, avatar, preview.tobytes() if preview is not None and is_file else None)


def _check_pose(program: Program, avatar: Avatar) -> None:
    """Sections of Pose have the floats that the names of the avatar need."""
    needed = {"weights": len(avatar.expressions), "late": len(avatar.eyelids), "joints": 0}
    if avatar.rig is not None:
        needed |= {"joints": 12 * avatar.rig.joint_count, "features": 9 * len(avatar.rig.corrective_joints)}
    begins = [*program.pose.values(), program.pose_floats]
    for name, first, end in zip(program.pose, begins, begins[1:], strict=False):
        if end - first != needed.get(name, end - first):
            message = f"takes {end - first} floats; the avatar's names need {needed[name]}"
            raise AvatarError(message, field=f"$.program.pose.{name}")


def _check_levels(held: file_codec.PackFile, avatar: Avatar) -> None:
    """Every level has its own rows and all groups of the finest, since group transforms are shared."""
    finest = [group["binding"] for group in held.document["levels"][0]["groups"]]
    for index, (said, level) in enumerate(zip(held.document["levels"], held.program.levels, strict=True)):
        where = f"$.levels[{index}]"
        if said["count"] != level.rows:
            raise AvatarError(
                f"is {said['count']}; its chunks have {level.rows} rows", field=f"{where}.count"
            )
        check_groups(replace(avatar, groups=_groups(held.document, index)), level.rows)
        if [group["binding"] for group in said["groups"]] != finest:
            raise AvatarError("has other groups than the finest level", field=f"{where}.groups")


def _groups(document: Mapping[str, Any], level: int) -> tuple[Group, ...]:
    """The groups of a level. Their joints and factors are those of the finest, whose transforms all levels share."""
    own, finest = (codec.decode_groups(document["levels"][index]) for index in (level, 0))
    return tuple(replace(group, joint_mix=mix.joint_mix) for group, mix in zip(own, finest, strict=False))


def _avatar(held: file_codec.PackFile, level: int) -> Avatar:
    """The avatar at one level; the finest one also gives the others."""
    document, program = held.document["avatar"], held.program
    driving = document["driving"]
    if driving["mode"] != "matrix":  # then nobody reads one
        driving = {**driving, "matrix": None}
    facts = codec.decode_facts({**document, "driving": driving})
    expressions, late = facts["expressions"], facts["eyelids"]
    rig = _rig(held, document, Columns(len(expressions), 0, len(late), 0))
    features = 0 if rig is None else 9 * len(rig.corrective_joints)
    joints = 0 if rig is None else rig.joint_count
    arrays = read_level(
        program, level, Columns(len(expressions), features, len(late), joints), facts["rules"].position
    )
    facts["sh_degree"] = min(facts["sh_degree"], arrays.gaussians.sh_degree)  # the program says what is drawn
    groups = _groups(held.document, level)
    avatar = Avatar(
        **facts,
        gaussians=arrays.gaussians,
        groups=groups,
        blendshapes=arrays.blendshapes,
        skin=arrays.skin,
        rig=rig,
        embedding=arrays.embedding,
        clips=_clips(held, document["clips"]),
        relight=_relight(document.get("relight"), program, arrays.normal),
    )
    check_avatar(avatar, packed=True)
    if (spelled := spelled_driving(held.document)) is not None:
        check_driving(avatar, spelled)
    return with_program(avatar, program, level, partial(_avatar, held))


def _relight(said: Mapping[str, Any] | None, program: Program, normal: F32 | None) -> Relight | None:
    if any(bool(level.light) != (said is not None) for level in program.levels):
        raise AvatarError("goes with passes of stage light, and they with it", field="$.avatar.relight")
    return None if said is None or normal is None else codec.decode_relight(said, normal)


def spelled_driving(document: Mapping[str, Any]) -> Driving | None:
    """How ARKit drives the avatar of a pack, as its document spells it for players: always a matrix; None: not at all.

    Raises AvatarError for a matrix that is not rows of as many numbers as there are inputs.
    """
    own = document["avatar"]["driving"]
    spelled = own if own["mode"] == "matrix" else document.get("driving")
    if own["mode"] == "none" or spelled is None:
        return None
    linear = {name: spelled.get(name) for name in ("inputs", "outputs", "matrix") if name in spelled}
    return codec.decode_driving({"driving": {**own, "mode": "matrix", **linear}})


def with_program(avatar: Avatar, program: Program, level: int, at: Callable[[int], Avatar]) -> Avatar:
    """`avatar` with the program that plays it; `at` gives the avatar at another level."""
    return replace(avatar, packed=Packed.of(avatar, program, level, len(program.levels), at))


def placed(avatar: Avatar) -> Avatar:
    """`avatar` with positions and rotations of the binding pose, which packs do not store for embedded Gaussians.

    No stage reads them, so its program still plays it.
    """
    e = avatar.embedding
    if e is None:
        return avatar
    mean, quat = binding_pose(e, avatar.rules, avatar.training_per_bundle)
    done = replace(avatar, gaussians=replace(avatar.gaussians, mean=mean, quat_wxyz=quat))
    packed = avatar.packed
    if packed is None:
        return done
    return with_program(done, packed.program, packed.level, lambda level: placed(packed.at(level)))


def _rig(held: file_codec.PackFile, document: Mapping[str, Any], columns: Columns) -> Rig | None:
    if document["joints"] is None:
        return None
    arrays: dict[str, Any] = {name: _array(held.arrays, f"rig.{name}") for name in RIG_ARRAYS}
    features = 9 * arrays["corrective_joints"].size
    mesh = read_mesh(held.program, replace(columns, features=features, joints=len(document["joints"])))
    triangles = _corners(held.program) if held.program.reads_mesh else _array(held.arrays, "rig.triangles")
    if triangles.dtype != np.uint32 or triangles.ndim != 2 or len(triangles) != 3:
        kind = f"{triangles.dtype}{list(triangles.shape)}"
        raise AvatarError(f"is {kind}, not uint32[3, F]", field="array rig.triangles")
    of_mesh: dict[str, Any] = {field.name: getattr(mesh, field.name) for field in fields(mesh)}
    return Rig(
        joint_names=tuple(document["joints"]),
        triangles=np.ascontiguousarray(triangles.T),
        **of_mesh,
        **arrays,
    )


def _corners(program: Program) -> Array:
    """[3, F] triangles that kernels read, which the file does not store once more."""
    bound = next(one.buffers["SurfaceStatic"] for one in program.passes() if "SurfaceStatic" in one.buffers)
    for section in program.buffers[bound].sections:
        if section.name == "corners" and len(section.elements) % 3 == 0:
            return section.elements.astype(np.uint32).reshape(3, -1)
    raise AvatarError("is no section of triangles", field=f"buffer {bound}, corners")


def _array(arrays: Mapping[str, Array], name: str) -> Array:
    if name not in arrays:
        raise AvatarError("is missing", field=f"array {name}")
    return arrays[name]


def clip_arrays(clips: Sequence[Clip], steps: Mapping[str, float] | None) -> dict[str, Array]:
    """The arrays of clips: channels that change, over time, as integers of `steps` (None: as float32).

    "clips.I.NAME.scale" [C, 2]: low and step of each channel; step 0: the channel is `low` throughout. The others lie
    in "clips.I.NAME.codes" [channels, T], as differences from frame to frame.
    """
    found: dict[str, Array] = {}
    for index, clip in enumerate(clips):
        for name in CLIP_ARRAYS:
            values = getattr(clip, name)
            key, flat = f"clips.{index}.{name}", values.reshape(len(values), -1)
            if steps is None:
                found[key] = values
                continue
            low, high = flat.min(axis=0, initial=np.inf), flat.max(axis=0, initial=-np.inf)
            moves = np.flatnonzero(high > low)
            step = np.zeros(flat.shape[1], np.float32)
            step[moves] = np.maximum((high - low)[moves] / np.float32(65535), np.float32(steps[name]))
            scale = np.stack([low, step], axis=1).astype(np.float32)
            codes = np.rint((flat[:, moves] - low[moves]) / step[moves]).astype(np.uint16).T
            found[f"{key}.scale"] = scale
            found[f"{key}.codes"] = np.diff(codes, axis=1, prepend=np.zeros((len(moves), 1), np.uint16))
    return found


def _clips(held: file_codec.PackFile, listed: Sequence[Mapping[str, Any]]) -> tuple[Clip, ...]:
    document = held.document["avatar"]
    joints = 0 if document["joints"] is None else len(document["joints"])
    shapes: dict[str, tuple[int, ...]] = {
        "expression_weights": (len(document["expressions"]),),
        "late_weights": (len(document["late_morphs"]),),
        "joint_delta": (joints, 4, 4),
        "world_from_avatar": (4, 4),
    }
    clips = []
    for index, said in enumerate(listed):
        arrays = {
            name: _clip_array(held.arrays, f"clips.{index}.{name}", int(said["frames"]), shapes[name])
            for name in CLIP_ARRAYS
        }
        clips.append(Clip(said["name"], float(said["fps"]), **arrays))
    return tuple(clips)


def _clip_array(arrays: Mapping[str, Array], key: str, frames: int, shape: tuple[int, ...]) -> Array:
    channels = int(np.prod(shape, dtype=np.int64))
    if key in arrays:
        values = arrays[key]
        if values.shape != (frames, *shape):
            raise AvatarError(f"has shape {list(values.shape)}, not {[frames, *shape]}", field=f"array {key}")
        return values
    scale, codes = _array(arrays, f"{key}.scale"), _array(arrays, f"{key}.codes")
    for name, array, kind in (("scale", scale, np.float32), ("codes", codes, np.uint16)):
        if array.dtype != kind:
            raise AvatarError(f"is {array.dtype}, expected {np.dtype(kind)}", field=f"array {key}.{name}")
    moves = np.flatnonzero(scale[:, 1]) if scale.shape == (channels, 2) else np.zeros(0, np.int64)
    if scale.shape != (channels, 2) or codes.shape != (len(moves), frames):
        raise AvatarError(
            f"has shape {list(codes.shape)}, not {[len(moves), frames]}", field=f"array {key}.codes"
        )
    flat = np.repeat(scale[None, :, 0], frames, axis=0)
    with np.errstate(over="ignore", invalid="ignore"):  # `check_avatar` refuses what is not finite
        flat[:, moves] += np.cumsum(codes, axis=1, dtype=np.uint16).T.astype(np.float32) * scale[moves, 1]
    return flat.reshape(frames, *shape)
