"""A scale rule that does not exist, `sqrt_area`: its row in the table and its formula in each of four languages.

`patch` puts it into a copy of the sources. What a contributor edits for a new rule is what stands here, and SPEC.md.
Run as a program in such a copy, this module plays the rule on every backend and prints what they make of it.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

NAME = "sqrt_area"
ROW = {"name": NAME, "code": 3, "families": ["surface_by_vertices"], "source": "made up: l + ln(A / A0) / 2"}
TABLE = "schema/avatar_schema/v1/rules.json"


class Formula(NamedTuple):
    """`before` stands once in a file and becomes `after`."""

    file: str
    before: str
    after: str


NUMPY = "runtime/avatar_runtime/stages/surface.py"
NUMBA = "runtime/avatar_runtime/backends/cpu/deform/embedded.py"
HLSL = "engine_shaders/avatar_shaders/hlsl/bind_surface.hlsl"
TORCH = "trainer/avatar_trainer/stages/surface.py"

FORMULAS = (
    Formula(
        NUMPY,
        "SIGNED = {",
        "def _sqrt_area(surface: Surface, shape: TriangleShape, log_scale: F32) -> F32:\n"
        "    at = surface.embedding.triangle\n"
        "    growth = np.log(np.maximum(shape.size[at], TINY) / surface.canonical.size[at]) / 2\n"
        "    return (log_scale + growth[:, None]).astype(np.float32)\n\n\n"
        "SIGNED = {",
    ),
    Formula(NUMPY, 'SCALES = {"none"', 'SCALES = {"sqrt_area": _sqrt_area, "none"'),
    Formula(NUMBA, "LINEAR = code(", 'SQRT_AREA = code("scale", "sqrt_area")\nLINEAR = code('),
    Formula(
        NUMBA,
        "    if rules.scale == LINEAR:\n        return math.log(",
        "    if rules.scale == SQRT_AREA:\n"
        "        return math.log(max(posed_mesh.size[triangle], TINY) / mesh.size[triangle]) / 2\n"
        "    if rules.scale == LINEAR:\n        return math.log(",
    ),
    Formula(
        NUMBA,
        "    if rules.scale == LINEAR:\n        return np.float32(log_scale + factor)",
        "    if rules.scale == LINEAR or rules.scale == SQRT_AREA:\n        return np.float32(log_scale + factor)",
    ),
    Formula(
        HLSL,
        "    if (scale_rule == AVATAR_SCALE_LOG_AREA)",
        "    if (scale_rule == AVATAR_SCALE_SQRT_AREA)\n"
        "    {\n        return log_scale + log(max(size, AVATAR_TINY) / canonical) / 2;\n    }\n"
        "    if (scale_rule == AVATAR_SCALE_LOG_AREA)",
    ),
    Formula(
        TORCH,
        "VERTEX_TURNS = {",
        "def _sqrt_area(posed: Tensor, canonical: Tensor, training_per_bundle: float) -> tuple[Tensor, Tensor]:\n"
        "    return torch.ones_like(posed), (posed.clamp_min(TINY) / canonical).log() / 2\n\n\n"
        "VERTEX_TURNS = {",
    ),
    Formula(TORCH, 'SCALES = {"none"', 'SCALES = {"sqrt_area": _sqrt_area, "none"'),
)


def patch(root: Path) -> None:
    """Puts the row and the formulas into the sources below `root`."""
    table: dict[str, Any] = json.loads((root / TABLE).read_text("utf-8"))
    table["rules"]["scale"]["values"].append(ROW)
    (root / TABLE).write_text(json.dumps(table), "utf-8")
    for file, before, after in FORMULAS:
        text = (root / file).read_text("utf-8")
        assert text.count(before) == 1, f"{file} has no single {before!r}"
        (root / file).write_text(text.replace(before, after), "utf-8")


def played(scale: str) -> dict[str, list[list[float]]]:
    """{backend: log scales [N, 3]} of an avatar under that scale rule on a mesh that has grown, by stage `bind`."""
    from avatar_runtime.avatar import Rules
    from avatar_runtime.backends import Stages, make_backend
    from avatar_trainer.bundles.definitions import TrainerStages
    from tests.avatars import surface_avatar

    avatar = surface_avatar(3, Rules("vertex_quaternion", scale=scale))  # checked
    assert avatar.embedding is not None and avatar.rig is not None
    g = avatar.gaussians
    inputs = {
        "mean": g.mean,
        "log_scale": g.log_scale,
        "quat_wxyz": g.quat_wxyz,
        "posed_vertices": avatar.embedding.canonical_vertices * np.float32(1.5),
        "world_from_avatar": np.eye(4),
        "skin_matrix": np.tile(np.eye(4, dtype=np.float32), (avatar.rig.joint_count, 1, 1)),
        "group_matrix": np.tile(np.eye(3, 4, dtype=np.float32), (len(avatar.groups), 1, 1)),
        "group_rotation": np.tile(np.eye(3, dtype=np.float32), (len(avatar.groups), 1, 1)),
    }
    stages: dict[str, Stages] = {name: make_backend(name, avatar) for name in ("reference", "cpu", "gl")}
    stages["trainer"] = TrainerStages(avatar)
    return {
        name: (backend.stage("bind", inputs, None, "trainer")["log_scale"] - g.log_scale).tolist()
        for name, backend in stages.items()
    }


def main() -> None:
    """Prints as JSON where schema and table come from, what the schema says of the rule, and `played`."""
    import avatar_schema
    from avatar_runtime.avatar import Rules
    from avatar_schema.validate import key_problems

    rules = asdict(Rules("vertex_quaternion", scale=NAME)) | {"normal": "unit", "late_morphs": "after_skin"}
    problems = [str(problem) for problem in key_problems(rules, "rules")]
    json.dump({"schema": avatar_schema.__file__, "problems": problems, "growth": played(NAME)}, sys.stdout)


if __name__ == "__main__":
    main()
