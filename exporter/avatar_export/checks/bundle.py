"""Finds every problem of a bundle, not only the first: in the manifest, the files, and the values."""

from __future__ import annotations

import os
import zipfile
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.checks.derived import derived_problems
from avatar_export.checks.reference import reference_problems
from avatar_export.fit import whole
from avatar_export.notes.text import text
from avatar_export.ops.bounds import bounds
from avatar_runtime.avatar import Avatar, SparseRows
from avatar_runtime.bundle import MANIFEST, Open, checked_bytes, handedness, load, opener, read_manifest
from avatar_runtime.checks import arguments
from avatar_runtime.codec.manifest import ENHANCER_FILE
from avatar_runtime.driving.arkit import canonical
from avatar_runtime.enhance import make_enhance, missing_libraries
from avatar_runtime.handedness import mirrored, mirrored_boxes
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, resolve
from avatar_runtime.stages.joints import joints
from avatar_schema.validate import Problem, manifest_problems

WEIGHT_SUM_TOLERANCE = 1e-3  # of the sum of a row of skin weights, which is 1
NORMAL_TOLERANCE = 0.03  # of the length of a normal; a pack rounds it by 0.022
REST_TOLERANCE = 1e-4  # of a joint's skin matrix at rest, which is the identity; linear part, and metres
BOUNDS_TOLERANCE = 1e-4  # metres, plus this fraction of the box's size
LARGEST_LOG_SCALE = float(np.log(10.0))  # a standard deviation of ten metres
LARGEST_LOGIT = 30.0  # beyond, sigmoid is 0 or 1 in float32
FARTHEST = 100.0  # metres from the origin; beyond, the unit is probably not the metre

Bools = npt.NDArray[np.bool_]


def validate(path: str | Path) -> list[Problem]:
    """Every problem of the bundle at `path`, a folder or zip; [] for a sound bundle. Warnings do not stop readers.

    `Problem.path` is "FILE: FIELD" as in an AvatarError. If the manifest is invalid, nothing else is checked. Raises
    AvatarError if `path` does not exist, TypeError for what is no path.
    """
    path = arguments.path("path", path)
    if not path.exists():
        raise AvatarError("no such file or folder", file=path)
    try:
        read = opener(path)
        document = read_manifest(read)
    except AvatarError as error:
        return [_problem(error)]
    problems = [Problem(f"{MANIFEST}: {p.path}", p.message, p.warning) for p in manifest_problems(document)]
    if any(not p.warning for p in problems):
        return problems
    problems += _files(path, read, document)
    try:
        avatar = load(path)
    except AvatarError as error:
        if not any(p.path == error.file for p in problems):
            problems.append(_problem(error))
        return problems
    problems += [p for check in VALUE_CHECKS for p in check(avatar, document)]
    problems += derived_problems(avatar, document, read)
    stored = avatar if handedness(document) == "right" else mirrored(avatar)
    return problems + list(reference_problems(stored, document, read))


def _problem(error: AvatarError) -> Problem:
    return Problem(": ".join(p for p in (error.file, error.field) if p) or "bundle", error.message)


def _files(path: Path, read: Open, document: Mapping[str, Any]) -> Iterator[Problem]:
    """Listed files that are missing or altered, and files that are not listed."""
    listed: set[str] = set()
    for index, entry in enumerate(document["files"]):
        if entry["path"] in listed:
            yield Problem(f"{MANIFEST}: $.files[{index}].path", f"{entry['path']} is a duplicate")
            continue
        listed.add(entry["path"])
        try:
            checked_bytes(read, entry)
        except AvatarError as error:
            yield _problem(error)
    for name, count in Counter(_names(path)).items():
        if name != MANIFEST and name not in listed:
            yield Problem(name, "is not listed in the manifest", warning=True)
        if count > 1:
            yield Problem(name, "is a duplicate in the zip; readers may take either")


def _names(path: Path) -> list[str]:
    """The path of every file in a folder or zip."""
    if path.is_dir():
        found = [Path(folder, name) for folder, _, names in os.walk(path) for name in names]
        return sorted(file.relative_to(path).as_posix() for file in found)
    with zipfile.ZipFile(path) as archive:
        return sorted(name for name in archive.namelist() if not name.endswith("/"))


def _names_problems(avatar: Avatar, _: Mapping[str, Any]) -> Iterator[Problem]:
    """Ambiguous aliases, reversed ranges, and driving inputs that are not ARKit names."""
    owner = {name: name for name in avatar.expression_names}
    for index, expression in enumerate(avatar.expressions):
        where = f"{MANIFEST}: $.expressions[{index}]"
        for alias in expression.aliases:
            if owner.setdefault(alias, expression.name) != expression.name:
                yield Problem(f"{where}.aliases", f"{alias!r} is also an alias of {owner[alias]!r}")
        low, high = expression.range
        if not low <= high:
            yield Problem(f"{where}.range", f"is reversed: from {low} to {high}")
    for index, name in enumerate(avatar.driving.inputs):
        if canonical(name) is None:
            where = f"{MANIFEST}: $.driving.inputs[{index}]"
            yield Problem(
                where, f"{name!r} is not one of the 52 ARKit names, so nothing drives it", warning=True
            )


def _counts(avatar: Avatar, document: Mapping[str, Any]) -> Iterator[Problem]:
    """Entry counts in the manifest that differ from the tensors."""
    said = document["blendshapes"]["entries"]
    parts = ("geometry", "appearance", "correctives", "late_morphs")
    for name in dict.fromkeys((*parts, *said)):
        there = getattr(avatar.blendshapes, name).entries if name in parts else None
        if said.get(name) != there:
            message = f"is {said.get(name, 'missing')}, but blendshapes.safetensors has {there or 'none'}"
            yield Problem(f"{MANIFEST}: $.blendshapes.entries.{name}", message)


def _gaussians(avatar: Avatar, _: Mapping[str, Any]) -> Iterator[Problem]:
    """Values that are legal but probably mistakes."""
    g = avatar.gaussians
    limit = f"more than {LARGEST_LOGIT:g} from 0: sigmoid is 0 or 1"
    checks: tuple[tuple[str, Any, str], ...] = (
        ("rot", ~g.quat_wxyz.any(axis=1), "a quaternion of length 0, drawn as the identity"),
        ("scale", (g.log_scale > LARGEST_LOG_SCALE).any(axis=1), "a standard deviation above 10 m"),
        ("opacity", np.abs(g.opacity_logit) > LARGEST_LOGIT, limit),
        ("xyz", (np.abs(g.mean) > FARTHEST).any(axis=1), f"more than {FARTHEST:g} m from the origin"),
    )
    for field, bad, message in checks:
        yield from _rows("gaussians.ply", field, bad, message, warning=True)


def _normals(avatar: Avatar, _: Mapping[str, Any]) -> Iterator[Problem]:
    """Normals of stage light that are not unit, but for the rounding of a pack."""
    if avatar.relight is not None:
        length = np.linalg.norm(avatar.relight.normal.astype(np.float64), axis=1)
        off = ~(np.abs(length - 1) <= NORMAL_TOLERANCE)
        yield from _rows(
            "light.safetensors", "normal", off, f"a length that is not 1 within {NORMAL_TOLERANCE:g}"
        )


def _weights(avatar: Avatar, _: Mapping[str, Any]) -> Iterator[Problem]:
    """Skin weights that are missing, negative, or do not add up to 1."""
    if avatar.rig is None:
        return
    skinned = np.zeros(avatar.gaussians.count, bool)
    for group in avatar.groups:
        skinned[group.first : group.first + group.count] = group.binding == "skin"
    yield from _skin("blendshapes.safetensors", avatar.skin, skinned)
    yield from _skin("rig.safetensors", avatar.rig.skin, np.ones(len(avatar.rig.vertices), bool))


def _skin(file: str, skin: SparseRows, skinned: Bools) -> Iterator[Problem]:
    weight = skin.values["weight"].astype(np.float64)
    row = np.repeat(np.arange(skin.rows), skin.row_ptr[1:] - skin.row_ptr[:-1])
    total = np.bincount(row, weight, skin.rows)
    empty = np.bincount(row, minlength=skin.rows) == 0
    off = ~(np.abs(total - 1) <= WEIGHT_SUM_TOLERANCE)
    negative = np.bincount(row, weight < 0, skin.rows) > 0
    yield from _rows(file, "skin", skinned & empty, "no weight, so it would collapse to the origin")
    message = f"weights that do not add up to 1 within {WEIGHT_SUM_TOLERANCE:g}"
    yield from _rows(file, "skin", skinned & off & ~empty, message)
    yield from _rows(file, "skin", skinned & negative, "a negative weight")


def _rest(avatar: Avatar, _: Mapping[str, Any]) -> Iterator[Problem]:
    """Skin matrices that are not the identity at rest.

    A mesh under embedded Gaussians may rest in another pose than the binding pose, as ASM faces do, whose bones make
    the person. That is no problem if the Gaussians are bound to the mesh at rest.
    """
    rig = avatar.rig
    if rig is None:
        return
    matrix = joints(rig, resolve(Pose(), avatar)).skin_matrix
    off = ~(np.abs(matrix - np.eye(4)).max(axis=(1, 2)) <= REST_TOLERANCE)
    if off.any() and avatar.embedding is not None:
        mesh = Player(avatar, "reference").mesh(Pose())
        if np.abs(mesh - avatar.embedding.canonical_vertices).max(initial=0) <= REST_TOLERANCE:
            return
    message = f"a skin matrix that is not the identity at rest (within {REST_TOLERANCE:g})"
    warning = avatar.embedding is not None
    yield from _rows("rig.safetensors", "inverse_bind_matrix", off, message, warning=warning)


def _bounds(avatar: Avatar, document: Mapping[str, Any]) -> Iterator[Problem]:
    with np.errstate(over="ignore", invalid="ignore"):
        yield from bounds_problems(bounds(avatar), document)


def bounds_problems(computed: dict[str, Any], document: Mapping[str, Any]) -> Iterator[Problem]:
    """Boxes in the manifest that differ from those `computed` from right-handed Gaussians.

    `swept` may be another writer's, so only a warning.
    """
    if handedness(document) == "left":
        computed = mirrored_boxes(computed)
    for name, box in computed.items():
        said = document["bounds"][name]
        tolerance = BOUNDS_TOLERANCE * (1 + np.ptp([box["min"], box["max"]], axis=0))
        for end in ("min", "max"):
            if not (np.abs(np.subtract(said[end], box[end])) <= tolerance).all():
                message = f"is {_short(said[end])}, but the Gaussians give {_short(box[end])}"
                yield Problem(f"{MANIFEST}: $.bounds.{name}.{end}", message, warning=name == "swept")
    rest, swept = (document["bounds"][name] for name in ("rest", "swept"))
    if not (np.less_equal(swept["min"], rest["min"]) & np.less_equal(rest["max"], swept["max"])).all():
        yield Problem(f"{MANIFEST}: $.bounds.swept", "does not contain the box at rest")


def _fit(avatar: Avatar, _: Mapping[str, Any]) -> Iterator[Problem]:
    """What is readable and probably wrong: see `fit.whole`."""
    return (Problem(where, text(note), warning=True) for where, note in whole.found(avatar))


def _enhancer(avatar: Avatar, _: Mapping[str, Any]) -> Iterator[Problem]:
    """Problems of the enhancer's network, if the libraries to check it are installed."""
    if avatar.enhancer is None:
        return
    missing = missing_libraries()
    if missing:
        message = f"was not checked: that needs {missing}"
        yield Problem(ENHANCER_FILE, message, warning=True)
        return
    try:
        make_enhance(avatar.enhancer)
    except AvatarError as error:
        yield _problem(error)


def _rows(file: str, field: str, bad: Bools, what: str, warning: bool = False) -> Iterable[Problem]:
    """One problem for all bad rows: the number of the first, and how many there are."""
    count = int(np.count_nonzero(bad))
    if not count:
        return []
    more = f" (and {count - 1} more of {len(bad)} rows)" if count > 1 else ""
    return [Problem(f"{file}: {field}[{int(np.argmax(bad))}]", f"has {what}{more}", warning)]


def _short(vector: Iterable[float]) -> str:
    return "[" + ", ".join(f"{value:.6g}" for value in vector) + "]"


# Each takes an avatar and the manifest that describes it.
LEVEL_CHECKS = (_gaussians, _normals, _weights)  # what a coarser level of a pack can have wrong
PACK_CHECKS = (_names_problems, _counts, *LEVEL_CHECKS, _rest, _fit)  # of a pack's finest level
VALUE_CHECKS = (*PACK_CHECKS, _bounds, _enhancer)
