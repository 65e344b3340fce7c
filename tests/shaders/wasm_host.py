"""A host of the WebAssembly kernels in Node: plays the program of an avatar up to stage project, with no GPU."""

from __future__ import annotations

import base64
import json
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.posed import Posed
from avatar_runtime.program.bake import program_of
from avatar_runtime.program.chunks import BUFFER_LIMIT
from avatar_runtime.program.model import Pass, Program
from avatar_runtime.rotation import quat_from_matrix
from avatar_shaders import reflection

Array = npt.NDArray[Any]
NODE = Path(__file__).with_name("kernels.mjs")
TABLE = reflection("wgsl")


def run(job: dict[str, Any]) -> dict[str, Any]:
    """The answer of kernels.mjs to a job."""
    done = subprocess.run(["node", str(NODE)], input=json.dumps(job), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer


def play(avatar: Avatar, posed: Posed, camera: Camera) -> dict[str, Any]:
    """The answer for one frame; its buffers as arrays, [n, 4] except for Sh."""
    program, number = program_of(avatar, BUFFER_LIMIT)
    level = program.levels[number]
    frame = frame_of(posed, camera)
    passes = [*(program.mesh if program.reads_mesh else ()), *level.deform, *level.view]
    pose = pose_buffer(program, posed)
    buffers: dict[str, dict[str, Any]] = {}
    for name in {name for one in passes for name in one.buffers.values()}:
        told = program.buffers[name]
        words = pose if name == "Pose" else told.content() if told.sections else None
        buffers[name] = {"bytes": told.size}
        if words is not None:
            buffers[name] = {"bytes": max(told.size, words.nbytes), "words": base64_of(words)}
    read = [name for kind in ("Splats", "Sh", "Projected") for name in level.names(kind)]
    job = {"buffers": buffers, "passes": [job_of(one, frame) for one in passes], "read": read}
    answer = run(job)
    for name, text in answer["buffers"].items():
        floats = np.frombuffer(base64.b64decode(text), np.float32)
        answer["buffers"][name] = floats if "Sh" in name else floats.reshape(-1, 4)
    return answer


def job_of(one: Pass, frame: dict[str, Array]) -> dict[str, Any]:
    """A pass as kernels.mjs takes it."""
    row = TABLE[one.entry]
    (block,) = row["uniform_blocks"]
    data = bytearray(block["size"])
    for member in block["members"]:
        value = one.constants.get(member["name"], 0)
        if isinstance(value, str):
            found = re.fullmatch(r"(\w+?)(?:\[(\d+)\])?", value)
            assert found
            value = frame[found[1]] if found[2] is None else frame[found[1]][int(found[2])]
        kind = "<f4" if member["type"].startswith("float") else "<u4"
        packed = np.asarray(value, kind).tobytes()
        data[member["offset"] : member["offset"] + len(packed)] = packed
    return {
        "entry": one.entry,
        "rows": one.rows,
        "buffers": [one.buffers[item["name"]] for item in row["storage"]],
        "constants": base64.b64encode(data).decode(),
    }


def frame_of(posed: Posed, camera: Camera) -> dict[str, Array]:
    """Values of FRAME_SOURCES."""
    world = posed.world_from_avatar.astype(np.float32)
    rotation = np.pad(posed.groups.rotation, ((0, 0), (0, 0), (0, 1)))
    return {
        **{f"world_row{i}": world[i] for i in range(3)},
        "world_quat_wxyz": quat_from_matrix(world[:3, :3]),
        **{f"group_matrix_row{i}": posed.groups.matrix[:, i] for i in range(3)},
        **{f"group_rotation_row{i}": rotation[:, i] for i in range(3)},
        **{f"camera_row{i}": camera.camera_from_world[i] for i in range(3)},
        **{f"clip_row{i}": camera.clip_from_world[i] for i in range(4)},
        "eye": np.append(camera.centre, np.float32(1)),
        "tan_half_fov": np.array((camera.tan_half_fov_x, camera.tan_half_fov_y)),
        "image_size": np.array((camera.width, camera.height)),
    }


def pose_buffer(program: Program, posed: Posed) -> Array:
    """The words of buffer Pose."""
    floats = np.zeros(program.pose_floats, np.float32)
    given = {
        "weights": posed.expression_weights,
        "features": posed.pose_feature,
        "late": posed.late_weights,
        "joints": posed.skin_matrix[:, :3].reshape(-1),
    }
    for name, values in given.items():
        floats[program.pose[name] : program.pose[name] + len(values)] = values
    return floats


def base64_of(words: Array) -> str:
    """The bytes of an array."""
    return base64.b64encode(np.ascontiguousarray(words).tobytes()).decode()
