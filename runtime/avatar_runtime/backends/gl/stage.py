"""One stage alone on the GPU: its inputs are uploaded, its kernels run, its outputs are downloaded."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from avatar_runtime.avatar import F32
from avatar_runtime.backends import Arrays
from avatar_runtime.backends.gl.draw import Drawing, over
from avatar_runtime.backends.gl.interpreter import Interpreter
from avatar_runtime.backends.gl.steps import Steps
from avatar_runtime.backends.gl.transfer import (
    put_projected,
    put_splats,
    take_projected,
    take_sh,
    take_splats,
)
from avatar_runtime.camera import Camera
from avatar_runtime.light import LightArrays
from avatar_runtime.stages.groups import GroupTransforms

Outputs = dict[str, Any]
POSE_ARRAYS = ("expression_weights", "pose_feature", "late_weights", "skin_matrix")


def run_stage(
    name: str, player: Interpreter, drawing: Drawing, inputs: Arrays, camera: Camera | None
) -> Outputs:
    """Outputs of stage `name` as `conformance.STAGE_ARRAYS` names them."""
    given = {array: np.asarray(inputs[array], np.float32) for array in POSE_ARRAYS if array in inputs}
    player.set_weights(**given)
    player.set_light(None)  # stages shadow and light run where they are asked for
    return RUN[name](player, drawing, inputs, camera)


def _steps(player: Interpreter) -> Steps:
    return Steps(player.gpu.context, None)


def _run(player: Interpreter, stage: str) -> None:
    passes = player.mesh if stage in ("morph", "skin") else player.deforming
    passes.run(_steps(player), [stage])


def _morph(player: Interpreter, drawing: Drawing, x: Arrays, camera: Camera | None) -> Outputs:
    _run(player, "morph")
    return {"vertices": player.download_mesh()}


def _skin(player: Interpreter, drawing: Drawing, x: Arrays, camera: Camera | None) -> Outputs:
    player.upload_mesh(x["vertices"])
    _run(player, "skin")
    return {"posed_vertices": player.download_mesh()}


def _blend(player: Interpreter, drawing: Drawing, x: Arrays, camera: Camera | None) -> Outputs:
    _run(player, "blend")
    found = take_splats(player.chunks)
    return {
        "mean": found["mean"],
        "log_scale": found["scale"],
        "quat_wxyz": found["quat_wxyz"],
        "opacity_logit": found["opacity"],
        "sh": take_sh(player.chunks, player.sh_terms),
    }


def _bind(player: Interpreter, drawing: Drawing, x: Arrays, camera: Camera | None) -> Outputs:
    put_splats(player.chunks, x)
    player.set_transforms(GroupTransforms(x["group_matrix"], x["group_rotation"]), x["world_from_avatar"])
    if player.program.reads_mesh:
        player.upload_mesh(x["posed_vertices"])
    _run(player, "bind")
    found = take_splats(player.chunks)
    return {
        "mean": found["mean"],
        "log_scale": found["scale"],
        "quat_wxyz": found["quat_wxyz"],
        "sh_rotation": found["sh_rotation"],
    }


def _activate(player: Interpreter, drawing: Drawing, x: Arrays, camera: Camera | None) -> Outputs:
    put_splats(player.chunks, x)
    _run(player, "activate")
    found = take_splats(player.chunks)
    return {name: found[name] for name in ("scale", "quat_wxyz", "opacity")}


def _project(player: Interpreter, drawing: Drawing, x: Arrays, camera: Camera | None) -> Outputs:
    assert camera is not None
    put_splats(player.chunks, x)
    player.project(camera, _steps(player))
    return take_projected(player.chunks)


def _shadow(player: Interpreter, drawing: Drawing, x: Arrays, camera: Camera | None) -> Outputs:
    put_splats(player.chunks, x)
    player.set_light(LightArrays.of(x))
    player.set_world(x["world_from_avatar"])
    if "posed_vertices" in x:
        player.upload_mesh(x["posed_vertices"])
    player.shadowing.run(_steps(player))
    return {"shadow": np.frombuffer(player.buffer("Shadow").read(), np.float32)}


def _light(player: Interpreter, drawing: Drawing, x: Arrays, camera: Camera | None) -> Outputs:
    if "posed_vertices" in x:
        player.set_world(x["world_from_avatar"])
        player.upload_mesh(x["posed_vertices"])
        _run(player, "bind")
    put_splats(player.chunks, x)
    put_projected(player.chunks, x)
    player.set_light(LightArrays.of(x))
    if "shadow" in x:
        player.buffer("Shadow").write(x["shadow"].tobytes())
    player.lighting.run(_steps(player))
    return {"rgb": take_projected(player.chunks)["rgb"]}


def _sort(player: Interpreter, drawing: Drawing, x: Arrays, camera: Camera | None) -> Outputs:
    put_projected(player.chunks, x)
    drawing.sort.run()
    return {"order": drawing.sort.take()}


def _raster(player: Interpreter, drawing: Drawing, x: Arrays, camera: Camera | None) -> Outputs:
    assert camera is not None
    put_projected(player.chunks, x)
    drawing.sort.put(x["order"])
    background: F32 = np.asarray(x["background"], np.float32)
    image = over(drawing.raster(camera, None).read(), background)
    return {"colour": image.colour, "transmittance": image.transmittance}


RUN: dict[str, Callable[[Interpreter, Drawing, Arrays, Camera | None], Outputs]] = {
    "morph": _morph,
    "skin": _skin,
    "blend": _blend,
    "bind": _bind,
    "activate": _activate,
    "shadow": _shadow,
    "project": _project,
    "light": _light,
    "sort": _sort,
    "raster": _raster,
}
