"""Which elements of their buffers the kernels touch: hlsl/ walked thread by thread, with buffers that guard themselves.

It shares nothing with the access contracts or their checker. Numbers that no index depends on are not computed: every
weight of a pose counts as different from 0, so that every entry is read.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from avatar_runtime.program.model import Buffer, Pass, Program
from avatar_schema import rules

MASK = 0xFFFFFFFF
THREADS = 64
LAST_TEXEL = 256 * 256 - 1  # of a shadow map
BUDGET = 800_000  # accesses of one program of these tests: a sound one takes a tenth


class Harm(Exception):
    """An access outside a buffer, a write to a static one, or work without end."""


class Guarded:
    """A buffer of `size` elements. `held` is what indices depend on: words, or the vertex ids of a triangle."""

    def __init__(self, name: str, words: list[int] | None, bytes_: int, budget: list[int]) -> None:
        self.name, self.words, self.bytes, self.budget = name, words, bytes_, budget
        self.held: dict[int, tuple[int, ...]] = {}

    def touch(self, index: int, stride: int, *, write: bool = False) -> int:
        """The index in 32 bits. Raises Harm outside."""
        index &= MASK
        self.budget[0] -= 1
        if self.budget[0] < 0:
            raise Harm("work without end")
        if index >= self.bytes // stride:
            raise Harm(f"{self.name}[{index}] of {self.bytes // stride}")
        if write and self.words is not None:
            raise Harm(f"{self.name} is static and written")
        return index

    def word(self, index: int) -> int:
        index = self.touch(index, 4)
        if self.words is None:
            raise Harm(f"{self.name} has no words that are known")
        return self.words[index]

    def read(self, index: int) -> None:
        self.touch(index, 16)

    def write(self, index: int, held: tuple[int, ...] | None = None) -> None:
        index = self.touch(index, 16, write=True)
        self.held.pop(index, None)
        if held is not None:
            self.held[index] = held

    def read_float(self, index: int) -> None:
        self.touch(index, 4)

    def write_float(self, index: int) -> None:
        self.held.pop(self.touch(index, 4, write=True) // 4, None)


def guarded(buffers: Mapping[str, Buffer]) -> dict[str, Guarded]:
    """All buffers of a program, as they are when it is uploaded."""
    budget = [BUDGET]
    made = {}
    for name, buffer in buffers.items():
        words = buffer.content().tolist() if buffer.sections else None
        made[name] = Guarded(name, words, buffer.size if words is None else 4 * len(words), budget)
    return made


def walk(program: Program, sound: frozenset[tuple[int, ...]] = frozenset()) -> None:
    """All passes of a frame of each level, and what a scene reads of its chunks. Raises Harm.

    `sound` are the keys (see `key`) of passes that need no walk: those of a harmless program that is still alive.
    """
    held = guarded(program.buffers)
    corners = {one.buffers.get("Triangles") for one in program.passes()}

    def walked(one: Pass) -> None:
        if corners & set(one.buffers.values()) or key(one, program.buffers) not in sound:
            run(one, held)

    for one in program.mesh:
        walked(one)
    for level in program.levels:
        for one in (*level.deform, *level.view, *level.shadow, *level.light):
            walked(one)
        for index, chunk in enumerate(level.chunks):
            buffer = held[level.names("Projected")[index]]
            if buffer.bytes < 48 * chunk.count:
                raise Harm(f"{buffer.name} is smaller than its chunk")


def key(one: Pass, buffers: Mapping[str, Buffer]) -> tuple[int, ...]:
    """What a pass and its buffers are, as objects. Only passes that read Triangles depend on more."""
    return (id(one), *(id(buffers.get(name)) for name in one.buffers.values()))


def run(one: Pass, held: Mapping[str, Guarded]) -> None:
    """One dispatch."""
    kernel = KERNELS[one.entry]
    if not held.keys() >= set(one.buffers.values()):
        raise Harm("a buffer that does not exist")
    bound = {name: held[buffer] for name, buffer in one.buffers.items()}
    c = {name: value for name, value in one.constants.items() if isinstance(value, int)}
    if one.rows > BUDGET:
        raise Harm("work without end")
    for thread in range(-(-one.rows // THREADS) * THREADS):
        kernel(thread, c, bound)


# packed.hlsli


def code(b: Guarded, section: int, index: int, width: int) -> int:
    if width == 32:
        return b.word(section + index)
    bit = index * width & MASK
    word = b.word(section + (bit >> 5))
    return word >> (bit & 31) & ((1 << (width & 31)) - 1)


def linear(b: Guarded, section: int, index: int, width: int, scale: int) -> None:
    code(b, section, index, width)
    if width != 32:
        b.word(scale)
        b.word(scale + 1)


def linear3(b: Guarded, section: int, index: int, stride: int, width: int, scale: int) -> None:
    for i in range(3):
        linear(b, section, index + i * stride, width, scale + 2 * i)


def signed(b: Guarded, section: int, index: int, width: int, step: int) -> None:
    if width == 0:
        return
    code(b, section, index, width)
    if width != 32:
        b.word(step)


def signed3(b: Guarded, section: int, index: int, width: int, step: int) -> None:
    for i in range(3):
        signed(b, section, index + i, width, step + i)


def weighted(b: Guarded, section: int, index: int, width: int, step: int) -> None:
    code(b, section, index, width)
    if width != 32:
        b.word(step)


def table(b: Guarded, section: int, index: int, width: int, at: int) -> None:
    found = code(b, section, index, width)
    if width != 32:
        b.word(at + found)


def entries(b: Guarded, ptr: int, row: int) -> Iterator[int]:
    end, e = b.word(ptr + row + 1), b.word(ptr + row)
    while e < end:
        yield e
        e += 1


def joint(pose: Guarded, joints: int, index: int) -> None:
    for i in range(12):
        pose.read_float(joints + 12 * index + i)


# the entries, each as its file


def morph(row: int, c: Mapping[str, int], b: Mapping[str, Guarded]) -> None:
    if row >= c["count"]:
        return
    s = b["MorphStatic"]
    at, width, scale = (c[f"template_position{x}"] for x in ("", "_width", "_scale"))
    linear3(s, at, row, c["count"], width, scale)
    for name, pose in (("morph", "weights"), ("corrective", "features")):
        for e in entries(s, c[f"{name}_ptr"], row):
            column = code(s, c[f"{name}_column"], e, c[f"{name}_column_width"])
            b["Pose"].read_float(c[pose] + column)
            step = c[f"{name}_position_step"] + 3 * column
            signed3(s, c[f"{name}_position"], 3 * e, c[f"{name}_position_width"], step)
    b["Mesh"].write(c["first"] + row)


def skin(row: int, c: Mapping[str, int], b: Mapping[str, Guarded]) -> None:
    if row >= c["count"]:
        return
    s = b["SkinStatic"]
    for e in entries(s, c["skin_ptr"], row):
        weighted(s, c["skin_weight"], e, c["skin_weight_width"], c["skin_weight_step"])
        joint(b["Pose"], c["joints"], code(s, c["skin_column"], e, c["skin_column_width"]))
    b["Mesh"].read(c["first"] + row)
    for e in entries(s, c["late_ptr"], row):
        column = code(s, c["late_column"], e, c["late_column_width"])
        step = c["late_position_step"] + 3 * column
        signed3(s, c["late_position"], 3 * e, c["late_position_width"], step)
        b["Pose"].read_float(c["late"] + column)
    b["Mesh"].write(c["first"] + row)


def blend(row: int, c: Mapping[str, int], b: Mapping[str, Guarded]) -> None:
    count, terms, s = c["count"], c["sh_terms"], b["BlendStatic"]
    if row >= count:
        return
    for name in ("base_mean", "base_log_scale"):
        linear3(s, c[name], row, count, c[f"{name}_width"], c[f"{name}_scale"])
    linear(s, c["base_quat"], row, c["base_quat_width"], c["base_quat_scale"])
    linear3(s, c["base_quat"], count + row, count, c["base_quat_width"], c["base_quat_scale"] + 2)
    table(s, c["base_opacity"], row, c["base_opacity_width"], c["base_opacity_table"])
    for e in entries(s, c["geometry_ptr"], row):
        column = code(s, c["geometry_column"], e, c["geometry_column_width"])
        b["Pose"].read_float(c["weights"] + column)
        step = c["geometry_mean_step"] + 3 * column
        signed3(s, c["geometry_mean"], 3 * e, c["geometry_mean_width"], step)
        step = c["geometry_quat_step"] + 4 * column
        signed(s, c["geometry_quat"], 4 * e, c["geometry_quat_width"], step)
        signed3(s, c["geometry_quat"], 4 * e + 1, c["geometry_quat_width"], step + 1)
    for e in entries(s, c["appearance_ptr"], row):
        column = code(s, c["appearance_column"], e, c["appearance_column_width"])
        b["Pose"].read_float(c["weights"] + column)
        step = c["appearance_log_scale_step"] + 3 * column
        signed3(s, c["appearance_log_scale"], 3 * e, c["appearance_log_scale_width"], step)
        step = c["appearance_opacity_step"] + column
        signed(s, c["appearance_opacity"], e, c["appearance_opacity_width"], step)
    for plane in range(5):
        b["Splats"].write(plane * count + row)
    for k in range(0, terms, 4):
        _blend_sh_from(k, row, c, b)


def _blend_sh_from(k: int, row: int, c: Mapping[str, int], b: Mapping[str, Guarded]) -> None:
    count, s, last = c["count"], b["BlendStatic"], c["sh_terms"] - 1
    firsts = [3 * k, *(3 * min(k + i, last) for i in (1, 2, 3))]
    for t in firsts:
        linear3(s, c["base_sh"], t * count + row, count, c["base_sh_width"], c["base_sh_scale"] + 2 * t)
    s.word(c["appearance_ptr"] + row + 1)
    if c["appearance_sh_width"] == 0:
        s.word(c["appearance_ptr"] + row)
    else:
        terms = 3 * c["sh_terms"]
        for e in entries(s, c["appearance_ptr"], row):
            column = code(s, c["appearance_column"], e, c["appearance_column_width"])
            b["Pose"].read_float(c["weights"] + column)
            at, step = terms * e, c["appearance_sh_step"] + terms * column
            for t in firsts:
                signed3(s, c["appearance_sh"], at + t, c["appearance_sh_width"], step + t)
    for term in range(k, k + 4):
        if term < c["sh_terms"]:
            for channel in range(3):
                b["Sh"].write_float((3 * term + channel) * count + row)


def bind_skin(thread: int, c: Mapping[str, int], b: Mapping[str, Guarded]) -> None:
    if thread >= c["rows"]:
        return
    row, s = c["first"] + thread & MASK, b["BindStatic"]
    if c["binding_rule"] == rules()["binding"].value("skin").code:
        for e in entries(s, c["skin_ptr"], row):
            joint(b["Pose"], c["joints"], code(s, c["skin_column"], e, c["skin_column_width"]))
            weighted(s, c["skin_weight"], e, c["skin_weight_width"], c["skin_weight_step"])
    for name, pose in (("corrective", "features"), ("late", "late")):
        for e in entries(s, c[f"{name}_ptr"], row):
            column = code(s, c[f"{name}_column"], e, c[f"{name}_column_width"])
            step = c[f"{name}_mean_step"] + 3 * column
            b["Pose"].read_float(c[pose] + column)
            signed3(s, c[f"{name}_mean"], 3 * e, c[f"{name}_mean_width"], step)
    _in_place(row, c["count"], b["Splats"])


def bind_triangles(row: int, c: Mapping[str, int], b: Mapping[str, Guarded]) -> None:
    triangles, s = c["triangles"], b["SurfaceStatic"]
    if row >= triangles:
        return
    vertex = tuple(code(s, c["corners"], plane * triangles + row, c["corners_width"]) for plane in range(3))
    for v in vertex:
        b["Mesh"].read(v)
        linear3(s, c["canonical"], v, c["vertices"], c["canonical_width"], c["canonical_scale"])
    b["Triangles"].write(row)
    b["Triangles"].write(triangles + row)
    b["Triangles"].write(2 * triangles + row, vertex)


def bind_vertices(row: int, c: Mapping[str, int], b: Mapping[str, Guarded]) -> None:
    vertices, triangles, s = c["vertices"], c["triangles"], b["SurfaceStatic"]
    if row >= vertices:
        return
    for e in entries(s, c["vertex_triangle_ptr"], row):
        t = code(s, c["vertex_triangle"], e, c["vertex_triangle_width"])
        for plane in (2, 0, 1):
            b["Triangles"].read(plane * triangles + t)
    b["Mesh"].write(vertices + row)
    b["Mesh"].write(2 * vertices + row)
    if c["rotation_rule"] == rules()["rotation"].value("bary_vertex_lbs").code:
        for e in entries(s, c["skin_ptr"], row):
            weighted(s, c["skin_weight"], e, c["skin_weight_width"], c["skin_weight_step"])
            joint(b["Pose"], c["joints"], code(s, c["skin_column"], e, c["skin_column_width"]))
        b["Mesh"].write(3 * vertices + row)
        b["Mesh"].write(4 * vertices + row)


def bind_surface(row: int, c: Mapping[str, int], b: Mapping[str, Guarded]) -> None:
    count, vertices, triangles, s = c["count"], c["vertices"], c["triangles"], b["EmbedStatic"]
    if row >= count:
        return
    by_frame = rules()["position"].value("triangle_frame").code
    rotation = {name: rules()["rotation"].value(name).code for name in ("triangle_frame", "bary_vertex_lbs")}
    t = code(s, c["triangle_ids"], row, c["triangle_ids_width"])
    at = b["Triangles"].touch(2 * triangles + t, 16)
    if at not in b["Triangles"].held:
        raise Harm("vertex ids that nobody wrote")
    foot = b["Triangles"].held[at]
    linear3(s, c["barycentric"], row, count, c["barycentric_width"], c["barycentric_scale"])
    planes = [0] if c["position_rule"] == by_frame else [0, 1]
    if c["rotation_rule"] == rotation["triangle_frame"]:
        b["Triangles"].read(triangles + t)
    else:
        planes += [2, 3, 4] if c["rotation_rule"] == rotation["bary_vertex_lbs"] else [2]
    for plane in planes:
        for v in foot:
            b["Mesh"].read(plane * vertices + v)
    b["Triangles"].read(t)
    linear(s, c["local_quat"], row, c["local_quat_width"], c["local_quat_scale"])
    linear3(s, c["local_quat"], count + row, count, c["local_quat_width"], c["local_quat_scale"] + 2)
    if c["position_rule"] == by_frame:
        linear3(s, c["local_offset"], row, count, c["local_offset_width"], c["local_offset_scale"])
    else:
        linear(s, c["displacement"], row, c["displacement_width"], c["displacement_scale"])
    _in_place(row, count, b["Splats"])


def activate(row: int, c: Mapping[str, int], b: Mapping[str, Guarded]) -> None:
    if row < c["count"]:
        _in_place(row, c["count"], b["Splats"])


def _in_place(row: int, count: int, splats: Guarded) -> None:
    for plane in range(5):
        splats.read(plane * count + row)
        splats.write(plane * count + row)


def project(row: int, c: Mapping[str, int], b: Mapping[str, Guarded]) -> None:
    count = c["count"]
    if row >= count:
        return
    for plane in range(5):
        b["Splats"].read(plane * count + row)
    terms = {0: 1, 1: 4, 2: 9}.get(c["sh_degree"], 16)
    for plane in range(3 * terms):
        b["Sh"].read_float(plane * count + row)
    for plane in range(3):
        b["Projected"].write(plane * count + row)


def shadow_clear(row: int, c: Mapping[str, int], b: Mapping[str, Guarded]) -> None:
    if row < c["texels"]:
        b["Shadow"].write_float(row)


def shadow_mesh(row: int, c: Mapping[str, int], b: Mapping[str, Guarded]) -> None:
    if row < c["triangles"]:
        for at in range(row, 3 * c["triangles"], c["triangles"]):
            b["Mesh"].read(code(b["CornerStatic"], c["corners"], at, c["corners_width"]))
        b["Shadow"].write_float(LAST_TEXEL)


def shadow(row: int, c: Mapping[str, int], b: Mapping[str, Guarded]) -> None:
    if row < c["count"]:
        b["Splats"].read(4 * c["count"] + row)
        b["Shadow"].write_float(LAST_TEXEL)


def light(row: int, c: Mapping[str, int], b: Mapping[str, Guarded]) -> None:
    if row < c["count"]:
        linear3(b["LightStatic"], c["normal"], row, c["count"], c["normal_width"], c["normal_scale"])
        b["Splats"].read(c["count"] + row)
        b["Shadow"].read_float(LAST_TEXEL)
        b["Projected"].write(2 * c["count"] + row)


Kernel = Callable[[int, Mapping[str, int], Mapping[str, Any]], None]
_MESH: tuple[Kernel, ...] = (morph, skin, bind_triangles, bind_vertices, bind_surface)
_OTHERS: tuple[Kernel, ...] = (blend, bind_skin, activate, project, shadow_clear, shadow_mesh, shadow, light)
KERNELS: Mapping[str, Kernel] = {one.__name__: one for one in (*_MESH, *_OTHERS)}
