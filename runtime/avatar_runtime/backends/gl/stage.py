"""One stage alone on the GPU: its inputs are uploaded, its kernels run, its outputs are downloaded."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from avatar_runtime.avatar import F32
from avatar_runtime.backends import Arrays
from avatar_runtime.backends.gl.deform import Deformer
from avatar_runtime.backends.gl.draw import Drawing, over
from avatar_runtime.backends.gl.transfer import (
    put_projected,
    put_splats,
    take_projected,
    take_sh,
    take_splats,
)
from avatar_runtime.camera import Camera
from avatar_runtime.stages.groups import GroupTransforms

Outputs = dict[str, Any]
POSE_ARRAYS = ("expression_weights", "pose_feature", "late_weights", "skin_matrix")


def run_stage(
    name: str, deformer: Deformer, drawing: Drawing, inputs: Arrays, camera: Camera | None
) -> Outputs:
    """Outputs of stage `name` as `conformance.STAGE_ARRAYS` names them."""
    given = {array: np.asarray(inputs[array], np.float32) for array in POSE_ARRAYS if array in inputs}
    deformer.set_weights(**given)
    return RUN[name](deformer, drawing, inputs, camera)


def _morph(deformer: Deformer, drawing: Drawing, x: Arrays, camera: Camera | None) -> Outputs:
    deformer.mesh.morph()
    return {"vertices": deformer.mesh.download()}


def _skin(deformer: Deformer, drawing: Drawing, x: Arrays, camera: Camera | None) -> Outputs:
    deformer.mesh.upload(x["vertices"])
    deformer.mesh.skin()
    return {"posed_vertices": deformer.mesh.download()}


def _blend(deformer: Deformer, drawing: Drawing, x: Arrays, camera: Camera | None) -> Outputs:
    deformer.blend()
    found = take_splats(deformer.chunks)
    return {
        "mean": found["mean"],
        "log_scale": found["scale"],
        "quat_wxyz": found["quat_wxyz"],
        "opacity_logit": found["opacity"],
        "sh": take_sh(deformer.chunks, deformer.avatar.gaussians.sh.shape[1]),
    }


def _bind(deformer: Deformer, drawing: Drawing, x: Arrays, camera: Camera | None) -> Outputs:
    put_splats(deformer.chunks, x)
    deformer.set_transforms(GroupTransforms(x["group_matrix"], x["group_rotation"]), x["world_from_avatar"])
    if deformer.surface is not None:
        deformer.mesh.upload(x["posed_vertices"])
    deformer.bind()
    found = take_splats(deformer.chunks)
    return {
        "mean": found["mean"],
        "log_scale": found["scale"],
        "quat_wxyz": found["quat_wxyz"],
        "sh_rotation": found["sh_rotation"],
    }


def _activate(deformer: Deformer, drawing: Drawing, x: Arrays, camera: Camera | None) -> Outputs:
    put_splats(deformer.chunks, x)
    deformer.activate()
    found = take_splats(deformer.chunks)
    return {name: found[name] for name in ("scale", "quat_wxyz", "opacity")}


def _project(deformer: Deformer, drawing: Drawing, x: Arrays, camera: Camera | None) -> Outputs:
    assert camera is not None
    put_splats(deformer.chunks, x)
    deformer.project(camera)
    return take_projected(deformer.chunks)


def _sort(deformer: Deformer, drawing: Drawing, x: Arrays, camera: Camera | None) -> Outputs:
    put_projected(deformer.chunks, x)
    drawing.sort.run()
    return {"order": drawing.sort.take()}


def _raster(deformer: Deformer, drawing: Drawing, x: Arrays, camera: Camera | None) -> Outputs:
    assert camera is not None
    put_projected(deformer.chunks, x)
    drawing.sort.put(x["order"])
    background: F32 = np.asarray(x["background"], np.float32)
    image = over(drawing.raster(camera, None).read(), background)
    return {"colour": image.colour, "transmittance": image.transmittance}


RUN: dict[str, Callable[[Deformer, Drawing, Arrays, Camera | None], Outputs]] = {
    "morph": _morph,
    "skin": _skin,
    "blend": _blend,
    "bind": _bind,
    "activate": _activate,
    "project": _project,
    "sort": _sort,
    "raster": _raster,
}
