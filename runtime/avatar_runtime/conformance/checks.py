"""Checks reference vectors: names and shapes as in the table, finite numbers, ids within range."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from avatar_runtime.avatar import Avatar
from avatar_runtime.conformance.arrays import STAGE_ARRAYS, WHEN, Array, floor_of, inputs_of, sizes, stages_of
from avatar_runtime.conformance.model import CaseVectors, Expected, Reference, Step, Tensor
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.stages.raster import PROFILES

CASES, VECTORS = "cases.json", "vectors.safetensors"
LOOSEST = 1e-2  # largest tolerance, as a share of the largest value; a larger one would pass everything
ROWS_A_FLIP = 64  # at least this many of them for each that may flip
FARTHEST = 1e6  # of any matrix; larger values overflow in stages that square them


def check_reference(reference: Reference) -> None:
    """Raise AvatarError for faults that do not depend on the avatar."""
    names = [vectors.case.name for vectors in reference.cases]
    for name in names:
        if names.count(name) > 1:
            raise AvatarError("is the name of two cases", file=CASES, field=name)
    for ids, field in ((reference.rows, "rows"), (reference.vertices, "vertices")):
        if ids.dtype != np.int64 or ids.ndim != 1 or (np.diff(ids) <= 0).any() or (ids[:1] < 0).any():
            raise AvatarError("must be increasing int64 ids", file=VECTORS, field=field)
    if not len(reference.rows):
        raise AvatarError("must name at least one Gaussian", file=VECTORS, field="rows")
    known = {"N": len(reference.rows), "V": len(reference.vertices)}
    for vectors in reference.cases:
        _check_case(vectors)
        _check_shapes(reference, vectors, dict(known))


def check_rows(reference: Reference, avatar: Avatar) -> None:
    """Raise AvatarError where `reference` names rows or vertices that `avatar` lacks."""
    rig, embedding = avatar.rig, avatar.embedding
    vertices = 0 if rig is None else len(rig.vertices)
    if embedding is not None:
        vertices = len(embedding.canonical_vertices)
    for ids, count, field in (
        (reference.rows, avatar.gaussians.count, "rows"),
        (reference.vertices, vertices, "vertices"),
    ):
        if len(ids) and ids[-1] >= count:
            raise AvatarError(
                f"name {ids[-1]}, but this avatar has {count}: the reference was made for another avatar",
                file=VECTORS,
                field=field,
            )


def check_fits(reference: Reference, avatar: Avatar, part: Avatar) -> None:
    """Raise AvatarError where `reference` is not one of `avatar`, whose subset for it is `part`."""
    known = sizes(part) | {"A": sizes(avatar)["A"]}
    if (known["N"], known["V"]) != (len(reference.rows), len(reference.vertices)):
        raise AvatarError(
            f"names {len(reference.rows)} rows and {len(reference.vertices)} vertices, for this avatar these would be "
            f"{known['N']} and {known['V']}: the reference was made for another avatar",
            file=VECTORS,
        )
    for vectors in reference.cases:
        if vectors.case.light is not None and avatar.relight is None:
            raise AvatarError("has a light, but this avatar takes none", file=CASES, field=vectors.case.name)
        for step in vectors.steps:
            field = f"{vectors.case.name}/{step.stage}"
            light = vectors.case.light
            if not WHEN[STAGE_ARRAYS[step.stage].when](avatar, light):
                raise AvatarError("is a stage that this avatar does not have", file=CASES, field=field)
            missing = {array.name for array in inputs_of(step.stage, avatar, light)} - step.inputs.keys()
            if missing:
                raise AvatarError(f"lacks {', '.join(sorted(missing))}", file=CASES, field=field)
        _check_steps(vectors, avatar)
        _check_shapes(reference, vectors, dict(known))


def _check_steps(vectors: CaseVectors, avatar: Avatar) -> None:
    """Every stage that the avatar has, once, in order."""
    found = [(step.stage, step.profile) for step in vectors.steps]
    stages = stages_of(avatar, vectors.case.light)
    want = [(s, p) for s in stages for p in (PROFILES if s == "raster" else (None,))]
    for stage, profile in want:
        named = stage if profile is None else f"{stage} in profile {profile}"
        if (stage, profile) not in found:
            raise AvatarError(f"case {vectors.case.name} lacks stage {named}", file=CASES)
    if found != want:
        raise AvatarError(f"case {vectors.case.name} has its stages twice or out of order", file=CASES)


def _check_case(vectors: CaseVectors) -> None:
    """Numbers of pose and camera."""
    case = vectors.case
    camera = case.camera
    matrices = (camera.camera_from_world, camera.clip_from_world, camera.centre)
    for numbers in (*matrices, case.pose.world_from_avatar, *case.pose.joints.values()):
        if not (np.abs(numbers) <= FARTHEST).all():
            raise AvatarError(f"a matrix goes beyond {FARTHEST:g}", file=CASES, field=case.name)
    if abs(float(np.linalg.det(camera.camera_from_world[:3, :3].astype(np.float64)))) < 1e-6:
        raise AvatarError("camera_from_world has no inverse", file=CASES, field=case.name)
    if not np.isfinite(np.array(case.background, np.float32)).all():
        raise AvatarError("background is not finite", file=CASES, field=case.name)


def _check_shapes(reference: Reference, vectors: CaseVectors, known: dict[str, int]) -> None:
    """Arrays of every step; what `known` lacks is learned from the first array that has it."""
    for step in vectors.steps:
        known.pop("P", None)
        table, field = STAGE_ARRAYS[step.stage], f"{vectors.case.name}/{step.stage}"
        check_arrays(reference.tensors, named_arrays(table.inputs, step.inputs, field), known)
        outputs = {array: expected.tensor for array, expected in step.outputs.items()}
        check_arrays(reference.tensors, named_arrays(table.outputs, outputs, field), known)
        for expected in step.outputs.values():
            if expected.weight is not None:
                rows = reference.tensors[expected.tensor].shape[:1]
                weight = reference.tensors[expected.weight]
                _expect(weight, "float32", rows, expected.weight)
        for array in table.outputs:
            floor = floor_of(array, vectors.case.camera)
            check_tolerance(array, step.outputs[array.name], reference.tensors, floor, field)
        _check_ids(reference, vectors, step)


def check_tolerance(
    array: Array,
    expected: Expected,
    tensors: Mapping[str, Tensor],
    floor: float,
    field: str,
    file: str = CASES,
) -> None:
    """Tolerances are small compared with the array, or with `floor`, the terms that cancel; whole numbers are exact.

    If rows have weights, the median counts: a needle's weight may be large.
    """
    want = tensors[expected.tensor].astype(np.float64)
    allowed = expected.atol
    if expected.weight is not None:
        weight = tensors[expected.weight][want.any(axis=tuple(range(1, want.ndim)))]
        allowed *= float(np.median(weight)) if len(weight) else 0.0
    size = max(float(np.abs(want).max(initial=0.0)), floor)
    most = 0.0 if array.dtype.startswith("int") else LOOSEST
    if allowed > most * size or expected.rtol > most:
        message = f"{array.name} may be {allowed:.3g} + {expected.rtol:.3g} |x| off values up to {size:.3g}"
        raise AvatarError(f"{message}: that would judge nothing", file=file, field=field)
    if expected.most_flips > 1 + len(want) // ROWS_A_FLIP:
        message = f"{expected.most_flips} of {len(want)} rows of {array.name} may flip"
        raise AvatarError(f"{message}: that would judge nothing", file=file, field=field)


def named_arrays(
    table: tuple[Array, ...], given: Mapping[str, str], field: str, file: str = CASES
) -> list[tuple[Array, str]]:
    """(row of the table, tensor) of each of `given`. Raises AvatarError for a stranger, and for one that is missing."""
    arrays = {array.name: array for array in table}
    for name in given:
        if name not in arrays:
            raise AvatarError(f"{name[:80]!r} is not one of {', '.join(arrays)}", file=file, field=field)
    for array in table:
        if array.when == "always" and array.name not in given:
            raise AvatarError(f"lacks {array.name}", file=file, field=field)
    return [(arrays[name], tensor) for name, tensor in given.items()]


def check_arrays(
    tensors: Mapping[str, Tensor],
    named: Iterable[tuple[Array, str]],
    known: dict[str, int],
    file: str = VECTORS,
) -> None:
    """Raise AvatarError for a type or shape that is not the table's; symbols that `known` lacks are learned."""
    for array, name in named:
        a = tensors[name]
        if a.ndim == len(array.shape):
            for symbol, length in zip(array.shape, a.shape, strict=True):
                if isinstance(symbol, str):
                    known.setdefault(symbol, length)
        shape = tuple(known.get(s, -1) if isinstance(s, str) else s for s in array.shape)
        _expect(a, array.dtype, shape, name, file)


def _expect(a: Tensor, dtype: str, shape: tuple[int, ...], name: str, file: str = VECTORS) -> None:
    if a.dtype != np.dtype(dtype) or a.shape != shape:
        found = f"{a.dtype.name}{list(a.shape)}"
        raise AvatarError(f"is {found}, expected {dtype}{list(shape)}", file=file, field=name)
    if not np.isfinite(a).all():
        raise AvatarError("holds a number that is not finite", file=file, field=name)


def _check_ids(reference: Reference, vectors: CaseVectors, step: Step) -> None:
    """What a stage uses as an index."""
    camera, tensors = vectors.case.camera, reference.tensors
    limits = []
    if "order" in step.inputs:
        limits.append((step.inputs["order"], len(reference.rows)))
    if step.pixels is not None:
        outputs = step.outputs.values()
        kept = {len(tensors[expected.tensor]) for expected in outputs} or {0}
        _expect(tensors[step.pixels], "int32", (max(kept),), step.pixels)
        limits.append((step.pixels, camera.width * camera.height))
    for name, limit in limits:
        ids = tensors[name]
        if ids.size and (int(ids.min()) < 0 or int(ids.max()) >= limit or len(np.unique(ids)) != ids.size):
            raise AvatarError(f"must be different ids in 0..{limit - 1}", file=VECTORS, field=name)
