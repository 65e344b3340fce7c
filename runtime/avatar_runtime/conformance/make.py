"""Makes reference vectors: runs the stages on some rows, each with the outputs of the stages before it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.backends import Stages, make_backend
from avatar_runtime.conformance.arrays import (
    STAGE_ARRAYS,
    Array,
    floor_of,
    inputs_of,
    stages_of,
    tolerances,
    weights,
)
from avatar_runtime.conformance.images import draw, psnr_db, view
from avatar_runtime.conformance.model import Case, CaseVectors, Expected, Reference, Step, Tensor
from avatar_runtime.conformance.rows import kept_pixels, thinned
from avatar_runtime.conformance.stages import at_pixels, posed_anchors, run_stage
from avatar_runtime.light import head_joint, light_arrays
from avatar_runtime.pose import PoseArrays, resolve
from avatar_runtime.stages.groups import group_transforms
from avatar_runtime.stages.joints import joints
from avatar_runtime.stages.light import FAR
from avatar_runtime.stages.raster import PROFILES, Image
from avatar_runtime.subset import Subset, subset

ROWS = 512  # Gaussians, and about as many vertices
PIXELS = 4096  # of each stage raster
FLIPS_IN = 512  # rows or pixels in which one more may flip


@dataclass(frozen=True)
class Maker:
    """What computes a reference: the runtime, or the trainer's own definitions and renderer."""

    made_by: str  # one of model.MADE_BY
    stages: Callable[[Avatar], Stages]  # plays the stages of the avatar that it is given
    draw: Callable[[Avatar, Case], Mapping[str, Image]]  # the whole avatar, by raster profile


RUNTIME = Maker(
    "runtime",
    lambda avatar: make_backend("reference", avatar),
    lambda avatar, case: draw(avatar, case, PROFILES),
)


def make_reference(
    avatar: Avatar,
    cases: Iterable[Case],
    *,
    rows: int = ROWS,
    pixels: int = PIXELS,
    generator: str = "",
    maker: Maker = RUNTIME,
) -> Reference:
    """The reference of `avatar` for `cases`, by default by backend `reference`. Same avatar and cases, same result.

    Raises AvatarError for a pose that names what the avatar lacks.
    """
    part = thinned(avatar, rows)
    if (
        avatar.packed is not None and avatar.rig is not None
    ):  # its players pose all anchor vertices themselves
        part = subset(avatar, part.rows, np.concatenate([part.vertices, avatar.rig.anchor_vertices]))
    tensors: dict[str, Tensor] = {}
    vectors = tuple(_case(avatar, part, case, tensors, pixels, maker) for case in cases)
    return Reference(maker.made_by, generator, avatar.name, part.rows, part.vertices, tensors, vectors)


def _case(
    avatar: Avatar, part: Subset, case: Case, tensors: dict[str, Tensor], pixels: int, maker: Maker
) -> CaseVectors:
    backend = maker.stages(part.avatar)
    latest: dict[str, str] = {}  # array -> the tensor that holds its newest value

    def keep(step: str, arrays: Mapping[str, Tensor]) -> None:
        for name, array in arrays.items():
            latest[name] = f"{case.name}/{step}/{name}"
            tensors[latest[name]] = array

    keep("pose", _given(avatar, part, case))
    steps = []
    for stage in stages_of(avatar, case.light):
        for profile in PROFILES if stage == "raster" else (None,):
            inputs = {array.name: latest[array.name] for array in inputs_of(stage, avatar, case.light)}
            given = {name: tensors[tensor] for name, tensor in inputs.items()}
            outputs = run_stage(avatar, backend, stage, profile, given, case.camera)
            where, label = None, stage if profile is None else f"{stage}.{profile}"
            if profile is not None:
                where = f"{case.name}/{label}/pixels"
                tensors[where] = kept_pixels(outputs["transmittance"] < 1, pixels)
                outputs = at_pixels(outputs, tensors[where])
            keep(label, outputs)
            expected = {}
            for array in STAGE_ARRAYS[stage].outputs:
                weight = weights(array, given, outputs, case.camera)
                expected[array.name] = _expected(stage, array, latest[array.name], tensors, weight, case)
            steps.append(Step(stage, profile, inputs, expected, where))
    if not case.images:
        return CaseVectors(case, tuple(steps))
    drawn = maker.draw(avatar, case)
    return CaseVectors(
        case,
        tuple(steps),
        {profile: view(image) for profile, image in drawn.items()},
        psnr_db(drawn["engine"], drawn["trainer"]),
    )


def _given(avatar: Avatar, part: Subset, case: Case) -> dict[str, Tensor]:
    """What a case starts from; stages replace what they make."""
    arrays = resolve(case.pose, avatar)
    still = group_transforms(avatar, None, None)
    given: dict[str, Tensor] = {
        "expression_weights": arrays.expression_weights,
        "late_weights": arrays.late_weights,
        "joint_delta": arrays.joint_delta,
        "world_from_avatar": arrays.world_from_avatar,
        "background": np.array(case.background, np.float32),
        **_light(avatar, case, arrays),
    }
    if avatar.rig is None:
        given |= {
            "skin_matrix": np.zeros((0, 4, 4), np.float32),
            "pose_feature": np.zeros(avatar.blendshapes.correctives.columns, np.float32),
            "group_matrix": still.matrix,
            "group_rotation": still.rotation,
        }
        if part.avatar.embedding is not None:
            given["posed_vertices"] = bent(part.avatar.embedding.canonical_vertices)
    elif len(avatar.rig.anchor_vertices):
        given["anchor_vertices"] = posed_anchors(avatar.rig, arrays)
    return given


def _light(avatar: Avatar, case: Case, arrays: PoseArrays) -> dict[str, Tensor]:
    """What stages `shadow` and `light` take of the light of a case, if it has one."""
    if case.light is None or avatar.relight is None:
        return {}
    head = head_joint(avatar)
    turned = None if head is None or avatar.rig is None else joints(avatar.rig, arrays).skin_matrix[head]
    lit = light_arrays(case.light, avatar.relight, arrays.world_from_avatar, turned)
    rows = {f"light_{name}": getattr(lit, name) for name in ("ambient", "place", "colour", "turn")}
    return {**rows, "shadow_row": lit.shadow_row, "shadow_offset": lit.shadow_offset}


def bent(vertices: F32) -> F32:
    """A mesh [V, 3] twisted about +Y, a quarter turn over its height, and made a fifth wider.

    Without a rig nothing else poses a mesh, and on the canonical one every rule of a surface is the identity.
    """
    low, high = vertices.min(axis=0).astype(np.float64), vertices.max(axis=0).astype(np.float64)
    x, y, z = (vertices - (low + high) / 2).T
    turn = np.pi / 2 * y / max(high[1] - low[1], 1e-6)
    twisted = np.stack([np.cos(turn) * x + np.sin(turn) * z, y, np.cos(turn) * z - np.sin(turn) * x], axis=1)
    result: F32 = (twisted * [1.2, 1, 1] + (low + high) / 2).astype(np.float32)
    return result


def _expected(
    stage: str, array: Array, tensor: str, tensors: dict[str, Tensor], weight: Tensor | None, case: Case
) -> Expected:
    """`weight` is kept beside the tensor."""
    want = tensors[tensor]
    atol, rtol = tolerances(array, want, floor_of(array, case.camera))
    beside = None
    if weight is not None:
        beside = f"{tensor}.weight"
        tensors[beside] = weight
    rows = int((want < FAR).sum()) if stage == "shadow" else len(want)  # of a shadow map, what is covered
    most = 1 + rows // FLIPS_IN if array.flips in ("drawn", "cutoff", "shadow") else 0
    return Expected(tensor, atol, rtol, beside, array.flips, most)
