"""How an avatar is packed and split for the GPU; no GPU is asked."""

from __future__ import annotations

import numpy as np
import pytest

from avatar_runtime.avatar import Avatar, SparseRows
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.program.bake import bake, pose_layout
from avatar_runtime.program.chunks import Cost, runs
from avatar_runtime.program.gaussians import gaussian_runs
from avatar_runtime.program.mesh import bake_surface, vertex_runs
from avatar_runtime.program.model import Buffer, Program, Run, Section
from tests.avatars import COUNT, VERTICES, full_avatar, surface_avatar

AVATAR, SURFACE = full_avatar(5), surface_avatar(5)
LIMITS = [1500, 1900, 4096, 20000]


def section(program: Program, buffer: str, name: str) -> np.ndarray:
    """Elements of a section, read from the words that are uploaded, as a kernel reads them."""
    held = program.buffers[buffer]
    at, kept = held.offsets()[name], next(s for s in held.sections if s.name == name)
    return held.content()[at:].view(kept.elements.dtype)[: len(kept.elements)]


def floats(program: Program, buffer: str, name: str) -> np.ndarray:
    return section(program, buffer, name).view(np.float32)


def unpacked(program: Program, buffer: str, name: str, attributes: list[str], row: int) -> list[object]:
    """Entries of one row as (column, values)."""
    ptr, column = section(program, buffer, f"{name}_ptr"), section(program, buffer, f"{name}_column")
    found = []
    for e in range(ptr[row], ptr[row + 1]):
        parts = [floats(program, buffer, a).reshape(len(column), -1)[e].tolist() for a in attributes]
        found.append((int(column[e]), parts))
    return found


def stored(sparse: SparseRows, attributes: list[str], row: int) -> list[object]:
    found = []
    for e in range(sparse.row_ptr[row], sparse.row_ptr[row + 1]):
        parts = [sparse.values[a][e].reshape(-1).tolist() for a in attributes]
        found.append((int(sparse.column[e]), parts))
    return found


def chunked(avatar: Avatar, limit: int) -> list[tuple[Program, int, Run]]:
    program = bake(avatar, limit=limit)
    return [(program, index, run) for index, run in enumerate(program.levels[0].chunks)]


def test_sections_begin_at_words_and_keep_their_bits() -> None:
    buffer = Buffer(
        "x",
        12,
        (
            Section("a", np.array([1, 2, 3], np.uint8)),
            Section("b", np.zeros(0, np.uint16)),
            Section("c", np.array([-0.0], np.float32).view(np.uint32)),
            Section("d", np.array([5, 7], np.uint16)),
        ),
    )
    assert buffer.offsets() == {"a": 0, "b": 1, "c": 1, "d": 2}
    assert buffer.content().tolist() == [0x00030201, 0x80000000, 0x00070005]


@pytest.mark.parametrize("limit", [4096, 1 << 20])
def test_blend_and_bind_of_each_chunk(limit: int) -> None:
    g, shapes = AVATAR.gaussians, AVATAR.blendshapes
    for program, index, run in chunked(AVATAR, limit):
        blend, bind, n = f"BlendStatic.{index}", f"BindStatic.{index}", run.count
        rows = slice(run.first, run.first + n)
        for name, values in (
            ("base_mean", g.mean),
            ("base_log_scale", g.log_scale),
            ("base_quat", g.quat_wxyz),
            ("base_opacity", g.opacity_logit),
            ("base_sh", g.sh),
        ):
            planes = floats(program, blend, name).reshape(-1, n).T
            np.testing.assert_array_equal(planes, values[rows].reshape(n, -1), name)
        parts = [
            (blend, "geometry", shapes.geometry, ["mean", "quat_wxyz"], ["geometry_mean", "geometry_quat"]),
            (
                blend,
                "appearance",
                shapes.appearance,
                ["log_scale", "opacity_logit", "sh"],
                ["appearance_log_scale", "appearance_opacity", "appearance_sh"],
            ),
            (bind, "corrective", shapes.correctives, ["mean"], ["corrective_mean"]),
            (bind, "late", shapes.late_morphs, ["mean"], ["late_mean"]),
            (bind, "skin", AVATAR.skin, ["weight"], ["skin_weight"]),
        ]
        for buffer, name, sparse, attributes, sections in parts:
            for row in range(n):
                got = unpacked(program, buffer, name, sections, row)
                assert got == stored(sparse, attributes, run.first + row), name


def test_mesh_and_surface() -> None:
    program, rig, e = bake(SURFACE), SURFACE.rig, SURFACE.embedding
    assert rig is not None and e is not None
    template = floats(program, "MorphStatic.0", "template_position")
    np.testing.assert_array_equal(template.reshape(3, -1).T, rig.vertices)
    faces = len(e.triangles)
    np.testing.assert_array_equal(
        section(program, "SurfaceStatic", "corners").reshape(3, faces).T, e.triangles
    )
    canonical = floats(program, "SurfaceStatic", "canonical")
    np.testing.assert_array_equal(canonical.reshape(3, -1).T, e.canonical_vertices)
    ptr, around = (section(program, "SurfaceStatic", f"vertex_triangle{x}") for x in ("_ptr", ""))
    for vertex in range(VERTICES):
        want = [face for face in range(faces) for corner in e.triangles[face] if corner == vertex]
        assert around[ptr[vertex] : ptr[vertex + 1]].tolist() == want
    for row in range(VERTICES):
        for buffer, name, sparse, attribute, values in (
            ("MorphStatic.0", "morph", rig.morphs, "position", "morph_position"),
            ("MorphStatic.0", "corrective", rig.correctives, "position", "corrective_position"),
            ("SkinStatic.0", "late", rig.late_morphs, "position", "late_position"),
            ("SkinStatic.0", "skin", rig.skin, "weight", "skin_weight"),
        ):
            assert unpacked(program, buffer, name, [values], row) == stored(sparse, [attribute], row)
    assert section(program, "EmbedStatic.0", "triangle_ids").tolist() == e.triangle.tolist()
    for name, field in (
        ("barycentric", e.barycentric),
        ("displacement", e.displacement[:, None]),
        ("local_quat", e.local_quat_wxyz),
    ):
        got = floats(program, "EmbedStatic.0", name).reshape(field.shape[1], -1).T
        np.testing.assert_array_equal(got, field)


def test_without_a_rig_the_canonical_mesh_is_morphed_by_nothing() -> None:
    avatar = surface_avatar(3, rigged=False)
    program = bake(avatar)
    assert [one.entry for one in program.mesh] == ["morph"] and program.reads_mesh
    assert avatar.embedding is not None
    template = floats(program, "MorphStatic.0", "template_position").reshape(3, -1).T
    np.testing.assert_array_equal(template, avatar.embedding.canonical_vertices)


def test_a_name_of_the_frame_stands_for_what_changes() -> None:
    program = bake(AVATAR)
    binds = [one for one in program.levels[0].deform if one.entry == "bind_skin"]
    assert [one.constants["group_matrix_row1"] for one in binds] == [
        f"group_matrix_row1[{index}]" for index in range(len(AVATAR.groups))
    ]
    assert binds[0].constants["world_row2"] == "world_row2"
    (project,) = program.levels[0].view
    assert project.constants["eye"] == "eye" and project.constants["sh_degree"] == AVATAR.sh_degree


@pytest.mark.parametrize("limit", LIMITS)
@pytest.mark.parametrize("avatar", [AVATAR, SURFACE], ids=["joints", "surface"])
def test_runs_cover_all_rows_and_keep_the_limit(avatar: Avatar, limit: int) -> None:
    """Against the bytes that are really packed; a run is as long as it can be, but for bytes that fill words."""
    found = gaussian_runs(avatar, {}, limit)
    assert [run.first for run in found] == np.cumsum([0, *[run.count for run in found]])[:-1].tolist()
    assert sum(run.count for run in found) == COUNT
    program = bake(avatar, limit=limit if avatar is AVATAR else max(limit, 4096))  # the mesh cannot be split
    for name, buffer in program.buffers.items():
        assert buffer.size <= max(limit, 4096), name
        assert buffer.size == 4 * len(buffer.content()) or not buffer.sections
    assert avatar.rig is not None
    assert sum(run.count for run in vertex_runs(avatar.rig.vertices, avatar.rig, limit)) == VERTICES


@pytest.mark.parametrize("limit", LIMITS[:2])
def test_a_run_is_as_long_as_the_limit_allows(limit: int) -> None:
    found = gaussian_runs(AVATAR, {}, limit)
    program = bake(AVATAR, limit=limit)
    for index, run in enumerate(found[:-1]):
        sizes = [
            program.buffers[f"{kind}.{index}"].size for kind in ("BlendStatic", "BindStatic", "Sh", "Splats")
        ]
        assert max(sizes) <= limit
        shapes, row = AVATAR.blendshapes, run.first + run.count
        entries = [int(np.diff(part.row_ptr)[row]) for part in (shapes.geometry, shapes.appearance)]
        more = 4 * (11 + 48 + 2) + 29 * entries[0] + (1 + 4 * 52) * entries[1] + 8
        assert sizes[0] + more > limit or max(sizes[2:]) / run.count * (run.count + 1) > limit, index


def test_a_dispatch_has_no_more_rows_than_groups_allow() -> None:
    found = runs("row", 10_000_000, [Cost(4)], 1 << 40)
    assert [run.count for run in found] == [65535 * 64, 65535 * 64, 10_000_000 - 2 * 65535 * 64]


def test_what_cannot_be_split_is_named() -> None:
    with pytest.raises(
        AvatarError, match=r"Gaussian 1 takes \d+ bytes in one buffer, the limit is 1000; raise"
    ):
        gaussian_runs(AVATAR, {}, 1000)
    with pytest.raises(AvatarError, match="Gaussian 0 takes 260 bytes"):
        gaussian_runs(SURFACE, {}, 100)


def test_a_mesh_and_a_surface_cannot_be_split() -> None:
    with pytest.raises(
        AvatarError, match="the mesh of 20 vertices takes 960 bytes in one buffer, the limit is 900"
    ):
        bake(SURFACE, limit=900)
    pose, _ = pose_layout(SURFACE)
    with pytest.raises(
        AvatarError, match="the surface of 20 triangles takes 960 bytes in one buffer, the limit is 900"
    ):
        bake_surface(SURFACE, {}, pose, 900, {})


def test_nothing_has_no_runs() -> None:
    assert runs("row", 0, [Cost(4, 8)], 1024) == ()
