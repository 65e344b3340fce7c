"""How an avatar is packed and split for backend `gl`; no GPU is asked."""

from __future__ import annotations

import numpy as np
import pytest

from avatar_runtime.avatar import SparseRows
from avatar_runtime.backends.gl.layout import (
    Cost,
    PackedBuffer,
    Run,
    gaussian_runs,
    pack,
    pack_bind,
    pack_blend,
    pack_embedded,
    pack_morph,
    pack_skin,
    pack_surface,
    runs,
    vertex_runs,
)
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.stages.surface import prepare
from tests.avatars import COUNT, VERTICES, full_avatar, surface_avatar

AVATAR = full_avatar(5)
SURFACE = surface_avatar(5)
MIDDLE = Run(7, 20)


def section(packed: PackedBuffer, name: str) -> np.ndarray:
    """The words from one section to the next."""
    begin = packed.offsets[name]
    later = [at for at in packed.offsets.values() if at > begin]
    return packed.words[begin : min(later, default=len(packed.words))]


def floats(packed: PackedBuffer, name: str) -> np.ndarray:
    return section(packed, name).view(np.float32)


def unpacked(packed: PackedBuffer, name: str, width: int, row: int) -> list[tuple[int, list[float]]]:
    """Entries of one row as (column, values), read as a kernel reads them."""
    ptr, entry = packed.offsets[f"{name}_ptr"], packed.offsets[f"{name}_entry"]
    found = []
    for e in range(packed.words[ptr + row], packed.words[ptr + row + 1]):
        at = entry + width * e
        values = packed.words[at + 1 : at + width].view(np.float32)
        found.append((int(packed.words[at]), values.tolist()))
    return found


def stored(sparse: SparseRows, attributes: list[str], row: int) -> list[tuple[int, list[float]]]:
    found = []
    for e in range(sparse.row_ptr[row], sparse.row_ptr[row + 1]):
        values = [float(v) for a in attributes for v in sparse.values[a][e].ravel()]
        found.append((int(sparse.column[e]), values))
    return found


def test_words_keep_their_bits() -> None:
    packed = pack(
        {"a": np.array([1.5, -0.0], np.float32), "b": np.zeros(0, np.float32), "c": np.array([7, 2**32 - 1])}
    )
    assert packed.offsets == {"a": 0, "b": 2, "c": 2}
    assert packed.words.dtype == np.uint32
    assert packed.words.tolist() == [0x3FC00000, 0x80000000, 7, 2**32 - 1]


@pytest.mark.parametrize("run", [Run(0, COUNT), MIDDLE], ids=["all", "middle"])
def test_blend_heap(run: Run) -> None:
    packed, g, shapes = pack_blend(AVATAR, run), AVATAR.gaussians, AVATAR.blendshapes
    rows = slice(run.first, run.first + run.count)
    base = floats(packed, "base_plane").reshape(11 + 48, run.count)
    np.testing.assert_array_equal(base[0:3].T, g.mean[rows])
    np.testing.assert_array_equal(base[3:6].T, g.log_scale[rows])
    np.testing.assert_array_equal(base[6:10].T, g.quat_wxyz[rows])
    np.testing.assert_array_equal(base[10], g.opacity_logit[rows])
    np.testing.assert_array_equal(base[11:].T.reshape(run.count, 16, 3), g.sh[rows])
    for row in range(run.count):
        whole = run.first + row
        assert unpacked(packed, "geometry", 8, row) == stored(shapes.geometry, ["mean", "quat_wxyz"], whole)
        assert unpacked(packed, "appearance", 5 + 48, row) == stored(
            shapes.appearance, ["log_scale", "opacity_logit", "sh"], whole
        )


def test_bind_morph_and_skin_heaps() -> None:
    rig, shapes = AVATAR.rig, AVATAR.blendshapes
    assert rig is not None
    vertices = Run(3, 9)
    parts = [
        (pack_bind(AVATAR, MIDDLE), "corrective", 4, shapes.correctives, "mean", MIDDLE),
        (pack_bind(AVATAR, MIDDLE), "late", 4, shapes.late_morphs, "mean", MIDDLE),
        (pack_bind(AVATAR, MIDDLE), "skin", 2, AVATAR.skin, "weight", MIDDLE),
        (pack_morph(rig, vertices), "morph", 4, rig.morphs, "position", vertices),
        (pack_morph(rig, vertices), "corrective", 4, rig.correctives, "position", vertices),
        (pack_skin(rig, vertices), "late", 4, rig.late_morphs, "position", vertices),
        (pack_skin(rig, vertices), "skin", 2, rig.skin, "weight", vertices),
    ]
    for packed, name, width, sparse, attribute, run in parts:
        for row in range(run.count):
            assert unpacked(packed, name, width, row) == stored(sparse, [attribute], run.first + row), name
    template = floats(pack_morph(rig, vertices), "template_plane").reshape(3, 9)
    np.testing.assert_array_equal(template.T, rig.vertices[3:12])


def test_surface_and_embed_heaps() -> None:
    e = SURFACE.embedding
    assert e is not None
    surface = prepare(e, SURFACE.rules, SURFACE.training_per_bundle)
    assert SURFACE.rig is not None
    packed, faces = pack_surface(surface, SURFACE.rig.skin), len(e.triangles)
    np.testing.assert_array_equal(section(packed, "triangle_plane").reshape(3, faces).T, e.triangles)
    frame = floats(packed, "canonical_frame").reshape(9, faces).T.reshape(faces, 3, 3)
    np.testing.assert_array_equal(frame, surface.canonical.frame.astype(np.float32))
    np.testing.assert_array_equal(floats(packed, "canonical_size"), surface.canonical.size.astype(np.float32))
    np.testing.assert_array_equal(section(packed, "vertex_triangle_ptr"), surface.vertex_triangle_ptr)
    np.testing.assert_array_equal(section(packed, "vertex_triangle"), surface.vertex_triangle)
    for row in range(VERTICES):
        assert unpacked(packed, "skin", 2, row) == stored(SURFACE.rig.skin, ["weight"], row)
    packed, rows = pack_embedded(surface, MIDDLE), slice(7, 27)
    np.testing.assert_array_equal(section(packed, "triangle_ids"), e.triangle[rows])
    np.testing.assert_array_equal(section(packed, "vertex_ids").reshape(3, 20).T, e.vertex_ids[rows])
    np.testing.assert_array_equal(floats(packed, "barycentric").reshape(3, 20).T, e.barycentric[rows])
    np.testing.assert_array_equal(
        packed.words[packed.offsets["displacement"] :][:20].view("f4"), e.displacement[rows]
    )
    np.testing.assert_array_equal(floats(packed, "local_quat").reshape(4, 20).T, e.local_quat_wxyz[rows])
    np.testing.assert_array_equal(
        floats(packed, "canonical_size"), surface.canonical.size[e.triangle[rows]].astype(np.float32)
    )


@pytest.mark.parametrize("limit", [1300, 1700, 4096, 20000])
@pytest.mark.parametrize("avatar", [AVATAR, SURFACE], ids=["joints", "surface"])
def test_runs_cover_all_rows_and_keep_the_limit(avatar: object, limit: int) -> None:
    """Against the bytes that are really packed, and with no run that the next row would still have fitted into."""
    rig = avatar.rig
    found = gaussian_runs(avatar, limit)
    assert [run.first for run in found] == np.cumsum([0, *[run.count for run in found]])[:-1].tolist()
    assert sum(run.count for run in found) == COUNT
    surface = None
    if avatar.embedding is not None:
        surface = prepare(avatar.embedding, avatar.rules, avatar.training_per_bundle)

    def largest(run: Run) -> int:
        other = pack_bind(avatar, run) if surface is None else pack_embedded(surface, run)
        heaps = max(pack_blend(avatar, run).words.nbytes, other.words.nbytes)
        return max(heaps, run.count * 16 * 5, run.count * 4 * 48)

    for run in found:
        assert largest(run) <= limit
        if run.first + run.count < COUNT:
            assert largest(Run(run.first, run.count + 1)) > limit
    for run in vertex_runs(rig, limit):
        assert max(pack_morph(rig, run).words.nbytes, pack_skin(rig, run).words.nbytes) <= limit
    assert sum(run.count for run in vertex_runs(rig, limit)) == VERTICES


def test_a_dispatch_has_no_more_rows_than_groups_allow() -> None:
    found = runs("row", 10_000_000, [Cost(4)], 1 << 40)
    assert [run.count for run in found] == [65535 * 64, 65535 * 64, 10_000_000 - 2 * 65535 * 64]


def test_what_cannot_be_split_is_named() -> None:
    with pytest.raises(
        AvatarError, match=r"Gaussian 1 takes \d+ bytes in one buffer, the limit is 1000; raise buffer_l"
    ):
        gaussian_runs(AVATAR, 1000)
    with pytest.raises(AvatarError, match="Gaussian 0 takes 252 bytes"):
        gaussian_runs(SURFACE, 100)


def test_nothing_has_no_runs() -> None:
    assert runs("row", 0, [Cost(4, 8)], 1024) == ()
