"""Checks of an ASM face: shapes, ranges and numbers, before anything is computed from it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.asm.model import WEIGHT_RULES, AsmFace, Binding, Take, Template
from avatar_runtime.checks.surface import RATES
from avatar_runtime.io.errors import AvatarError

MOST_BONES, MOST_COMPONENTS, MOST_VERTICES = 1024, 64, 1 << 22  # limits the cost of evaluating the weights
NEUTRAL = "neutral"
SUM_TOLERANCE = 1e-4  # of mixture weights, from 1
LARGEST = 1e4  # of any number (metres, radians, scales, uv); it fits half floats
CHAIN_SCALES = (1e-3, 1e3)  # of a bone in the neutral, times those above it; the transforms are inverted
LEAST_LINEAR = 1e-12  # determinant of a bone's first rotation and scale

Array = npt.NDArray[Any]


def check_face(face: AsmFace) -> AsmFace:
    """The face, or AvatarError naming the field whose shape, range or value is wrong."""
    check_template(face.template)
    bones = len(face.template.bone_names)
    _check_binding(face.binding, bones)
    check_names(face.name, [take.name for take in face.takes])
    if len(face.takes[0].scale) != 1:
        raise AvatarError(f"the first take must be {NEUTRAL!r}, of one frame", field="take_names")
    for take in face.takes:
        _check_take(take, bones)
    _check_neutral(face)
    return face


def check_names(name: str, takes: Sequence[str]) -> None:
    """Raise AvatarError unless the names of a face and of its takes are valid."""
    if not name or not name.isprintable():
        raise AvatarError(f"{name[:40]!a} is empty or unprintable", field="name")
    if not takes or takes[0] != NEUTRAL:
        raise AvatarError(f"the first take must be {NEUTRAL!r}, of one frame", field="take_names")
    for take in takes:
        if not take or not take.isprintable() or takes.count(take) > 1:
            raise AvatarError(f"{take[:40]!a} is empty, unprintable or a duplicate", field="take_names")


def check_template(template: Template) -> None:
    """Raise AvatarError naming the field whose shape, range or value is wrong."""
    for name in ("vertices", "triangles"):
        if (array := getattr(template, name)).ndim != 2:
            raise AvatarError(f"expected [rows, 3], got {list(array.shape)}", field=name)
    v, j = len(template.vertices), len(template.bone_names)
    if not 0 < v <= MOST_VERTICES:
        raise AvatarError(f"has {v} rows; 1 to {MOST_VERTICES} are supported", field="vertices")
    if not 0 < j <= MOST_BONES:
        raise AvatarError(f"has {j} names; 1 to {MOST_BONES} bones are supported", field="bone_names")
    if template.weight_rule not in WEIGHT_RULES:
        raise AvatarError(
            f"{template.weight_rule[:40]!a} is not one of {', '.join(WEIGHT_RULES)}", field="weight_rule"
        )
    _check_finite("vertices", template.vertices, (v, 3))
    _check_finite("uv", template.uv, (v, 2))
    _check_finite("rest_position", template.rest_position, (j, 3))
    _check_finite("rest_linear", template.rest_linear, (j, 3, 3))
    if template.colour is not None:
        _check_finite("colour", template.colour, (v, 3))
        if not ((template.colour >= 0) & (template.colour <= 1)).all():
            raise AvatarError("is not a display-referred colour in 0..1", field="colour")
    _check_rows("triangles", template.triangles, (len(template.triangles), 3), v)
    _check_rows("anchor_vertex", template.anchor_vertex, (j,), v)
    _check_rows("landmark_vertices", np.array(list(template.landmarks.values()), np.int64), None, v)
    if not len(template.triangles):
        raise AvatarError("is empty; a face needs triangles", field="triangles")
    _check_bones(template)


def _check_bones(template: Template) -> None:
    names, parents = template.bone_names, template.parents
    for name in names:
        if not name or not name.isprintable() or "/" in name or names.count(name) > 1:
            raise AvatarError(
                f"{name[:40]!a} is empty, unprintable, has a slash or is a duplicate", field="bone_names"
            )
    if parents.shape != (len(names),):
        raise AvatarError(
            f"has shape {list(parents.shape)}, but there are {len(names)} bones", field="parents"
        )
    after = (parents < -1) | (parents >= np.arange(len(names)))
    if after.any():
        at = int(np.argmax(after))
        raise AvatarError(
            f"is {parents[at]}; a parent must come before its children (-1: no parent)",
            field=f"parents[{at}]",
        )
    flat = ~(np.abs(np.linalg.det(template.rest_linear.astype(np.float64))) > LEAST_LINEAR)
    if flat.any():
        raise AvatarError("has no inverse", field=f"rest_linear[{int(np.argmax(flat))}]")


def _check_binding(binding: Binding, bones: int) -> None:
    k = binding.pi.shape[1] if binding.pi.ndim == 2 else 0
    if not 0 < k <= MOST_COMPONENTS:
        raise AvatarError(
            f"has {k} Gaussians per bone; 1 to {MOST_COMPONENTS} are supported", field="binding"
        )
    _check_finite("zeta", binding.zeta, (bones, 2))
    _check_finite("pi", binding.pi, (bones, k))
    _check_finite("mu", binding.mu, (bones, k, 2))
    _check_finite("covariance", binding.covariance, (bones, k, 3))
    wrong = (binding.pi < 0).any(axis=1) | (np.abs(binding.pi.sum(axis=1) - 1) > SUM_TOLERANCE)
    if wrong.any():
        raise AvatarError(
            "holds a negative weight or does not add up to 1", field=f"pi[{int(np.argmax(wrong))}]"
        )
    xx, xy, yy = np.moveaxis(binding.covariance, -1, 0)
    with np.errstate(over="ignore", invalid="ignore"):
        determinant = xx * yy - xy * xy
    wrong = ~((xx > 0) & (yy > 0) & (determinant > 0) & np.isfinite(determinant)).all(axis=1)
    if wrong.any():
        raise AvatarError(
            "is not a covariance: xx, xy, yy must be positive definite",
            field=f"covariance[{int(np.argmax(wrong))}]",
        )


def _check_take(take: Take, bones: int) -> None:
    where, t = f"take {take.name}", len(take.scale)
    if not t:
        raise AvatarError("has no frames", field=where)
    if not RATES[0] <= take.fps <= RATES[1]:
        raise AvatarError(f"fps is {take.fps}, expected {RATES[0]:g} to {RATES[1]:g}", field=where)
    for name in ("rotation_vector", "translation", "scale"):
        _check_finite(f"{where}: {name}", getattr(take, name), (t, bones, 3))


def _check_neutral(face: AsmFace) -> None:
    with np.errstate(divide="ignore"):
        logs = np.log(np.abs(face.takes[0].scale[0]))  # [J, 3]
    least, most = np.log(CHAIN_SCALES)
    for bone, parent in enumerate(face.template.parents.tolist()):
        if parent >= 0:
            logs[bone] += logs[parent]
        if not ((logs[bone] >= least) & (logs[bone] <= most)).all():
            raise AvatarError(
                "has a scale in the neutral that, times those of the bones above it, is outside "
                f"{CHAIN_SCALES[0]:g} to {CHAIN_SCALES[1]:g}",
                field=f"bone {face.template.bone_names[bone]}",
            )


def _check_finite(field: str, array: Array, shape: tuple[int, ...]) -> None:
    if array.dtype.kind != "f" or array.shape != shape:
        raise AvatarError(f"expected floats {list(shape)}, got {array.dtype}{list(array.shape)}", field=field)
    sound = (np.abs(array) <= LARGEST).all(axis=tuple(range(1, array.ndim)))  # False for NaN
    if not sound.all():
        raise AvatarError(
            f"is not finite, or larger than {LARGEST:g}; lengths are in metres",
            field=f"{field}[{int(np.argmin(sound))}]",
        )


def _check_rows(field: str, index: Array, shape: tuple[int, ...] | None, limit: int) -> None:
    if index.dtype.kind not in "iu" or (shape is not None and index.shape != shape):
        raise AvatarError(f"expected whole numbers, got {index.dtype}{list(index.shape)}", field=field)
    outside = ((index < 0) | (index >= limit)).any(axis=tuple(range(1, index.ndim)))
    if outside.any():
        at = int(np.argmax(outside))
        raise AvatarError(f"is {index[at].tolist()}, but there are {limit} vertices", field=f"{field}[{at}]")
