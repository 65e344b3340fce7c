"""The stages as a port sees them: inputs, outputs, and how far an output may be from the reference."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.driving.arkit import CHANNELS
from avatar_runtime.light import AMBIENT_TERMS, MOST_LIGHTS, SHADOW_SIZE, Light, turned
from avatar_runtime.rules import RIGGED_ROTATIONS

Tensors = Mapping[str, npt.NDArray[Any]]

# Half a unit in the last place of float32 at 1: what one operation may round by. Tolerances are multiples of it,
# a few times the number of operations that lie between a stage's input and its output.
ROUNDING = 2.0**-24


@dataclass(frozen=True)
class Array:
    """One input or output: dtype, shape in symbols (see `sizes`), and for an output its tolerance.

    An element may be off by atol * weight of its row + rtol * |reference|, with
    atol = roundings * ROUNDING * max(floor, largest |reference|) and rtol = relative * ROUNDING.
    """

    name: str
    dtype: str
    shape: tuple[str | int, ...]
    roundings: float = 0.0
    relative: float = 0.0
    floor: float | str = (
        0.0  # size of the terms that may cancel in the sum; "image": the longer side of the image
    )
    weight: str | None = None  # a key of WEIGHTS: how ill-conditioned each row is; then `floor` is not read
    flips: str | None = None  # a key of FLIPS
    when: str = "always"  # a key of WHEN


@dataclass(frozen=True)
class Stage:
    """One stage's table row."""

    inputs: tuple[Array, ...]
    outputs: tuple[Array, ...]
    when: str = "always"


def _f32(name: str, *shape: str | int, when: str = "always") -> Array:
    return Array(name, "float32", shape, when=when)


def _inverted(inputs: Tensors, outputs: Tensors, camera: Camera) -> F32:
    """Per row how far the conic moves when its covariance rounds: an inverse C moves by |C|^2 times that.

    The covariance, in pixels squared, is a difference of terms as large as the splat's longest axis: small for a needle
    seen from its end.
    """
    focal = max(camera.width / camera.tan_half_fov_x, camera.height / camera.tan_half_fov_y) / 2
    drawn = outputs["radius"] > 0
    depth = np.where(drawn, outputs["depth"], 1.0).astype(np.float64)
    longest = inputs["scale"].max(axis=1, initial=0.0) * focal / depth
    size = outputs["conic"][:, 0].astype(np.float64) + outputs["conic"][:, 2]
    weight: F32 = np.where(drawn, size**2 * (longest**2 + 1), 0.0).astype(np.float32)
    return weight


WEIGHTS: Mapping[str, Callable[[Tensors, Tensors, Camera], F32]] = {"conic": _inverted}

# Where two right answers differ by more than rounding. `sign`: q and -q are one rotation, told apart by rounding
# near half a turn. `drawn`: the radius, a ceil, may be one off, and a row on the border of the image or of the near
# plane may be drawn or not; its other arrays are then not judged. `cutoff`: alpha at 1/255 and transmittance at 1e-4
# are thresholds; a pixel on the other side moves by no more than FLIP_STEP times the brightest colour. `shadow`: which
# texels a splat covers is a threshold, and so is whether a texel shadows a row; the other side may be anything.
FLIPS = ("sign", "drawn", "cutoff", "shadow")
FLIP_STEP = 4e-3  # a little more than 1/255, the alpha that is lost or gained

# By the avatar, and the light of the case.
WHEN: Mapping[str, Callable[[Avatar, Light | None], bool]] = {
    "always": lambda avatar, light: True,
    "rig": lambda avatar, light: avatar.rig is not None,
    "mesh": lambda avatar, light: avatar.rig is not None and len(avatar.rig.vertices) > 0,
    "anchor": lambda avatar, light: any(group.binding == "anchor" for group in avatar.groups),
    "skin": lambda avatar, light: avatar.embedding is None,
    "surface": lambda avatar, light: avatar.embedding is not None,
    "joints": lambda avatar, light: avatar.embedding is None or avatar.rules.rotation in RIGGED_ROTATIONS,
    "casting": lambda avatar, light: avatar.embedding is not None or WHEN["mesh"](avatar, light),
    "lit": lambda avatar, light: light is not None,
    "turned": lambda avatar, light: light is not None and turned(avatar),
    "shadowed": lambda avatar, light: light is not None and light.shadow,
}

_WEIGHTS_IN = _f32("expression_weights", "K")
_LATE_IN = _f32("late_weights", "L")

STAGE_ARRAYS: Mapping[str, Stage] = {
    "joints": Stage(
        (
            _WEIGHTS_IN,
            Array("joint_delta", "float64", ("J", 4, 4)),
            _f32("anchor_vertices", "A", 3, when="anchor"),
        ),
        (
            # A chain of about ten products; 1 is the size of the terms that cancel in R - I and in translations.
            Array("skin_matrix", "float32", ("J", 4, 4), 64, floor=1.0),
            Array("pose_feature", "float32", ("F",), 8, floor=1.0),
            # The fit to the anchors and three Newton steps; a fit divides rounding by the anchors' spread.
            Array("group_matrix", "float32", ("G", 3, 4), 256, floor=1.0),
            Array("group_rotation", "float32", ("G", 3, 3), 256, floor=1.0),
        ),
        when="rig",
    ),
    "morph": Stage(
        (_WEIGHTS_IN, _f32("pose_feature", "F")),
        (Array("vertices", "float32", ("V", 3), 32),),  # a sum over expressions and features
        when="mesh",
    ),
    "skin": Stage(
        (_f32("vertices", "V", 3), _f32("skin_matrix", "J", 4, 4), _LATE_IN),
        (Array("posed_vertices", "float32", ("V", 3), 64),),  # a sum of matrices, one product, late morphs
        when="mesh",
    ),
    "blend": Stage(
        (_WEIGHTS_IN,),
        (
            Array("mean", "float32", ("N", 3), 32),
            Array("log_scale", "float32", ("N", 3), 32),
            Array("quat_wxyz", "float32", ("N", 4), 32),
            Array("opacity_logit", "float32", ("N",), 32),
            Array("sh", "float32", ("N", "S", 3), 32),
        ),
    ),
    "bind": Stage(
        (
            _f32("mean", "N", 3),
            _f32("log_scale", "N", 3),
            _f32("quat_wxyz", "N", 4),
            _f32("group_matrix", "G", 3, 4),
            _f32("group_rotation", "G", 3, 3),
            Array("world_from_avatar", "float64", (4, 4)),
            _f32("pose_feature", "F", when="skin"),
            _f32("late_weights", "L", when="skin"),
            _f32("skin_matrix", "J", 4, 4, when="joints"),
            _f32("posed_vertices", "V", 3, when="surface"),
        ),
        (
            Array("mean", "float32", ("N", 3), 128),
            Array("log_scale", "float32", ("N", 3), 64),
            # Three Newton steps, or a mean of vertex quaternions of either sign that cancels in part.
            Array("quat_wxyz", "float32", ("N", 4), 128, flips="sign"),
            Array("sh_rotation", "float32", ("N", 3, 3), 128, floor=1.0),
        ),
    ),
    "activate": Stage(
        (_f32("log_scale", "N", 3), _f32("quat_wxyz", "N", 4), _f32("opacity_logit", "N")),
        (
            # exp by way of exp2 rounds an argument of up to 30: that moves the result by 30 roundings, twice.
            Array("scale", "float32", ("N", 3), relative=64),
            Array("quat_wxyz", "float32", ("N", 4), 8, floor=1.0, flips="sign"),
            Array("opacity", "float32", ("N",), relative=64),
        ),
    ),
    "shadow": Stage(
        (
            _f32("mean", "N", 3),
            _f32("scale", "N", 3),
            _f32("quat_wxyz", "N", 4),
            _f32("opacity", "N"),
            _f32("posed_vertices", "V", 3, when="casting"),
            Array("world_from_avatar", "float64", (4, 4)),
            _f32("shadow_row", 4, 4),
        ),
        # One product with a matrix, whose terms are larger than the distance.
        (Array("shadow", "float32", (SHADOW_SIZE**2,), relative=128, flips="shadow"),),
        when="shadowed",
    ),
    "project": Stage(
        (
            _f32("mean", "N", 3),
            _f32("scale", "N", 3),
            _f32("quat_wxyz", "N", 4),
            _f32("opacity", "N"),
            _f32("sh", "N", "S", 3),
            _f32("sh_rotation", "N", 3, 3),
        ),
        (
            Array("radius", "int32", ("N",), flips="drawn"),
            Array("centre", "float32", ("N", 2), 64, floor="image"),
            Array("depth", "float32", ("N",), 16),
            Array("conic", "float32", ("N", 3), 32, weight="conic"),
            Array("opacity", "float32", ("N",)),
            Array("rgb", "float32", ("N", 3), 128, floor=1.0),  # sixteen terms of degree up to three
        ),
    ),
    "light": Stage(
        (
            _f32("mean", "N", 3),
            _f32("quat_wxyz", "N", 4),
            Array("radius", "int32", ("N",)),
            _f32("rgb", "N", 3),
            _f32("light_turn", 3, 4),
            _f32("light_ambient", AMBIENT_TERMS, 4),
            _f32("light_place", MOST_LIGHTS, 4),
            _f32("light_colour", MOST_LIGHTS, 4),
            _f32("shadow_offset", 4),
            _f32("shadow_row", 4, 4, when="shadowed"),
            _f32("shadow", SHADOW_SIZE**2, when="shadowed"),
            _f32("posed_vertices", "V", 3, when="turned"),
            Array("world_from_avatar", "float64", (4, 4), when="turned"),
        ),
        # Light is divided by as little as 0.05, and the steepest part of the curve multiplies a channel by 12.92.
        (Array("rgb", "float32", ("N", 3), 256, floor=1.0, flips="shadow"),),
        when="lit",
    ),
    "sort": Stage(
        (_f32("depth", "N"), Array("radius", "int32", ("N",))),
        (Array("order", "int64", ("D",)),),  # the key is an exact input, so the order is exact
    ),
    "raster": Stage(
        (
            _f32("centre", "N", 2),
            _f32("conic", "N", 3),
            _f32("opacity", "N"),
            _f32("rgb", "N", 3),
            Array("radius", "int32", ("N",)),
            Array("order", "int64", ("D",)),
            _f32("background", 3),
        ),
        (
            # An exponent, its exp and one factor of transmittance a splat, over some tens of splats.
            Array("colour", "float32", ("P", 3), 128, floor=1.0, flips="cutoff"),
            Array("transmittance", "float32", ("P",), 128, floor=1.0, flips="cutoff"),
        ),
    ),
}

# What comes before the stages: ARKit channels to the inputs of stage `joints`. Its vectors are in files of their own.
DRIVING = "driving"
DRIVING_ARRAYS = Stage(
    (_f32("channels", len(CHANNELS)),),
    (
        # A sum over 52 inputs; 1 is the size of a weight, whose terms may cancel.
        Array("expression_weights", "float32", ("K",), 64, floor=1.0),
        Array("late_weights", "float32", ("L",), 64, floor=1.0),
        # The same sum, sine and cosine, three products of rotations, and a product and a solve with the rest frame.
        Array("joint_delta", "float64", ("J", 4, 4), 64, floor=1.0),
        Array("world_from_avatar", "float64", (4, 4), 32, floor=1.0),
    ),
)
JUDGED: Mapping[str, Stage] = {DRIVING: DRIVING_ARRAYS, **STAGE_ARRAYS}


def stages_of(avatar: Avatar, light: Light | None = None) -> tuple[str, ...]:
    """The stages that `avatar` has in a light, in order."""
    return tuple(name for name, stage in STAGE_ARRAYS.items() if WHEN[stage.when](avatar, light))


def inputs_of(stage: str, avatar: Avatar, light: Light | None = None) -> tuple[Array, ...]:
    """The inputs that a stage takes for `avatar` in a light."""
    return tuple(array for array in STAGE_ARRAYS[stage].inputs if WHEN[array.when](avatar, light))


def sizes(avatar: Avatar) -> dict[str, int]:
    """What the symbols stand for: N Gaussians, S SH coefficients, V vertices, A anchor vertices, K expressions,
    L late morphs, J joints, F pose features, G groups. P (pixels kept) and D (splats drawn) differ by case.
    """
    rig, embedding = avatar.rig, avatar.embedding
    vertices = 0 if rig is None else len(rig.vertices)
    return {
        "N": avatar.gaussians.count,
        "S": avatar.gaussians.sh.shape[1],
        "V": vertices if embedding is None else len(embedding.canonical_vertices),
        "A": 0 if rig is None else len(rig.anchor_vertices),
        "K": len(avatar.expressions),
        "L": len(avatar.eyelids),
        "J": 0 if rig is None else rig.joint_count,
        "F": avatar.blendshapes.correctives.columns,
        "G": len(avatar.groups),
    }


def weights(array: Array, inputs: Tensors, outputs: Tensors, camera: Camera) -> F32 | None:
    """Factor of each row's tolerance, for an output that has one."""
    return None if array.weight is None else WEIGHTS[array.weight](inputs, outputs, camera)


def floor_of(array: Array, camera: Camera) -> float:
    """Size of the terms that may cancel in an output."""
    return float(max(camera.width, camera.height)) if isinstance(array.floor, str) else array.floor


def tolerances(array: Array, want: npt.NDArray[Any], floor: float) -> tuple[float, float]:
    """(atol, rtol) of an output whose reference is `want`; `floor` as `floor_of` gives it."""
    size = 1.0 if array.weight else max(floor, float(np.abs(want.astype(np.float64)).max(initial=0.0)))
    return array.roundings * ROUNDING * size, array.relative * ROUNDING
