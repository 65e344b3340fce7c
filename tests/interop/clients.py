"""Asks other people's readers in processes of their own: a client is one file, a job one JSON, arrays come back raw.

Rig clients take {"glb", "poses": [{"nodes": {name: {translation, rotation_xyzw, scale}}, "weights": [M]}],
"clips": [{"clip", "times": [seconds]}]} and give "pose/K" and "clip/NAME/K" ([v, 3], world space), "triangles" and
"attribute/NAME". Splat clients take {"file"}, the validator {"files"}.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_runtime.avatar import Avatar
from avatar_runtime.engine_pose import EnginePose
from tests.oracles.gltf_pose import State

Array = npt.NDArray[Any]

HERE = Path(__file__).parent
BLENDER = "AVATAR_BPY_PYTHON"  # environment: an interpreter that has bpy
ROOT_NODE = "avatar_root"
PATHS = ("translation", "rotation_xyzw", "scale")
LIMIT_S = 120


@dataclass(frozen=True)
class Answer:
    """What a client says and the arrays that it gives, each flat."""

    facts: dict[str, Any]
    arrays: dict[str, Array]

    def rows(self, name: str, width: int = 3) -> Array:
        """An array as [rows, width]."""
        return self.arrays[name].reshape(-1, width)


def ask(client: str, **job: Any) -> Answer:
    """Run the client HERE/`client`.mjs or .py on a job. Where Node or its packages are absent the test fails, where
    Blender is absent it is skipped.
    """
    command = _blender(client) if (HERE / f"{client}.py").exists() else _node(client)
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "arrays")
        asked = json.dumps({**job, "out": str(out)})
        done = subprocess.run(command, input=asked, capture_output=True, text=True, timeout=LIMIT_S)
        assert done.returncode == 0, f"{client}: {done.stderr[-2000:]}"
        facts = json.loads(done.stdout)
        return Answer(facts, unpack(out.read_bytes(), facts.pop("arrays")))


def node_program() -> str:
    """Node.js, with the clients' libraries installed; fails the test where they are not."""
    node = shutil.which("node")
    if node is None or not (HERE / "node_modules" / ".package-lock.json").exists():
        missing = "Node.js 18 or newer" if node is None else "tests/interop/node_modules"
        pytest.fail(f"{missing} is missing: `make test` installs it", pytrace=False)
    return node


def _node(client: str) -> list[str]:
    return [node_program(), str(HERE / f"{client}.mjs")]


def blender_program() -> str:
    """A Python that has Blender as a module; skips the test if there is none, since it takes a gigabyte."""
    python = os.environ.get(BLENDER) or (sys.executable if find_spec("bpy") else None)
    if python is None:
        pytest.skip(f"Blender is not here: `pip install bpy`, or {BLENDER} names an interpreter that has it")
    return python


def _blender(client: str) -> list[str]:
    return [blender_program(), str(HERE / f"{client}.py")]


def unpack(data: bytes, layout: Iterable[tuple[str, str, int]]) -> dict[str, Array]:
    """The arrays that lie one behind the other in `data`; the layout has their name, type and length."""
    arrays, at = {}, 0
    for name, kind, length in layout:
        arrays[name] = np.frombuffer(data, kind, length, at)
        at += arrays[name].nbytes
    assert at == len(data)
    return arrays


def job_pose(avatar: Avatar, pose: EnginePose) -> dict[str, Any]:
    """An engine pose as the rig clients take it."""
    return {"nodes": _nodes(avatar, pose), "weights": pose.weights.tolist()}


def oracle_state(avatar: Avatar, pose: EnginePose) -> State:
    """The same as the oracle takes it."""
    nodes = _nodes(avatar, pose)
    return State(
        *({name: node[path] for name, node in nodes.items()} for path in PATHS), pose.weights.tolist()
    )


def _nodes(avatar: Avatar, pose: EnginePose) -> Mapping[str, dict[str, list[float]]]:
    assert avatar.rig is not None
    names = (ROOT_NODE, *avatar.rig.joint_names)
    rows = (
        np.vstack([pose.root_translation, pose.translation]).tolist(),
        np.vstack([pose.root_rotation_xyzw, pose.rotation_xyzw]).tolist(),
        np.vstack([np.ones(3), pose.scale]).tolist(),
    )
    return {name: dict(zip(PATHS, row, strict=True)) for name, *row in zip(names, *rows, strict=True)}
