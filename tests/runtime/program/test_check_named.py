"""What the checker of programs refuses, it names: the pass, and the constant, section or buffer."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from avatar_runtime.io.errors import AvatarError
from avatar_runtime.program.check import check_program
from avatar_runtime.program.model import Array, Buffer, Constant, Pass, Program, Run, Section
from tests.runtime.program.coded import programs
from tests.runtime.program.mutations import (
    Spot,
    spots,
    with_buffer,
    with_chunk,
    with_constant,
    with_elements,
    with_list,
    with_pass,
)

PROGRAMS = programs()
Change = Callable[[Program], Program]


def at(program: Program, entry: str) -> tuple[Spot, Pass]:
    """The first pass of an entry."""
    return next((spot, one) for spot, one in spots(program) if one.entry == entry)


def value(entry: str, name: str, value: Constant) -> Change:
    return lambda program: with_constant(program, *at(program, entry), name, value)


def element(buffer: str, name: str, index: int, value: float) -> Change:
    def change(elements: Array) -> Array:
        elements.view(np.float32 if isinstance(value, float) else elements.dtype)[index] = value
        return elements

    return lambda program: with_elements(program, buffer, name, change)


def given(entry: str, /, **changed: object) -> Change:
    return lambda program: with_pass(program, at(program, entry)[0], **changed)


def without(entry: str) -> Change:
    def change(program: Program) -> Program:
        spot, _ = at(program, entry)
        return with_list(program, spot, lambda passes: passes.pop(spot[2]))

    return change


def twisted(program: Program) -> Program:
    """All passes agree on a number of vertices that the mesh does not have."""
    for spot, one in spots(program):
        if "vertices" in one.constants:
            program = with_constant(program, spot, one, "vertices", 21)
    return program


def renamed(program: Program) -> Program:
    """The mesh is in a buffer of another name."""
    for spot, one in spots(program):
        bound = {name: "M" if buffer == "Mesh" else buffer for name, buffer in one.buffers.items()}
        program = with_pass(program, spot, buffers=bound)
    kept = {name: buffer for name, buffer in program.buffers.items() if name != "Mesh"}
    return replace(program, buffers={**kept, "M": Buffer("M", program.buffers["Mesh"].size)})


def shorter(buffer: str, name: str, by: int) -> Change:
    return lambda program: with_elements(program, buffer, name, lambda e: e[: len(e) - by])


def sections(change: Callable[[tuple[Section, ...]], tuple[Section, ...]]) -> Change:
    def changed(program: Program) -> Program:
        sections = change(program.buffers["SkinStatic.0"].sections)
        size = 4 * sum(section.words for section in sections)
        return with_buffer(program, "SkinStatic.0", sections=sections, size=size)

    return changed


def listed(which: str, change: Callable[[tuple[Pass, ...]], tuple[Pass, ...]]) -> Change:
    """Another list of passes of the only level."""
    return lambda p: replace(
        p, levels=(replace(p.levels[0], **{which: change(getattr(p.levels[0], which))}),)
    )


def many(program: Program) -> Program:
    more = {f"more {i}": Buffer(f"more {i}", (1 << 31) - 1) for i in range(3)}
    return replace(program, buffers={**program.buffers, **more})


def later(program: Program, name: str, value: Constant) -> Program:
    """Another constant in the second pass of blend."""
    spot, one = [found for found in spots(program) if found[1].entry == "blend"][1]
    return with_constant(program, spot, one, name, value)


REFUSED: list[tuple[str, Change, str, str]] = [  # program, change, field, message
    ("full", given("blend", entry="sort_keys"), "level 0, deform pass 0 (sort_keys)", "no entry that"),
    ("full", given("blend", entry=["x"]), "level 0, deform pass 0 (['x'])", "no entry that"),
    ("full", given("project", constants={}), "level 0, view pass 0 (project), constants", "is missing"),
    ("full", value("project", "iso", 1), "(project), constants", "'iso' is not known"),
    ("full", given("project", buffers={}), "(project), buffers", "is missing"),
    ("full", value("project", "near_z", float("inf")), "(project), near_z", "is inf; a finite float32"),
    ("full", value("project", "near_z", 1e308), "(project), near_z", "a finite float32"),
    ("full", value("project", "eye", (0.0, 1.0)), "(project), eye", "4 finite float32"),
    ("full", value("project", "eye", "tan_half_fov"), "(project), eye", "has 2 floats; a float4"),
    ("full", value("project", "eye", "world_row0"), "(project), eye", "is no value of the frame"),
    ("full", value("project", "count", True), "(project), count", "whole number of 32 bits"),
    ("full", value("project", "count", 48.0), "(project), count", "whole number of 32 bits"),
    ("full", value("project", "sh_degree", 4), "(project), sh_degree", "4 is not known; known are 0, 1"),
    ("full", value("bind_skin", "rotation_rule", 0), "(bind_skin), rotation_rule", "0 is not known"),
    (
        "full",
        value("bind_skin", "group_matrix_row1", "group_matrix_row1[4]"),
        "group_matrix_row1",
        "4 groups",
    ),
    (
        "full",
        value("bind_skin", "group_matrix_row1", "group_matrix_row1"),
        "group_matrix_row1",
        "needs a row",
    ),
    ("full", value("bind_skin", "world_row1", "world_row1[0]"), "world_row1", "needs no row"),
    ("full", value("bind_skin", "first", 25), "(bind_skin), first+rows", "is 49; count is 48"),
    ("full", given("blend", rows=1 << 31), "(blend), rows", "constant count is 48"),
    ("full", value("skin", "joints", 0), "(skin), joints", "is 0; joints begins at"),
    ("full", value("skin", "first", 41), "(skin), Mesh", "takes 976 bytes; 'Mesh' has 960"),
    ("full", value("blend", "base_sh", 1), "(blend), base_sh", "the section begins at word"),
    ("full", value("blend", "base_sh_width", 24), "(blend), base_sh_width", "is 24; known are 0, 8"),
    ("full", element("BlendStatic.0", "base_mean", 7, float("nan")), "(blend), base_mean", "not finite"),
    ("full coded", element("BlendStatic.0", "base_mean_scale", 1, 1e35), "base_mean_scale", "exceeds 1e+30"),
    ("full coded", element("BlendStatic.0", "base_opacity", 9, 5), "(blend), base_opacity", "5; less than 5"),
    ("full", element("BlendStatic.0", "geometry_column", 3, 4), "geometry_column", "holds 4; less than 4"),
    ("full", element("BindStatic.0", "skin_ptr", 0, 1), "(bind_skin), skin_ptr", "does not begin with 0"),
    ("full", element("BindStatic.0", "skin_ptr", 4, 0), "(bind_skin), skin_ptr", "or falls"),
    ("surface", element("EmbedStatic.0", "triangle_ids", 5, 20), "(bind_surface), triangle_ids", "holds 20"),
    ("surface", element("SurfaceStatic", "corners", 5, 20), "(bind_triangles), corners", "less than 20"),
    ("surface", without("bind_triangles"), "(bind_vertices), Triangles", "no earlier pass writes"),
    ("surface", without("blend"), "level 0, deform pass 0 (bind_triangles), entry", "the order is blend"),
    ("surface", value("bind_surface", "rotation_rule", 1), "rotation_rule", "an earlier pass over Triangles"),
    ("surface", twisted, "(morph), Mesh", "takes 1008 bytes; 'Mesh' has 960"),
    ("surface", lambda p: replace(p, reads_mesh=False), "reads_mesh", "is False"),
    ("surface", lambda p: replace(p, pose={**p.pose, "late": 10**6}), "pose", "takes"),
    ("surface", lambda p: replace(p, pose_floats=p.pose_floats + 1), "pose", "joints takes 61 floats"),
    ("surface", lambda p: replace(p, levels=()), "levels", "there is none"),
    ("two levels", lambda p: replace(p, levels=p.levels[:1] * 2), "levels", "the same prefix"),
    ("full", lambda p: with_buffer(p, "Sh.0", size=1 << 31), "buffer Sh.0", "2147483647 are the most"),
    ("full", lambda p: with_buffer(p, "Sh.0", size=1 << 30), "buffer Sh.0", "passes touch 9216"),
    ("full", lambda p: with_buffer(p, "BlendStatic.0", size=4), "buffer BlendStatic.0", "its sections take"),
    (
        "full",
        lambda p: with_buffer(p, "Pose", sections=p.buffers["SkinStatic.0"].sections),
        "buffer Pose",
        "take",
    ),
    ("full", given("activate", rows=0, constants={"count": 0}), "(activate), count", "is 0; 1 to 4194240"),
    ("full coded", shorter("BlendStatic.0", "base_opacity_table", 5), "base_opacity_table", "1 of 32 bits"),
    ("full coded", shorter("BlendStatic.0", "base_sh_scale", 1), "base_sh_scale", "95 elements; 96 of 32"),
    ("surface", renamed, "(morph), Mesh", "is bound to 'M'; players write buffer 'Mesh'"),
    ("full", sections(lambda s: s + s), "buffer SkinStatic.0, late_ptr", "is a duplicate"),
    ("full", sections(lambda s: (Section("x", np.zeros(1)), *s)), "buffer SkinStatic.0, x", "is float64"),
    ("full", listed("view", lambda view: ()), "level 0, view", "has no passes"),
    (
        "full",
        listed("view", lambda view: view * 2),
        "level 0, view",
        "2 passes write Projected.0; one is needed",
    ),
    (
        "full",
        listed("view", lambda view: view * 20000),
        "level 0, view",
        "has 20000 passes; 16384 are the most",
    ),
    ("full", many, "buffers", "4294967296 are the most"),
    ("chunks", lambda p: later(p, "sh_terms", 4), "(blend), sh_terms", "an earlier pass over level 0"),
    (
        "two levels",
        given("activate", buffers={"Splats": "level1/Splats.0"}),
        "(activate), Splats",
        "is no buffer of this chunk",
    ),
    ("lit", listed("light", lambda passes: ()), "level 0, shadow", "casts shadows that no pass reads"),
    ("lit", listed("shadow", lambda passes: ()), "level 0, shadow", "has no passes"),
    ("lit", listed("light", lambda passes: passes[1:]), "level 0, light", "0 passes write Projected.0; one"),
    ("lit", listed("light", lambda passes: passes * 2), "level 0, light", "2 passes write Projected.0; one"),
    ("lit", value("shadow", "shadow_row0", "light_place0"), "shadow_row0", "is no value of the frame"),
    ("lit", value("light", "place0", "eye"), "(light), place0", "is no value of the frame"),
    ("lit", value("shadow_clear", "texels", 7), "(shadow_clear), texels", "7 is not known"),
    ("lit surface", element("SurfaceStatic", "corners", 5, 20), "corners", "less than 20"),
    ("chunks", lambda p: with_chunk(p, 0, 1, Run(3, 4)), "level 0, chunk 1", "begins at row 3, not"),
]


@pytest.mark.parametrize("case", range(len(REFUSED)))
def test_what_is_refused_is_named(case: int) -> None:
    name, change, field, message = REFUSED[case]
    program, groups = PROGRAMS[name]
    with pytest.raises(AvatarError, match=re.escape(message)) as found:
        check_program(change(program), groups)
    assert found.value.field is not None and field in found.value.field and len(str(found.value)) < 250


def _instead(elements: Array, _: Array) -> Array:
    return elements


def long_row() -> tuple[Program, int]:
    """A program whose first Gaussian has one late morph too many."""
    program, groups = PROGRAMS["full"]
    ptr = np.full(49, (1 << 16) + 1, np.uint32)
    ptr[0] = 0
    late = {"column": np.zeros(ptr[1], np.uint8), "mean": np.zeros(3 * ptr[1], np.uint32), "ptr": ptr}
    for name, elements in late.items():
        program = with_elements(program, "BindStatic.0", f"late_{name}", partial(_instead, elements))
    return program, groups


def test_a_row_has_a_limited_number_of_entries() -> None:
    with pytest.raises(AvatarError, match="late_ptr: gives a row 65537 entries; 65536 are the most"):
        check_program(*long_row())


def test_the_work_of_a_frame_is_limited() -> None:
    program, groups = PROGRAMS["full"]
    with pytest.raises(AvatarError, match=r"level 0: has \d+ rows and entries a frame; 1000 are the most"):
        check_program(program, groups, 1000)


def test_bits_of_a_section_are_counted_in_32_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kernels find an element by its first bit."""
    program, groups = PROGRAMS["full coded"]
    monkeypatch.setattr("avatar_runtime.program.access.U32_END", 30_000)
    with pytest.raises(AvatarError, match=r"has \d+ elements of \d+ bits; their bits exceed"):
        check_program(program, groups)
