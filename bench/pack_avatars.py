"""The avatars that `bench.packs` packs, each pinned by a hash of its arrays."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from avatar_export import ReadOptions, read
from avatar_export.driving.matrix import with_driving
from avatar_runtime.avatar import F64, Avatar, Driving, Expression, SparseRows
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.driving.linear_map import linear_map
from bench.backends import with_sh_deltas

TRAINED = Path(__file__).parents[1] / "samples" / "trained"
FACE_GAUSSIANS = 58_333  # 69,999 with the teeth
BASIS = 50  # expressions of the global basis


@dataclass(frozen=True)
class Pinned:
    """An avatar to pack, and the size that its pack is held to."""

    load: Callable[[Path], Avatar]  # from the folder of samples
    limit_mb: float
    sha256: str  # the first 12 digits; of `arrays_sha256`


def trained(name: str) -> Callable[[Path], Avatar]:
    """A trained sample of the repository."""
    return lambda _: read(TRAINED / name)


def sample_head(folder: Path) -> Avatar:
    """The sample head with SH of degree 3 and 51 expressions; its checkpoint is made in `folder` if it is not there."""
    base = folder / "gaussian_blendshapes"
    if not base.exists():
        flags = ("--system", "gaussian_blendshapes", "--gaussians", str(FACE_GAUSSIANS), "--form", "dump")
        command = [sys.executable, "-m", "samples.make", str(folder), *flags]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    avatar = read(base / "model", ReadOptions(dataset=base))
    return check_avatar(with_driving(avatar, base / "driving.json"))


def global_basis(avatar: Avatar) -> Avatar:
    """`avatar` with 50 expressions that all move all that moves: a random orthogonal mix of its first 50."""
    mix = np.linalg.qr(np.random.default_rng(0).normal(size=(BASIS, BASIS)))[0]
    mix = np.round(mix, 6)  # the same on every machine
    shapes, rig = avatar.blendshapes, avatar.rig
    assert rig is not None and not avatar.clips
    names = [f"exp_{index:03d}" for index in range(BASIS)]
    mixed = replace(
        avatar,
        expressions=tuple(Expression(name, (), (-1.0, 1.0)) for name in names),
        blendshapes=replace(
            shapes, geometry=_mixed(shapes.geometry, mix), appearance=_mixed(shapes.appearance, mix)
        ),
        rig=replace(
            rig,
            morphs=_mixed(rig.morphs, mix),
            joint_basis=np.einsum("ij,j...->i...", mix, rig.joint_basis[:BASIS]).astype(np.float32),
        ),
        driving=_mixed_driving(avatar, mix, names),
    )
    return check_avatar(mixed)


def _mixed(rows: SparseRows, mix: F64) -> SparseRows:
    """Entries of every column in each row that had any."""
    kept = np.flatnonzero(np.diff(rows.row_ptr))
    row = np.repeat(np.arange(rows.rows), np.diff(rows.row_ptr))
    place = np.searchsorted(kept, row)
    used = rows.column < BASIS
    values = {}
    for name, value in rows.values.items():
        shape = value.shape[1:]
        flat = np.zeros((len(kept), BASIS, int(np.prod(shape, dtype=np.int64))), np.float32)
        flat[place[used], rows.column[used]] = value.reshape(len(value), -1)[used]
        for start in range(0, len(kept), 4096):
            part = slice(start, start + 4096)
            flat[part] = np.einsum("ij,rjc->ric", mix, flat[part])
        values[name] = flat.reshape(-1, *shape)
    ptr = np.zeros(rows.rows + 1, np.uint32)
    ptr[kept + 1] = BASIS
    column = np.tile(np.arange(BASIS, dtype=np.uint16), len(kept))
    return SparseRows(np.cumsum(ptr, dtype=np.uint32), column, values, BASIS)


def _mixed_driving(avatar: Avatar, mix: F64, names: list[str]) -> Driving:
    linear = linear_map(avatar)
    old = [f"expression/{e.name}" for e in avatar.expressions[:BASIS]]
    rows = dict(zip(linear.outputs, linear.matrix, strict=True))
    driven = np.array([rows.pop(name, np.zeros(len(linear.inputs))) for name in old])
    left_out = f"expression/{avatar.expressions[BASIS].name}"
    others = {name: row for name, row in rows.items() if name != left_out}
    return replace(
        avatar.driving,
        mode="matrix",
        inputs=linear.inputs,
        outputs=(*(f"expression/{name}" for name in names), *others),
        matrix=np.array([*(mix @ driven), *others.values()], np.float32),
    )


def arrays_sha256(avatar: Avatar) -> str:
    """The first 12 digits of the SHA-256 of all arrays, in the order of their fields."""
    digest = hashlib.sha256()

    def add(value: Any) -> None:
        if isinstance(value, np.ndarray):
            digest.update(np.ascontiguousarray(value).tobytes())
        elif is_dataclass(value):
            for field in fields(value):
                add(getattr(value, field.name))
        elif isinstance(value, dict):
            for key in value:
                add(value[key])
        elif isinstance(value, tuple):
            for one in value:
                add(one)

    add(avatar)
    return digest.hexdigest()[:12]


AVATARS: Mapping[str, Pinned] = {
    "head_blendshapes": Pinned(trained("head_blendshapes"), 1.44, "2c94c0d264a0"),
    "head_splatting": Pinned(trained("head_splatting"), 0.9, "500c727a54b0"),
    "body_splatting": Pinned(trained("body_splatting"), 0.4, "d7641740861d"),
    "head_points": Pinned(trained("head_points"), 2.04, "38f84513c810"),
    "asm_face": Pinned(trained("head_bones.npz"), 1.2, "53453f967ed1"),
    "head_70000": Pinned(sample_head, 5.2, "f8886cc9805e"),
    "head_70000_sh_deltas": Pinned(lambda folder: with_sh_deltas(sample_head(folder)), 11, "b40d22d9455e"),
    "head_70000_global_basis": Pinned(lambda folder: global_basis(sample_head(folder)), 45, "0c22a8039894"),
}
LAM = Pinned(read, 1.5, "")  # only with --lam: the file is not part of the project
