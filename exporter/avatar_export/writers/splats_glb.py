"""splats.glb: the binding pose as KHR_gaussian_splatting points, for viewers that know the extension.

Other viewers show COLOR_0, a cloud of points. Source: Khronos, extensions/2.0/Khronos/KHR_gaussian_splatting
(ratified).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pygltflib as gltf

from avatar_export.ops.vertex_colour import linear_from_display
from avatar_export.writers.glb_builder import Array, GlbBuilder
from avatar_runtime.avatar import F32, F64, Avatar, Gaussians
from avatar_runtime.stages.activate import sigmoid
from avatar_schema import constants

FILE = "splats.glb"
EXTENSION = "KHR_gaussian_splatting"
SETTINGS = {  # the last two are the extension's defaults, written for clarity
    "kernel": "ellipse",
    "colorSpace": "srgb_rec709_display",
    "projection": "perspective",
    "sortingMethod": "cameraDistance",
}
LARGEST = np.finfo(np.float32).max


def splats_glb(avatar: Avatar) -> Iterator[bytes | memoryview]:
    """The bytes of splats.glb in pieces: the Gaussians in their order, SH up to the active degree.

    Unit quaternions, linear scales and opacities. Values that overflow linear float32 become its largest number; a
    quaternion of length 0 becomes the identity, as it is drawn. Same avatar, same bytes.
    """
    builder = GlbBuilder(FILE)
    attributes = {"POSITION": builder.accessor(avatar.gaussians.mean, gltf.ARRAY_BUFFER, bounds=True)}
    colour = _fallback_colour(avatar.gaussians)
    attributes["COLOR_0"] = builder.accessor(colour, gltf.ARRAY_BUFFER, normalized=True)
    for name, array in _splat_attributes(avatar.gaussians, avatar.sh_degree).items():
        attributes[f"{EXTENSION}:{name}"] = builder.accessor(array, gltf.ARRAY_BUFFER)
    primitive = gltf.Primitive(
        attributes=gltf.Attributes(**attributes), mode=gltf.POINTS, extensions={EXTENSION: SETTINGS}
    )
    document = builder.document
    document.extensionsUsed = [EXTENSION]
    document.meshes = [gltf.Mesh(name="avatar_splats", primitives=[primitive])]
    document.nodes = [gltf.Node(name="avatar_splats", mesh=0)]
    document.scenes = [gltf.Scene(nodes=[0])]
    return builder.pieces()


def _splat_attributes(gaussians: Gaussians, degree: int) -> dict[str, Array]:
    """The extension's attributes, [N, ...] float32 each; the SH are views."""
    with np.errstate(over="ignore"):
        scale = np.minimum(np.exp(gaussians.log_scale), LARGEST)
    attributes: dict[str, Array] = {
        "ROTATION": _unit_xyzw(gaussians.quat_wxyz),
        "SCALE": scale,
        "OPACITY": sigmoid(gaussians.opacity_logit),
    }
    for order in range(degree + 1):
        for index in range(2 * order + 1):
            attributes[f"SH_DEGREE_{order}_COEF_{index}"] = gaussians.sh[:, order * order + index]
    return attributes


def _unit_xyzw(quat_wxyz: F32) -> F32:
    quat: F64 = np.roll(quat_wxyz, -1, axis=1).astype(np.float64)
    length = np.linalg.norm(quat, axis=1, keepdims=True)
    quat = np.where(length > 0, quat / np.where(length > 0, length, 1), [0.0, 0.0, 0.0, 1.0])
    return quat.astype(np.float32)


def _fallback_colour(gaussians: Gaussians) -> Array:
    """[N, 4] u8, linear light, straight alpha: the colour of SH degree 0, clamped to what a display shows."""
    display = np.clip(gaussians.sh[:, 0].astype(np.float64) * constants()["sh_c0"][0] + 0.5, 0, 1)
    linear = linear_from_display(display)
    opacity = sigmoid(gaussians.opacity_logit)[:, None]
    return np.round(np.concatenate([linear, opacity], axis=1) * 255).astype(np.uint8)
