"""What poses must become in the Unity player's core: engine bones, packets, and a pack with many joints."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from avatar_export.driving.frames import CHANNEL_LIMIT
from avatar_export.driving.live_link_udp import parse_packet
from avatar_runtime.avatar import Avatar, Clip, Driving, Expression, SparseRows
from avatar_runtime.codec import safetensors
from avatar_runtime.driving.arkit import ARKIT_NAMES
from avatar_runtime.engine_pose import bind_nodes, engine_pose, engine_rest, node_transforms
from avatar_runtime.handedness import mirrored, mirrored_matrices
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.packs import decode_pack
from avatar_runtime.pose import Pose, PoseArrays
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from tests.avatars import full_avatar
from tests.exporter.live.senders import live_link_packets
from tests.players.core_cases import packed, random_poses
from tests.rigs import rig_of, scaled_at_rest, with_rig

Array = np.ndarray[Any, Any]
WIDE_EXPRESSIONS, WIDE_JOINTS, WIDE_FRAMES = 51, 262, 4
PARTS = ("translation", "rotation_xyzw", "scale", "root_translation", "root_rotation_xyzw")
PACKETS, CHANGES = 8, 40  # recorded ones, and how often each is changed
NAMES = [  # of a device: at both sides of every border of UTF-8, and of the longest name
    bytes.fromhex(text)
    for text in (
        "7f", "80", "c1bf", "c280", "dfbf", "df", "e09fbf", "e0a080", "ed9fbf", "eda080", "ee8080", "e28241",
        "f08fbfbf", "f0908080", "f48fbfbf", "f4908080", "f5808080", "f09f98", "ff", "61" * 1024, "61" * 1025,
    )
]  # fmt: skip


def write_pose_cases(folder: Path, packs: dict[str, bytes]) -> None:
    """Folders `bones` and `wide`, and `packets.bin`."""
    (folder / "bones").mkdir()
    full = full_avatar(5)
    rig = rig_of(full)
    moved = rig.inverse_bind_matrix @ homogeneous(matrix_from_rotvec(np.array([0.2, -0.1, 0.3])), np.ones(3))
    more = {
        "scaled": packed(scaled_at_rest(full, (1.5, 0.5, 2.0))),
        "bound_elsewhere": packed(with_rig(full, inverse_bind_matrix=moved.astype(np.float32))),
    }
    for name, file in {**packs, **more}.items():
        pack = decode_pack(file, name)
        avatar, handedness = pack.avatar, pack.document["avatar"]["frame"]["handedness"]
        if avatar.rig is not None:
            own = folder / "bones" / name
            own.mkdir()
            (own / "pack.avatar").write_bytes(file)
            held = bones(avatar, handedness, sheared=name == "scaled")
            (own / "bones.safetensors").write_bytes(b"".join(safetensors.encode(held)))
    (folder / "wide").mkdir()
    (folder / "wide" / "pack.avatar").write_bytes(wide_pack())
    (folder / "packets.bin").write_bytes(b"".join(_judged(packet) for packet in packets()))


def bones(avatar: Avatar, handedness: str, sheared: bool) -> dict[str, Array]:
    """Poses, and the bones of them in a left-handed engine: as engine_pose splits them, and what the engine shows.

    `regular`: poses whose bones are not flat, so that there is one way to split them.
    """
    poses = list(random_poses(avatar))
    poses.append(stretched(poses[3], 1, [0], -1.5))
    regular = len(poses)
    if not sheared:
        poses += [
            stretched(poses[2], joint, axes, 0) for joint, axes in ((1, [1]), (1, [0, 1, 2]), (2, [0, 2]))
        ]
    seen = avatar if handedness == "left" else mirrored(avatar)
    made = [engine_pose(seen, _pose(seen, one, handedness == "right")) for one in poses]
    rest, rig = engine_rest(seen), rig_of(seen)
    skin = np.stack([node_transforms(rig, one) for one in made]) @ np.linalg.inv(bind_nodes(rig))
    return {
        "expression_weights": np.stack([one.expression_weights for one in poses]),
        "joint_delta": np.stack([one.joint_delta for one in poses]),
        "world_from_avatar": np.stack([one.world_from_avatar for one in poses]),
        **{name: np.stack([getattr(one, name) for one in made]) for name in PARTS},
        **{f"rest_{name}": getattr(rest, name) for name in PARTS[:3]},
        "binds": bind_nodes(rig),
        "skin": skin if handedness == "left" else mirrored_matrices(skin),
        "regular": (np.arange(len(poses)) < regular).astype(np.int32),
    }


def stretched(pose: PoseArrays, joint: int, axes: list[int], factor: float) -> PoseArrays:
    """`pose` with a joint that is scaled along some axes."""
    delta = pose.joint_delta.copy()
    delta[joint][:3, axes] *= factor
    return replace(pose, joint_delta=delta)


def _pose(avatar: Avatar, arrays: PoseArrays, mirror: bool) -> Pose:
    delta, world = arrays.joint_delta, arrays.world_from_avatar
    if mirror:
        delta, world = mirrored_matrices(delta), mirrored_matrices(world)
    return Pose(
        dict(zip(avatar.expression_names, map(float, arrays.expression_weights), strict=True)),
        dict(zip(rig_of(avatar).joint_names, delta, strict=True)),
        dict(zip(avatar.eyelids, map(float, arrays.late_weights), strict=True)),
        world,
    )


def wide_pack(joints: int = WIDE_JOINTS) -> bytes:
    """A head of 51 expressions that all move rest joints, with anchors, and 5 or more joints, the rest in one chain."""
    full, rng = full_avatar(5), np.random.default_rng(15)
    rig, b = rig_of(full), full.blendshapes
    names = (*rig.joint_names, *(f"joint_{j}" for j in range(rig.joint_count, joints)))
    parents = np.array([*rig.parents, *range(rig.joint_count - 1, joints - 1)], np.int32)
    more = joints - rig.joint_count
    turns = matrix_from_rotvec(rng.normal(0, 0.02, (more, 3)))
    local = np.concatenate([rig.rest_local, homogeneous(turns, rng.normal(0, 1e-3, (more, 3)))])
    world = local.astype(np.float64)
    for joint, parent in enumerate(parents):
        world[joint] = world[joint] if parent < 0 else world[parent] @ world[joint]
    k = WIDE_EXPRESSIONS
    wide = with_rig(
        full,
        morphs=_widened(rig.morphs, k),
        skin=_widened(rig.skin, joints),
        joint_names=names,
        parents=parents,
        rest_local=local.astype(np.float32),
        inverse_bind_matrix=np.linalg.inv(world).astype(np.float32),
        joint_basis=rng.normal(0, 1e-3, (k, joints, 3)).astype(np.float32),
    )
    frames = (WIDE_FRAMES, joints, 3)
    clip = Clip(
        "all",
        30.0,
        rng.uniform(0, 1, (WIDE_FRAMES, k)).astype(np.float32),
        np.zeros((WIDE_FRAMES, len(full.eyelids)), np.float32),
        homogeneous(matrix_from_rotvec(rng.normal(0, 0.05, frames)), np.zeros(frames)).astype(np.float32),
        np.tile(np.eye(4, dtype=np.float32), (WIDE_FRAMES, 1, 1)),
    )
    skin = full.skin
    assert skin is not None
    return packed(
        replace(
            wide,
            expressions=tuple(Expression(name) for name in ARKIT_NAMES[:k]),
            blendshapes=replace(b, geometry=_widened(b.geometry, k), appearance=_widened(b.appearance, k)),
            skin=_widened(skin, joints),
            driving=Driving("names", head_joint="neck", left_eye_joint="leftEye", right_eye_joint="rightEye"),
            clips=(clip,),
        )
    )


def _widened(rows: SparseRows, columns: int) -> SparseRows:
    return SparseRows(rows.row_ptr, rows.column, rows.values, columns)


def packets() -> Iterator[bytes]:
    """Recorded packets, and each of them changed: cut, longer, other bytes, other numbers."""
    rng = Random(17)
    for packet in live_link_packets()[:PACKETS]:
        yield packet
        face = len(packet) - 4 * 61
        for value in (float("nan"), float("inf"), -float("inf"), 1e-42, 99.0, -100.0, 100.01):
            at = face + 4 * rng.randrange(61)
            yield packet[:at] + struct.pack(">f", value) + packet[at + 4 :]
        yield packet[: face - 1]  # no face
        yield packet[: face - 1] + b"\0"
        yield b""
        rest = packet[5 + struct.unpack_from(">I", packet, 1)[0] :]
        for name in NAMES:
            yield packet[:1] + struct.pack(">I", len(name)) + name + rest
        for _ in range(CHANGES):
            at = rng.randrange(len(packet))
            yield packet[:at]
            yield packet + bytes(rng.randrange(1, 9))
            head = rng.randrange(face)  # of what comes before the face
            yield packet[:head] + bytes([rng.randrange(256)]) + packet[head + 1 :]
            yield packet[:5] + rng.randbytes(3) + packet[8:]  # of the device's name


def _judged(packet: bytes) -> bytes:
    """u32 length, the packet, u8 whether it has a face that is taken, and then its 61 float64."""
    body = b""
    with suppress(AvatarError):
        channels = parse_packet(packet).channels
        if channels is not None and (np.abs(channels) <= CHANNEL_LIMIT).all():
            body = channels.astype("<f8").tobytes()
    return struct.pack("<I", len(packet)) + packet + bytes([bool(body)]) + body
