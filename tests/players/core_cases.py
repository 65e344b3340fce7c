"""What Node must find for the web player's core: packs with their contents, poses, cameras, programs, a recording."""

from __future__ import annotations

import hashlib
import json
import struct
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random
from types import SimpleNamespace
from typing import Any

import numpy as np
from tools.fuzz.pack_mutants import mutant

from avatar_export.driving.live_link_csv import read_live_link_csv
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import driving_facts, prepare, write
from avatar_runtime.avatar import Avatar, Driving, Expression, Rules
from avatar_runtime.backends.gl.interpreter import Interpreter
from avatar_runtime.camera import Camera
from avatar_runtime.clips import frame_pose
from avatar_runtime.codec import safetensors
from avatar_runtime.conformance import driving_cases, encode_driving
from avatar_runtime.handedness import mirrored
from avatar_runtime.packs import Pack, decode_pack
from avatar_runtime.pose import PoseArrays, resolve
from avatar_runtime.posed import Poser, posed_mesh
from avatar_runtime.program.model import Program
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from avatar_runtime.stages.joints import joints
from avatar_shaders import VERSION
from tests.avatars import full_avatar
from tests.conformance.idle_vectors import FILE as IDLE
from tests.players.hostile.packs import write_hostile
from tests.players.vectors.height_cases import write_height_cases
from tests.players.vectors.light_cases import write_light_cases
from tests.session.fuzz import FACTOR

GOLDEN = Path(__file__).parents[1] / "data" / "packs" / "1.0"
FOUND = sorted((Path(__file__).parents[1] / "data" / "fuzz" / "pack").glob("*/x.avatar"))
assert FOUND, "the corpus of packs that the fuzzer found is not where it was"
RECORDING = Path(__file__).parents[2] / "samples" / "drive" / "live_link_face_rom_300.csv"
POSES = 12  # random ones of each pack
MUTANTS, OF_A_FACTOR = 300, 500  # and so many times AVATAR_FUZZ
Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class Case:
    """A pack and the avatar that Python reads from it."""

    name: str
    file: bytes
    pack: Pack

    @property
    def avatar(self) -> Avatar:
        """At the finest level."""
        return self.pack.avatar

    @property
    def handedness(self) -> str:
        """Of everything in the pack."""
        handedness: str = self.pack.document["avatar"]["frame"]["handedness"]
        return handedness


def write_cases(folder: Path) -> None:
    """Everything, in `folder`."""
    cases = list(packs())
    for case in cases:
        own = folder / case.name
        own.mkdir()
        (own / "pack.avatar").write_bytes(case.file)
        (own / "facts.json").write_text(json.dumps(facts(case)))
        (own / "poses.safetensors").write_bytes(b"".join(safetensors.encode(poses(case.avatar))))
        for name, data in encode_driving(driving_cases(case.avatar, case.handedness)).items():
            (own / name).write_bytes(data)
    write_mutants([case.file for case in cases], folder / "mutated.bin")
    (folder / "hostile").mkdir()
    write_hostile({case.name: case.file for case in cases}, folder / "hostile")
    write_height_cases(folder)
    write_light_cases(folder)
    (folder / "idle.json").write_bytes(IDLE.read_bytes())
    (folder / "cameras.json").write_text(json.dumps(list(cameras())))
    (folder / "recording.csv").write_bytes(RECORDING.read_bytes())
    take = read_live_link_csv(RECORDING.read_bytes(), RECORDING.name)
    held = {"times": take.time, "channels": take.channels, "fps": np.array([take.fps])}
    (folder / "recording.safetensors").write_bytes(b"".join(safetensors.encode(held)))
    (folder / "packs.json").write_text(
        json.dumps({"packs": [case.name for case in cases], "shaders": VERSION})
    )


def write_mutants(files: list[bytes], path: Path) -> None:
    """Past findings and mutants, each after its length; `make fuzz` tries more, other ones on every run."""
    rng = Random(time.time_ns() if FACTOR else 17)
    made = [mutant(rng.choice(files), rng) for _ in range(round(OF_A_FACTOR * FACTOR) or MUTANTS)]
    with path.open("wb") as stream:
        for data in (*(path.read_bytes() for path in FOUND), *made):
            stream.write(struct.pack("<I", len(data)) + data)


def packs() -> Iterator[Case]:
    """The golden packs; and tiny ones of what they lack: another frame, other rules, driving by names, a drift."""
    for path in sorted(GOLDEN.glob("*.avatar")):
        yield _case(path.stem, path.read_bytes())
    full = full_avatar(5)
    assert full.rig is not None
    repeated = replace(full.rig, anchor_vertices=np.array([3, 3, 3, 7, 11, 2, 19], np.uint32))
    made: dict[str, Callable[[], bytes]] = {
        "left": lambda: packed(mirrored(full), "left"),
        "left_names": lambda: packed(mirrored(named(full)), "left"),
        "names": lambda: packed(named(full)),
        "head_in_matrix": lambda: packed(nodding(full)),
        "two_levels": lambda: write(prepare([full, full], Fineness(4.0))).file,
        "head_bone": lambda: packed(replace(full, rules=Rules("head_bone", "jaw", anchor="unique"))),
        "repeats": lambda: packed(replace(full, rig=repeated, rules=Rules("none", anchor="repeats"))),
    }
    for name, make in made.items():
        yield _case(name, make())


def named(avatar: Avatar) -> Avatar:
    """`avatar` driven by names, with a name whose spelling is not ARKit's, and no joint for the head."""
    expressions = (Expression("JawOpen", (), (0.1, 0.6)), *avatar.expressions[1:])
    driving = Driving(
        "names", head_pivot=(0.02, -0.1, 0.3), left_eye_joint="leftEye", right_eye_joint="rightEye"
    )
    return replace(avatar, expressions=expressions, driving=driving)


def nodding(avatar: Avatar) -> Avatar:
    """`avatar` with a matrix that turns the head's joint too, where the order of rotations shows."""
    outputs = ("joint/neck/z", "joint/neck/x", "expression/jawOpen")
    matrix = np.array([[0.7, 0.2], [-0.4, 0.9], [1, 0]], np.float32)
    driving = Driving("matrix", ("jawOpen", "browInnerUp"), outputs, matrix, head_joint="neck")
    return replace(avatar, driving=driving)


def packed(avatar: Avatar, handedness: str = "right") -> bytes:
    """A pack of one level that ARKit drives."""
    return write(prepare([avatar], Fineness(4.0)), driving_facts(avatar), handedness=handedness).file


def _case(name: str, file: bytes) -> Case:
    return Case(name, file, decode_pack(file, name))


def facts(case: Case) -> dict[str, Any]:
    """Hashes of all contents, as Python decodes them."""
    avatar, program = case.avatar, _program(case.avatar)
    found: dict[str, Any] = {
        "buffers": {name: [buffer.size, _sha(buffer.content())] for name, buffer in program.buffers.items()},
        "clips": [
            {
                "name": clip.name,
                "expressionWeights": _sha(clip.expression_weights),
                "lateWeights": _sha(clip.late_weights),
                "jointDelta": _sha(clip.joint_delta),
                "worldFromAvatar": _sha(clip.world_from_avatar),
            }
            for clip in avatar.clips
        ],
        "expressions": [[e.name, list(e.aliases), list(e.range)] for e in avatar.expressions],
        "groups": [[g.name, g.first, g.count, g.binding] for g in avatar.groups],
        "skeleton": None,
        **places(case),
    }
    rig = avatar.rig
    if rig is not None:
        found["skeleton"] = {
            "names": list(rig.joint_names),
            "parents": _sha(rig.parents),
            "restLocal": _sha(rig.rest_local.astype(np.float64)),
            "inverseBindMatrix": _sha(rig.inverse_bind_matrix.astype(np.float64)),
            "jointBasis": _sha(rig.joint_basis.astype(np.float64)),
            "anchorVertices": rig.anchor_vertices.tolist(),
            "anchors": _sha(rig.vertices[np.unique(rig.anchor_vertices)].astype(np.float64)),
        }
    return found


def places(case: Case) -> dict[str, Any]:
    """Where cameras look and what the avatar fills, in the person's frame: right-handed for every pack."""
    document, side = case.pack.document, 1 if case.handedness == "right" else -1
    rest, swept = (document["avatar"]["bounds"][name] for name in ("rest", "swept"))
    framed = (document.get("framing") or {}).get("whole")
    x, y, z = (
        framed["target"] if framed else [(a + b) / 2 for a, b in zip(rest["min"], rest["max"], strict=True)]
    )
    across = sorted(side * swept[name][0] for name in ("min", "max"))
    low, high = ([ends, *swept[name][1:]] for ends, name in zip(across, ("min", "max"), strict=True))
    return {"target": [side * x, y, z], "low": low, "high": high}


def _program(avatar: Avatar) -> Program:
    assert avatar.packed is not None
    program: Program = avatar.packed.program
    return program


def _sha(array: Array) -> str:
    return hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()


def poses(avatar: Avatar) -> dict[str, Array]:
    """Poses and what comes of them: the whole of buffer Pose, transforms of the groups, posed anchor vertices."""
    all_poses = [
        resolve(frame_pose(avatar, clip, frame), avatar)
        for clip in avatar.clips
        for frame in range(clip.frames)
    ]
    all_poses += list(random_poses(avatar))
    poser = Poser(avatar)
    made = [_posed(avatar, poser, arrays) for arrays in all_poses]
    return {name: np.stack([one[name] for one in made]) for name in made[0]}


def random_poses(avatar: Avatar) -> Iterator[PoseArrays]:
    """Joints that turn, move and stretch; weights within and beyond 0 to 1, some of them 0."""
    rng = np.random.default_rng(15)
    joints_ = 0 if avatar.rig is None else avatar.rig.joint_count
    k, late = len(avatar.expressions), len(avatar.eyelids)
    for index in range(POSES):
        turn = matrix_from_rotvec(rng.normal(0, 0.3 * index, (joints_, 3)))
        stretch = np.exp(rng.normal(0, 0.05, (joints_, 1, 3)))
        yield PoseArrays(
            (rng.uniform(-0.5, 1.5, k) * (rng.uniform(size=k) > 0.3)).astype(np.float32),
            rng.uniform(0, 1, late).astype(np.float32),
            homogeneous(turn * stretch, rng.normal(0, 0.01, (joints_, 3))),
            homogeneous(matrix_from_rotvec(rng.normal(0, 1, 3)), rng.normal(0, 1, 3)),
        )


def _posed(avatar: Avatar, poser: Poser, arrays: PoseArrays) -> dict[str, Array]:
    posed = poser.posed(arrays)
    rotation = np.zeros((len(avatar.groups), 3, 4), np.float32)
    rotation[:, :, :3] = posed.groups.rotation
    found: dict[str, Array] = {
        "expression_weights": arrays.expression_weights,
        "late_weights": arrays.late_weights,
        "joint_delta": arrays.joint_delta,
        "world_from_avatar": arrays.world_from_avatar,
        "pose_floats": pose_floats(_program(avatar), posed),
        "group_matrix": posed.groups.matrix,
        "group_rotation": rotation,
    }
    if avatar.rig is not None:
        mesh = posed_mesh(avatar.rig, arrays, joints(avatar.rig, arrays))
        found["anchors"] = mesh[np.unique(avatar.rig.anchor_vertices)]
    return found


def pose_floats(program: Program, posed: Any) -> Array:
    """What the interpreter of backend gl writes to buffer Pose, without a GPU."""
    written: list[bytes] = []
    buffer = SimpleNamespace(write=written.append)
    interpreter = SimpleNamespace(program=program, buffer=lambda _: buffer)
    Interpreter.set_weights(
        interpreter,  # type: ignore[arg-type]
        posed.expression_weights,
        posed.pose_feature,
        posed.late_weights,
        posed.skin_matrix,
    )
    return np.frombuffer(b"".join(written), np.float32)


def cameras() -> Iterator[dict[str, Any]]:
    """Cameras by their arguments."""
    rng = np.random.default_rng(15)
    for _ in range(20):
        target, yaw, pitch = rng.normal(size=3), rng.uniform(-4, 4), rng.uniform(-1.5, 1.5)
        width, height = (int(n) for n in rng.integers(1, 3000, 2))
        distance, fov = rng.uniform(0.1, 9), rng.uniform(0.1, 2.5)
        orbit = Camera.orbit(target, distance, yaw, pitch, fov, width, height)
        given = [target.tolist(), distance, yaw, pitch, fov, width, height]
        yield {"how": "orbit", "given": given, **camera_arrays(orbit)}
        rotation = matrix_from_rotvec(rng.normal(size=3))
        k = np.array([[rng.uniform(50, 900), 3, 200], [0, rng.uniform(50, 900), 333], [0, 0, 1]])
        seen = Camera.from_opencv(rotation, target, k, width, height)
        given = [rotation.ravel().tolist(), target.tolist(), k.ravel().tolist(), width, height]
        yield {"how": "fromOpencv", "given": given, **camera_arrays(seen)}


def camera_arrays(camera: Camera) -> Mapping[str, Any]:
    """What a player must have of `camera`."""
    return {
        "cameraFromWorld": camera.camera_from_world.ravel().tolist(),
        "clipFromWorld": camera.clip_from_world.ravel().tolist(),
        "centre": camera.centre.tolist(),
        "tanHalfFov": [camera.tan_half_fov_x, camera.tan_half_fov_y],
    }
