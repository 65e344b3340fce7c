"""Clips of other avatars, OTHER_BUNDLE:NAME: expressions, eyelids and joints are matched by their names.

Expressions with ARKit names mean the same in every avatar. Others are weights of a basis, such as FLAME's, and are
taken only if both avatars' expressions of that name move their meshes alike.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from avatar_export.notes.note import Note, fact
from avatar_runtime.avatar import F32, F64, Avatar, Clip, Rig, SparseRows
from avatar_runtime.bundle import MANIFEST, load
from avatar_runtime.driving.arkit import first_canonical
from avatar_runtime.driving.driver import Driver
from avatar_runtime.driving.frame import DrivingFrame
from avatar_runtime.io.errors import AvatarError, no_such
from avatar_runtime.pose import resolve
from avatar_runtime.stages.joints import rest_transforms

FILES = (".avatar", ".avatar.zip")  # a pack, or a bundle as a zip; recordings are gzip files too
SAME_BASIS = 0.1  # largest relative difference of an expression's offsets on one topology
SAME_SIZE = 3.0  # largest ratio of an expression's largest offsets on two topologies
MOST_NAMED = 5
STILL = 1e-4  # metres that a joint moves against its parent, beyond the rotation


@dataclass(frozen=True)
class Borrowed:
    """A clip of another avatar, for this one, and what it moves in the other and nothing here."""

    clip: Clip
    notes: tuple[Note, ...]


def parts_of(path: Path) -> tuple[Path, str] | None:
    """(OTHER_BUNDLE, NAME) of the text OTHER_BUNDLE:NAME; None for any other path. Never raises.

    The longest path that exists is the bundle, so that a path may begin with C: and a name may hold a colon.
    """
    text = str(path)
    at = text.rfind(":")
    while at > 0:
        other = Path(text[:at])
        if _is_bundle(other):
            return other, text[at + 1 :]
        at = text.rfind(":", 0, at)
    return (path, "") if _is_bundle(path) else None


def borrowed(avatar: Avatar, path: Path) -> Borrowed:
    """The clip OTHER_BUNDLE:NAME for `avatar`.

    Raises AvatarError for a bundle without that clip, for a clip that moves nothing of `avatar`, and for expressions of
    another basis or unit.
    """
    found = parts_of(path)
    assert found is not None
    file, name = found
    other = load(file)
    clips = {clip.name: clip for clip in other.clips}
    if name not in clips:
        if not name:
            listed = ", ".join(clips) or "none"
            raise AvatarError(
                f"is an avatar; name one of its clips, {file}:NAME (it has {listed})", file=file
            )
        raise no_such("clip of that avatar", name, tuple(clips), file=file)
    return _moved(avatar, other, clips[name], file)


def _is_bundle(path: Path) -> bool:
    try:
        return (path / MANIFEST).exists() if path.is_dir() else path.name.endswith(FILES) and path.is_file()
    except OSError:
        return False


def _moved(avatar: Avatar, other: Avatar, clip: Clip, file: Path) -> Borrowed:
    weights, lost_weights = _expressions(avatar, other, clip, file)
    lids, lost_lids = _lids(avatar, other, clip)
    delta, lost_joints, shifted = _joints(avatar, other, clip)
    result = Clip(clip.name, clip.fps, weights, lids, delta, clip.world_from_avatar)
    result = _driven(avatar, other, clip, result)
    lost = {"expressions": lost_weights, "eyelids": lost_lids, "joints": lost_joints}
    here = any(array.any() for array in (result.expression_weights, result.late_weights))
    if not here and not _turns(result.joint_delta).any() and any(lost.values()):
        names = ", ".join(name for part in lost.values() for name in part[:MOST_NAMED])
        raise AvatarError(
            f"clip {clip.name!r} moves nothing of this avatar; it moves {names}, which have no counterpart by name",
            file=file,
        )
    notes = [fact("no_counterpart", part=part, names=names) for part, names in lost.items() if names]
    if shifted:
        notes.append(fact("rotations_alone", names=shifted))
    return Borrowed(result, tuple(notes))


def _counterparts(avatar: Avatar, other: Avatar) -> dict[int, int]:
    """Column of `avatar` -> column of `other`: the same name or alias, else the same ARKit name."""
    by_name = {n: k for k, e in reversed(list(enumerate(other.expressions))) for n in (*e.aliases, e.name)}
    arkit = [first_canonical((e.name, *e.aliases)) for e in other.expressions]
    pairs = {}
    for k, own in enumerate(avatar.expressions):
        found = next((by_name[n] for n in (own.name, *own.aliases) if n in by_name), None)
        spelled = first_canonical((own.name, *own.aliases))
        if found is None and spelled in arkit and spelled is not None:
            found = arkit.index(spelled)
        if found is not None:
            pairs[k] = found
    return pairs


def _expressions(avatar: Avatar, other: Avatar, clip: Clip, file: Path) -> tuple[F32, list[str]]:
    pairs = _counterparts(avatar, other)
    moving = np.any(clip.expression_weights, axis=0).tolist()
    basis = {own: k for own, k in pairs.items() if moving[k] and not _means_arkit(avatar, own)}
    _check_basis(avatar, other, basis, file)
    weights = np.zeros((clip.frames, len(avatar.expressions)), np.float32)
    for own, k in pairs.items():
        weights[:, own] = clip.expression_weights[:, k]
    used = set(pairs.values())
    if _through_driving(avatar, other):
        used |= {k for k in range(len(other.expressions)) if _means_arkit(other, k)}
    lost = [e.name for k, e in enumerate(other.expressions) if moving[k] and k not in used]
    return weights, lost


def _means_arkit(avatar: Avatar, column: int) -> bool:
    expression = avatar.expressions[column]
    return first_canonical((expression.name, *expression.aliases)) is not None


def _through_driving(avatar: Avatar, other: Avatar) -> bool:
    """Whether ARKit weights of `other` must pass the matrix of `avatar`, whose expressions alone are less."""
    return other.driving.mode == "names" and avatar.driving.mode == "matrix"


def _driven(avatar: Avatar, other: Avatar, clip: Clip, moved: Clip) -> Clip:
    """`moved` with the ARKit weights of the clip brought through the driving of `avatar`, where that is needed."""
    if not _through_driving(avatar, other):
        return moved
    names = {
        k: name
        for k, e in enumerate(other.expressions)
        if (name := first_canonical((e.name, *e.aliases))) is not None
    }
    own = [k for k in range(len(avatar.expressions)) if _means_arkit(avatar, k)]
    driver = Driver(avatar)
    weights, lids = moved.expression_weights.copy(), moved.late_weights.copy()
    delta = moved.joint_delta.copy()
    still = ~_turns(delta).any(axis=0)  # [J] a joint that the clip turns itself is not turned twice
    weights[:, own] = 0
    for frame, row in enumerate(clip.expression_weights):
        given = {name: float(row[k]) for k, name in names.items()}
        arrays = resolve(driver.pose(DrivingFrame(frame / clip.fps, given)), avatar)
        weights[frame] += arrays.expression_weights
        lids[frame] += arrays.late_weights
        delta[frame, still] = arrays.joint_delta[still]
    return replace(moved, expression_weights=weights, late_weights=lids, joint_delta=delta)


def _check_basis(avatar: Avatar, other: Avatar, pairs: dict[int, int], file: Path) -> None:
    """Raise AvatarError if most expressions of the same names move the two avatars differently."""
    same = _same_topology(avatar.rig, other.rig)
    differing: list[tuple[str, float, float]] = []
    for own, k in pairs.items():
        one, two = _offsets(avatar, own), _offsets(other, k)
        sizes = [float(np.linalg.norm(offsets, axis=1).max(initial=0)) for offsets in (one, two)]
        if not min(sizes):
            continue
        ratio = max(sizes) / min(sizes)
        off = ratio > SAME_SIZE
        if same:
            off = bool(np.linalg.norm(one - two) > SAME_BASIS * np.linalg.norm(two))
        if off:
            differing.append((avatar.expressions[own].name, sizes[0], sizes[1]))
    if 2 * len(differing) > len(pairs):
        name, one_size, two_size = differing[0]
        raise AvatarError(
            f"its expressions are of another basis or unit: {name} moves this avatar by up to {one_size * 1e3:.3g} mm, "
            f"that one by {two_size * 1e3:.3g} mm ({len(differing)} of {len(pairs)} differ)",
            file=file,
        )


def _same_topology(one: Rig | None, two: Rig | None) -> bool:
    return (
        one is not None
        and two is not None
        and len(one.vertices) == len(two.vertices)
        and np.array_equal(one.triangles, two.triangles)
    )


def _offsets(avatar: Avatar, column: int) -> F64:
    """[rows, 3] how an expression moves the vertices, or without a rig the Gaussians."""
    if avatar.rig is not None:
        return _column(avatar.rig.morphs, "position", column)
    return _column(avatar.blendshapes.geometry, "mean", column)


def _column(sparse: SparseRows, name: str, column: int) -> F64:
    result = np.zeros((sparse.rows, 3))
    at = np.flatnonzero(sparse.column == column)
    result[np.searchsorted(sparse.row_ptr, at, side="right") - 1] = sparse.values[name][at]
    return result


def _lids(avatar: Avatar, other: Avatar, clip: Clip) -> tuple[F32, list[str]]:
    lids = np.zeros((clip.frames, len(avatar.eyelids)), np.float32)
    lost = []
    for k, name in enumerate(other.eyelids):
        if name in avatar.eyelids:
            lids[:, avatar.eyelids.index(name)] = clip.late_weights[:, k]
        elif clip.late_weights[:, k].any():
            lost.append(name)
    return lids, lost


def _joints(avatar: Avatar, other: Avatar, clip: Clip) -> tuple[F32, list[str], list[str]]:
    """(deltas [T, J, 4, 4], moved joints without a counterpart, joints whose shifts are left out).

    A delta turns in the rest frame of its joint: it is brought to mesh axes, then to the other rest frame.
    """
    names = () if avatar.rig is None else avatar.rig.joint_names
    delta = np.tile(np.eye(4), (clip.frames, len(names), 1, 1))
    lost: list[str] = []
    shifted: list[str] = []
    if other.rig is None:
        return delta.astype(np.float32), lost, shifted
    rest = rest_transforms(other.rig)[:, :3, :3]
    own_rest = None if avatar.rig is None else rest_transforms(avatar.rig)[:, :3, :3]
    for row, name in enumerate(other.rig.joint_names):
        moved = clip.joint_delta[:, row].astype(np.float64)
        if name not in names or own_rest is None or avatar.rig is None:
            if _turns(moved).any():
                lost.append(name)
            continue
        at = names.index(name)
        change = np.linalg.solve(own_rest[at], rest[row])
        delta[:, at, :3, :3] = change @ moved[:, :3, :3] @ np.linalg.inv(change)
        root = other.rig.parents[row] < 0 and avatar.rig.parents[at] < 0
        if root or np.allclose(avatar.rig.rest_local[at], other.rig.rest_local[row], atol=STILL):
            delta[:, at, :3, 3] = moved[:, :3, 3] @ change.T
        elif np.linalg.norm(moved[:, :3, 3] @ rest[row].T, axis=1).max() > STILL:
            shifted.append(name)
    return delta.astype(np.float32), lost, shifted


def _turns(delta: F64 | F32) -> npt.NDArray[np.bool_]:
    """Which of the deltas [..., 4, 4] are not the identity."""
    changed: npt.NDArray[np.bool_] = np.abs(delta - np.eye(4)) > 1e-6
    return np.asarray(np.any(changed, axis=(-1, -2)))
