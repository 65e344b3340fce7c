"""Avatar to small integers, and the avatar that they decode to.

Quaternions are stored with unit length and their deltas divided by the same norm: stage `activate` normalises, so the
image does not change. An entry of a sparse part is dropped if all its values round to 0.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.packing.rates import rounded
from avatar_export.packing.seen import seen
from avatar_export.packing.steps import NORMAL_STEP, SH_REST, UNSEEN_MESH, Fineness
from avatar_runtime.avatar import (
    F32,
    F64,
    Avatar,
    Blendshapes,
    Embedding,
    Gaussians,
    Relight,
    Rig,
    SparseRows,
)
from avatar_runtime.program.codes import Codes, decode

Array = npt.NDArray[Any]
Found = dict[str, Codes]
Kept = dict[str, tuple[float, Codes]]  # by path: the step, and the codes of all entries
DEAD_ZONE = 0.6  # in steps: deltas below it become 0. More zeros cost little and are stored in little.
ONE_BYTE = 4.0  # times the mean squared error: so much more is taken before two bytes are
COARSEST = 4.0  # times the step of one column: the same. A pose may show this column alone
OPACITY_ENDS = (1 / 1024, 1 - 1 / 1024)  # a logit needs both


def quantised(avatar: Avatar, fine: Fineness, kept: Kept | None = None) -> tuple[Avatar, Found]:
    """(the avatar as it will play, its integers by path) of an avatar.

    `kept` saves time where one avatar is quantised again and again: the deltas whose step is still the same are taken
    from it, the others are put there.
    """
    kept = {} if kept is None else kept
    source, avatar = avatar, unit_quats(avatar)
    codes: Found = {}
    largest = _largest_weights(avatar)
    gaussians = _gaussians(avatar.gaussians, fine, codes, embedded=avatar.embedding is not None)
    b = avatar.blendshapes
    blendshapes = Blendshapes(
        _deltas(b.geometry, "blendshapes.geometry", fine, codes, kept, largest),
        _deltas(b.appearance, "blendshapes.appearance", fine, codes, kept, largest, _shown(source)),
        _deltas(b.correctives, "blendshapes.correctives", fine, codes, kept),
        _deltas(b.late_morphs, "blendshapes.late_morphs", fine, codes, kept),
    )
    skin = weights(avatar.skin, "skin", fine, codes)
    embedding = None if avatar.embedding is None else _embedding(avatar.embedding, fine, codes)
    rig = None
    if avatar.rig is not None:
        # A fit to anchor vertices averages over them.
        mesh = fine if embedding else replace(fine, coarseness=fine.coarseness * UNSEEN_MESH)
        rig = _rig(avatar.rig, mesh, codes, kept, largest)
    if embedding is not None and rig is not None:
        embedding = _same_mesh(avatar, embedding, rig, codes)
    done = replace(
        avatar, gaussians=gaussians, blendshapes=blendshapes, skin=skin, embedding=embedding, rig=rig
    )
    return replace(done, relight=None if avatar.relight is None else _relight(avatar.relight, codes)), codes


def unit_quats(avatar: Avatar) -> Avatar:
    """The same images from quaternions of unit length; the zero quaternion stays."""
    g, geometry = avatar.gaussians, avatar.blendshapes.geometry
    norm = np.linalg.norm(g.quat_wxyz.astype(np.float64), axis=1)
    norm[norm == 0] = 1
    row = np.repeat(np.arange(geometry.rows), np.diff(geometry.row_ptr))
    delta = geometry.values["quat_wxyz"] / norm[row, None]
    values = {**geometry.values, "quat_wxyz": delta.astype(np.float32)}
    avatar = replace(
        avatar,
        gaussians=replace(g, quat_wxyz=(g.quat_wxyz / norm[:, None]).astype(np.float32)),
        blendshapes=replace(avatar.blendshapes, geometry=replace(geometry, values=values)),
    )
    if avatar.embedding is None:
        return avatar
    local = avatar.embedding.local_quat_wxyz.astype(np.float64)
    length = np.linalg.norm(local, axis=1, keepdims=True)
    unit = (local / np.where(length == 0, 1, length)).astype(np.float32)
    return replace(avatar, embedding=replace(avatar.embedding, local_quat_wxyz=unit))


def _largest_weights(avatar: Avatar) -> F64:
    """[K] the largest weight, in size, of each expression's range."""
    return np.array([max(abs(low), abs(high), 1e-3) for low, high in (e.range for e in avatar.expressions)])


def linear(values: F32, step: Array | float) -> Codes:
    """Codes of kind linear for [n, C] values; `step` one number, or one a channel."""
    low = values.min(axis=0, initial=np.inf).astype(np.float32)
    high = values.max(axis=0, initial=-np.inf).astype(np.float32)
    low[~np.isfinite(low)] = 0
    span = np.maximum(high - low, 0)
    if not (span > 0).any():
        return Codes("linear", None, np.stack([low, np.zeros_like(low)], axis=1))
    step = np.broadcast_to(np.asarray(step, np.float64), span.shape)
    wide = (span / step).max() > 255
    step = np.maximum(step, span / (65535 if wide else 255)).astype(np.float32)
    codes = np.rint((values - low) / step).astype(np.uint16 if wide else np.uint8)
    return Codes("linear", codes, np.stack([low, step], axis=1))


def shares(values: F32, step: float) -> Codes:
    """Codes of kind linear for barycentric weights [n, 3]: whole parts that add up to 1, the largest takes the rest."""
    parts = min(max(round(1 / step), 1), 65535)
    kind = np.uint8 if parts <= 255 else np.uint16
    count = np.rint(np.clip(values, 0, 1).astype(np.float64) * parts)
    rows, largest = np.arange(len(count)), np.argmax(count, axis=1)
    count[rows, largest] += parts - count.sum(axis=1)
    scale = np.tile(np.array([[0, 1 / parts]], np.float32), (values.shape[1], 1))
    return Codes("linear", count.astype(kind), scale)


def table(opacity_logit: F32, step: float) -> Codes:
    """Codes of kind table for logits [n]: opacities in steps, each code worth the mean of its members."""
    opacity = 1 / (1 + np.exp(-opacity_logit.astype(np.float64)))
    code = np.rint(opacity / max(step, 1 / 255)).astype(np.int64)
    count = int(code.max(initial=0)) + 1
    members = np.bincount(code, minlength=count)
    mean = np.bincount(code, opacity, count) / np.maximum(members, 1)
    mean = np.clip(mean, *OPACITY_ENDS)
    return Codes("table", code.astype(np.uint8)[:, None], np.log(mean / (1 - mean)).astype(np.float32))


def signed(
    values: Array, column: Array, columns: int, step: Array, shown: tuple[F64, F64] | None = None
) -> Codes:
    """Codes of kind signed for [E, C] deltas; `step` [columns, C]. One byte if the steps stay near what is asked.

    For deltas of spherical harmonics, of one step a column, `shown` may say how much of their error images show:
    weights [E] of the entries, and `Seen.directions`.
    """
    flat = np.abs(values)
    largest = _largest(flat, column, columns)
    coarser = np.maximum(largest / 127 / np.where(step > 0, step, 1), 1)  # times, with one byte
    share = np.bincount(column, minlength=columns)[:, None] / max(len(column), 1)
    one_byte = (
        float((coarser**2 * share).sum()) <= ONE_BYTE * values.shape[1] and coarser.max(initial=1) <= COARSEST
    )
    width, half = (8, 127) if one_byte else (16, 32767)
    asked, step = step, np.maximum(step, largest / half)
    count: Array
    if shown is None:
        count = flat / step[column]
        count = np.where(count < DEAD_ZONE, 0, np.rint(count)) * np.sign(values)
    else:
        step = np.broadcast_to(step.max(axis=1, keepdims=True), step.shape)
        units = (values / step[column]).astype(np.float32).reshape(len(values), -1, 3)
        weight = shown[0] * (step / asked)[column, 0] ** 2
        count = rounded(units, weight, shown[1], half).reshape(values.shape)
    if not count.any():
        return Codes("signed", None, np.zeros((columns, values.shape[1]), np.float32))
    codes = (count.astype(np.int32) + (1 << (width - 1))).astype(np.uint8 if width == 8 else np.uint16)
    used = np.where(largest > 0, step, 0)
    return Codes("signed", codes, used.astype(np.float32))


def _largest(values: Array, column: Array, columns: int) -> F64:
    """[columns, C] the largest of [E, C] values in each column; 0 in a column without entries."""
    found = np.zeros((columns, values.shape[1]))
    if len(column):
        order = np.argsort(column, kind="stable")
        first = np.flatnonzero(np.diff(column[order], prepend=-1))
        found[column[order[first]]] = np.maximum.reduceat(values[order], first, axis=0)
    return found


def _gaussians(g: Gaussians, fine: Fineness, codes: Found, embedded: bool) -> Gaussians:
    """`embedded` Gaussians get position and rotation from their mesh, so none are stored."""
    n, terms = g.count, g.sh.shape[1]
    sh_step = np.full((terms, 3), fine.step("gaussians.sh") * SH_REST)
    sh_step[0] = fine.step("gaussians.sh")
    if embedded:
        codes["gaussians.mean"] = Codes("linear", None, np.zeros((3, 2), np.float32))
        codes["gaussians.quat_wxyz"] = Codes("linear", None, np.zeros((4, 2), np.float32))
    else:
        codes["gaussians.mean"] = linear(g.mean, fine.step("gaussians.mean"))
        codes["gaussians.quat_wxyz"] = linear(g.quat_wxyz, fine.step("gaussians.quat_wxyz"))
    codes["gaussians.log_scale"] = linear(g.log_scale, fine.step("gaussians.log_scale"))
    codes["gaussians.opacity_logit"] = table(g.opacity_logit, fine.step("gaussians.opacity_logit"))
    codes["gaussians.sh"] = linear(g.sh.reshape(n, -1), sh_step.reshape(-1))

    def found(name: str, channels: int) -> F32:
        return decode(codes[f"gaussians.{name}"], n, channels)

    return Gaussians(
        found("mean", 3),
        found("log_scale", 3),
        found("quat_wxyz", 4),
        found("opacity_logit", 1)[:, 0],
        found("sh", 3 * terms).reshape(n, terms, 3),
    )


def _shown(avatar: Avatar) -> tuple[F64, F64] | None:
    """How much images show of each delta of spherical harmonics, for `signed`; None without deltas."""
    rows = avatar.blendshapes.appearance
    if not rows.values["sh"].any():
        return None
    found = seen(avatar)
    return np.repeat(found.weight, np.diff(rows.row_ptr)), found.directions


def _deltas(
    rows: SparseRows,
    path: str,
    fine: Fineness,
    codes: Found,
    kept: Kept,
    largest: F64 | None = None,
    shown: tuple[F64, F64] | None = None,
) -> SparseRows:
    """Sparse rows whose attributes become codes of kind signed; entries that become 0 are dropped."""
    scale = np.ones(rows.columns) if largest is None else largest
    made: dict[str, Codes] = {}
    used = np.zeros(rows.entries, bool)
    for name, values in rows.values.items():
        at, asked = f"{path}.{name}", fine.step(f"{path}.{name}")
        if at not in kept or kept[at][0] != asked:
            flat = values.reshape(rows.entries, -1 if rows.entries else _channels(values))
            step = np.full((rows.columns, flat.shape[1]), asked) / scale[:, None]
            shows = shown if name == "sh" else None
            kept[at] = asked, signed(flat, rows.column, rows.columns, step, shows)
        made[name] = kept[at][1]
        stored = made[name].codes
        if stored is not None:
            used |= (stored != 1 << (made[name].width - 1)).any(axis=1)
    return _decoded(rows, path, made, used, codes)


def _channels(values: Array) -> int:
    return int(np.prod(values.shape[1:], dtype=np.int64))


def _decoded(
    rows: SparseRows, path: str, made: dict[str, Codes], kept: npt.NDArray[np.bool_], codes: Found
) -> SparseRows:
    ptr = np.concatenate([[0], np.cumsum(kept)])[rows.row_ptr].astype(np.uint32)
    column, count = rows.column[kept], int(kept.sum())
    values = {}
    for name, one in made.items():
        shape = rows.values[name].shape[1:]
        one = replace(one, codes=None if one.codes is None else np.ascontiguousarray(one.codes[kept]))
        codes[f"{path}.{name}"] = one
        values[name] = decode(one, count, _channels(rows.values[name]), column).reshape(count, *shape)
    return SparseRows(ptr, column, values, rows.columns)


def weights(rows: SparseRows, path: str, fine: Fineness, codes: Found) -> SparseRows:
    """Skin weights in steps of 1 / parts; each row keeps its sum to half a step."""
    parts = min(round(1 / fine.step(f"{path}.weight")), 65535)
    weight = rows.values["weight"].astype(np.float64)
    most = float(np.abs(weight).max(initial=0))
    step = np.float32(max(1 / parts, most / 65535))
    row = np.repeat(np.arange(rows.rows), np.diff(rows.row_ptr))
    whole = np.floor(weight / step)
    missing = np.rint(np.bincount(row, weight / step, rows.rows) - np.bincount(row, whole, rows.rows))
    order = np.lexsort((whole - weight / step, row))  # in each row, the largest remainders first
    rank = np.empty(rows.entries, np.int64)
    rank[order] = np.arange(rows.entries) - rows.row_ptr[row[order]]
    count = whole + (rank < missing[row])
    made = {"weight": Codes("weight", count.astype(np.uint16)[:, None], np.array([step], np.float32))}
    return _decoded(rows, path, made, count > 0, codes)


def _embedding(e: Embedding, fine: Fineness, codes: Found) -> Embedding:
    fields = {}
    for name in ("barycentric", "displacement", "local_offset", "local_quat_wxyz", "canonical_vertices"):
        path, values = f"embedding.{name}", getattr(e, name)
        flat = values.reshape(len(values), _channels(values))
        make = shares if name == "barycentric" else linear
        codes[path] = make(flat, fine.step(path))
        fields[name] = decode(codes[path], len(values), flat.shape[1]).reshape(values.shape)
    return replace(e, **fields)


def _relight(relight: Relight, codes: Found) -> Relight:
    code = np.rint((relight.normal.clip(-1, 1) + 1) / NORMAL_STEP).astype(np.uint8)
    codes["relight.normal"] = Codes(
        "linear", code, np.tile(np.array([[-1, NORMAL_STEP]], np.float32), (3, 1))
    )
    return replace(relight, normal=decode(codes["relight.normal"], len(code), 3))


def _rig(rig: Rig, fine: Fineness, codes: Found, kept: Kept, largest: F64) -> Rig:
    codes["rig.vertices"] = linear(rig.vertices, fine.step("rig.vertices"))
    return replace(
        rig,
        vertices=decode(codes["rig.vertices"], len(rig.vertices), 3),
        morphs=_deltas(rig.morphs, "rig.morphs", fine, codes, kept, largest),
        correctives=_deltas(rig.correctives, "rig.correctives", fine, codes, kept),
        late_morphs=_deltas(rig.late_morphs, "rig.late_morphs", fine, codes, kept),
        skin=weights(rig.skin, "rig.skin", fine, codes),
    )


def _same_mesh(avatar: Avatar, embedding: Embedding, rig: Rig, codes: Found) -> Embedding:
    """If the embedding's mesh is the rig's, both stay the same to the bit, and the file holds it once."""
    assert avatar.embedding is not None and avatar.rig is not None
    if not np.array_equal(avatar.embedding.canonical_vertices, avatar.rig.vertices):
        return embedding
    codes["embedding.canonical_vertices"] = codes["rig.vertices"]
    return replace(embedding, canonical_vertices=rig.vertices)
