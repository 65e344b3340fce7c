"""What each compute entry reads and writes, as data: key `access` of an entry in reflection.json.

A player checks a pass against it before it uploads anything; the checker knows no entry. A pass that keeps the
contract touches nothing outside its buffers. The table is written by hand from hlsl/. One contract has these keys:

    rows      the constant that equals the number of threads that have work
    values    {constant: the numbers that it may be}: codes of rules, degrees
    most      {constant: the largest number that it may be}; the constant is a count, at least 1
    fits      [[sum, limit]]: sum <= limit, both expressions
    pose      {constant: the section of Pose that begins there}
    same      {buffer: constants on which all passes agree that bind it}
    chunk     the constant that equals the rows of the chunk of Gaussians to which Splats, Sh and Projected belong
    level     constants on which all passes of this entry in a level agree
    elements  {buffer: [{elements, when}]}: how many elements of a buffer without sections the pass touches
    sections  {constant: section}: the constant is the first word of the section of its own name, which has
        buffer    the shader's name of the packed buffer
        kind      how elements are read: `pointer`, `index`, or a function of packed.hlsli: `linear`, `signed`,
                  `weight`, `table`
        elements  how many elements it has; none if its width is 0
        width     the constant that holds the bits of an element; without it they are 32
        widths    what `width` may be
        below     index: every element is smaller
        pointer   pointer: the most elements that one row may have. It begins with 0 and never falls
        scale     linear, signed, weight, table: the constant that is the first word of the floats of the codes, the
                  section of its name. At width 32 it is not read
        floats    how many floats that section has. table: not stated, every code is smaller than their number
        when      {constant: values}: the section is read only for these; without it, always

An expression is a sum of products, such as `3*#morph_ptr+1`. A factor is a whole number, a constant, or #NAME: of a
pointer section its last element, of a constant in `pose` the items of that section of Pose (12 floats an item in
`joints`, 1 elsewhere). A buffer without sections holds exactly what the passes that bind it touch at most.

Width 0 stores nothing. `signed` does not read such a section; the other kinds read the word at which it begins.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from avatar_schema import constants, families, rules

Contract = dict[str, Any]
MOST_ROWS = 65535 * 64  # thread groups of one dispatch, threads of one group
MOST_ENTRIES = 65536  # of a row; an entry is one turn of a loop
MOST_VERTICES = 1 << 24  # Triangles holds vertex ids as float32, which is exact up to here
SHADOW_TEXELS = int(constants()["shadow_size"]) ** 2
CODED, INDEX = [0, 8, 16, 32], [8, 16, 32]


def contracts() -> dict[str, Contract]:
    """The access contract of every entry that a program may use, as plain data. A fresh copy."""
    return {
        "morph": _morph(),
        "skin": _skin(),
        "blend": _blend(),
        "bind_skin": _bind_skin(),
        "bind_triangles": _bind_triangles(),
        "bind_vertices": _bind_vertices(),
        "bind_surface": _bind_surface(),
        "activate": _of_chunk({"Splats": "5*count"}),
        "project": _project(),
        "shadow_clear": {
            "rows": "texels",
            "values": {"texels": [SHADOW_TEXELS]},
            "most": {"texels": MOST_ROWS},
            "elements": {"Shadow": [{"elements": f"{SHADOW_TEXELS}"}]},
        },
        "shadow_mesh": {
            "rows": "triangles",
            "most": {"triangles": MOST_ROWS, "vertices": MOST_VERTICES},
            "same": {"Mesh": ["vertices"]},
            "elements": {"Mesh": [{"elements": "vertices"}], "Shadow": [{"elements": f"{SHADOW_TEXELS}"}]},
            "sections": _index("CornerStatic", "corners", "3*triangles", "vertices"),
        },
        "shadow": _of_chunk({"Splats": "5*count", "Shadow": f"{SHADOW_TEXELS}"}, shared=("Shadow",)),
        "light_normals": _light_normals(),
        "light": _light(),
    }


def _morph() -> Contract:
    static = "MorphStatic"
    return {
        "rows": "count",
        "most": {"count": MOST_ROWS, "vertices": MOST_VERTICES},
        "fits": [["first+count", "vertices"]],
        "pose": {"weights": "weights", "features": "features"},
        "same": {"Mesh": ["vertices"]},
        "elements": {"Mesh": [{"elements": "3*vertices"}]},  # planes of positions, normals, turns
        "sections": {
            **_planes(static, "template_position", 3, "count"),
            **_sparse(static, "morph", "count", "weights", {"morph_position": 3}),
            **_sparse(static, "corrective", "count", "features", {"corrective_position": 3}),
        },
    }


def _skin() -> Contract:
    static = "SkinStatic"
    return {
        "rows": "count",
        "most": {"count": MOST_ROWS},
        "pose": {"late": "late", "joints": "joints"},
        "elements": {"Mesh": [{"elements": "first+count"}]},
        "sections": {
            **_sparse(static, "late", "count", "late", {"late_position": 3}),
            **_skinning(static, "count"),
        },
    }


def _blend() -> Contract:
    static = "BlendStatic"
    appearance: dict[str, int | str] = {"appearance_log_scale": 3, "appearance_opacity": 1}
    appearance["appearance_sh"] = "3*sh_terms"
    return {
        **_of_chunk({"Splats": "5*count", "Sh": "3*sh_terms*count"}),
        "values": {"sh_terms": [1, 4, 9, 16]},
        "pose": {"weights": "weights"},
        "level": ["sh_terms"],
        "sections": {
            **_planes(static, "base_mean", 3, "count"),
            **_planes(static, "base_log_scale", 3, "count"),
            **_planes(static, "base_quat", 4, "count"),
            "base_opacity": {
                "buffer": static,
                "kind": "table",
                "elements": "count",
                "width": "base_opacity_width",
                "widths": CODED,
                "scale": "base_opacity_table",
            },
            **_planes(static, "base_sh", "3*sh_terms", "count"),
            **_sparse(static, "geometry", "count", "weights", {"geometry_mean": 3, "geometry_quat": 4}),
            **_sparse(static, "appearance", "count", "weights", appearance),
        },
    }


def _bind_skin() -> Contract:
    static = "BindStatic"
    return {
        **_of_chunk({"Splats": "5*count"}),
        "rows": "rows",
        "most": {"count": MOST_ROWS, "rows": MOST_ROWS},
        "fits": [["first+rows", "count"]],
        "values": {
            "binding_rule": _codes("binding", embedded=False),
            "rotation_rule": _codes("rotation", embedded=False),
            "sh_direction": _codes("sh_direction"),
        },
        "pose": {"features": "features", "late": "late", "joints": "joints"},
        "sections": {
            **_sparse(static, "corrective", "count", "features", {"corrective_mean": 3}),
            **_sparse(static, "late", "count", "late", {"late_mean": 3}),
            **_skinning(static, "count"),
        },
    }


def _bind_triangles() -> Contract:
    static = "SurfaceStatic"
    return {
        "rows": "triangles",
        "most": {"triangles": MOST_ROWS, "vertices": MOST_VERTICES},
        "values": {
            "rotation_rule": _codes("rotation", embedded=True),
            "quaternion_sign": _codes("quaternion_sign"),
        },
        "same": _MESH_AND_TRIANGLES,
        "elements": {"Mesh": [{"elements": "3*vertices"}], "Triangles": [{"elements": "3*triangles"}]},
        "sections": {
            **_index(static, "corners", "3*triangles", "vertices"),
            **_planes(static, "canonical", 3, "vertices"),
        },
    }


def _bind_vertices() -> Contract:
    static = "SurfaceStatic"
    return {
        "rows": "vertices",
        "most": {"triangles": MOST_ROWS, "vertices": MOST_ROWS},
        "values": {"rotation_rule": _codes("rotation", embedded=True)},
        "pose": {"joints": "joints"},
        "same": _MESH_AND_TRIANGLES,
        "elements": {"Mesh": _mesh_planes(), "Triangles": [{"elements": "3*triangles"}]},
        "sections": {
            **_pointer(static, "vertex_triangle_ptr", "vertices"),
            **_index(static, "vertex_triangle", "#vertex_triangle_ptr", "triangles"),
            **_skinning(static, "vertices"),
        },
    }


def _bind_surface() -> Contract:
    static, chunk = "EmbedStatic", _of_chunk({"Splats": "5*count"})
    by_frame = [rules()["position"].value("triangle_frame").code]
    by_normal = [code for code in _codes("position") if code not in by_frame]
    return {
        **chunk,
        "most": {"count": MOST_ROWS, "triangles": MOST_ROWS, "vertices": MOST_VERTICES},
        "values": {
            "position_rule": _codes("position"),
            "rotation_rule": _codes("rotation", embedded=True),
            "scale_rule": _codes("scale", embedded=True),
            "sh_direction": _codes("sh_direction"),
        },
        "same": chunk["same"] | _MESH_AND_TRIANGLES,
        "elements": {
            "Mesh": _mesh_planes(),
            "Triangles": [{"elements": "3*triangles"}],
            "Splats": [{"elements": "5*count"}],
        },
        "sections": {
            **_index(static, "triangle_ids", "count", "triangles"),
            **_planes(static, "barycentric", 3, "count"),
            **_planes(static, "displacement", 1, "count", {"position_rule": by_normal}),
            **_planes(static, "local_offset", 3, "count", {"position_rule": by_frame}),
            **_planes(static, "local_quat", 4, "count"),
        },
    }


def _project() -> Contract:
    chunk = _of_chunk({"Splats": "5*count", "Projected": "3*count"})
    terms = {degree: (degree + 1) ** 2 for degree in range(4)}
    read = [{"elements": f"{3 * terms[d]}*count", "when": {"sh_degree": [d]}} for d in terms]
    return {
        **chunk,
        "values": {"sh_degree": list(terms)},
        "same": chunk["same"] | {"Sh": ["count"]},
        "elements": chunk["elements"] | {"Sh": read},
    }


def _light_normals() -> Contract:
    chunk = _of_chunk({"Splats": "6*count", "Triangles": "3*triangles"}, shared=("Triangles",))
    return {
        **chunk,
        "most": {"count": MOST_ROWS, "triangles": MOST_ROWS},
        "same": chunk["same"] | {"Triangles": ["triangles"]},
        "sections": {
            **_index("EmbedStatic", "triangle_ids", "count", "triangles"),
            **_planes("EmbedStatic", "local_quat", 4, "count"),
            **_planes("LightStatic", "normal", 3, "count"),
        },
    }


def _light() -> Contract:
    touched = {"Splats": "5*count", "Projected": "3*count", "Shadow": f"{SHADOW_TEXELS}"}
    chunk = _of_chunk(touched, shared=("Shadow",))
    by_plane = {"elements": "6*count", "when": {"turned": [1]}}
    return {
        **chunk,
        "values": {"turned": [0, 1]},
        "elements": chunk["elements"] | {"Splats": [*chunk["elements"]["Splats"], by_plane]},
        "sections": _planes("LightStatic", "normal", 3, "count"),
    }


_MESH_AND_TRIANGLES = {"Mesh": ["vertices"], "Triangles": ["triangles", "vertices", "rotation_rule"]}


def _of_chunk(elements: dict[str, str], shared: tuple[str, ...] = ()) -> Contract:
    """The part of a contract over a chunk of Gaussians; `elements` that it touches of each of its buffers.

    Buffers that are `shared` do not belong to one chunk.
    """
    return {
        "rows": "count",
        "most": {"count": MOST_ROWS},
        "chunk": "count",
        "same": {buffer: ["count"] for buffer in elements if buffer not in shared},
        "elements": {buffer: [{"elements": count}] for buffer, count in elements.items()},
    }


def _mesh_planes() -> list[Contract]:
    """Positions, normals and quaternions; under bary_vertex_lbs three rows of a matrix instead of quaternions."""
    by_joints = [rules()["rotation"].value("bary_vertex_lbs").code]
    others = [code for code in _codes("rotation", embedded=True) if code not in by_joints]
    return [
        {"elements": "3*vertices", "when": {"rotation_rule": others}},
        {"elements": "5*vertices", "when": {"rotation_rule": by_joints}},
    ]


def _pointer(buffer: str, name: str, rows: str) -> dict[str, Contract]:
    return {name: {"buffer": buffer, "kind": "pointer", "elements": f"{rows}+1", "pointer": MOST_ENTRIES}}


def _index(buffer: str, name: str, elements: str, below: str) -> dict[str, Contract]:
    width = {"width": f"{name}_width", "widths": INDEX}
    return {name: {"buffer": buffer, "kind": "index", "elements": elements, **width, "below": below}}


def _planes(
    buffer: str, name: str, channels: int | str, rows: str, when: dict[str, list[int]] | None = None
) -> dict[str, Contract]:
    """A section of `channels` planes; low and step of each channel are its scale."""
    contract = _floats(name, "linear", "scale", f"{channels}*{rows}", f"2*{channels}")
    return {name: {"buffer": buffer, **contract, **({} if when is None else {"when": when})}}


def _sparse(
    buffer: str, name: str, rows: str, columns: str, values: dict[str, int | str]
) -> dict[str, Contract]:
    """Pointer, columns in section `columns` of Pose, and values {section: channels of an entry}."""
    signed = {
        section: _floats(section, "signed", "step", f"{channels}*#{name}_ptr", f"{channels}*#{columns}")
        for section, channels in values.items()
    }
    return {
        **_pointer(buffer, f"{name}_ptr", rows),
        **_index(buffer, f"{name}_column", f"#{name}_ptr", f"#{columns}"),
        **{section: {"buffer": buffer, **contract} for section, contract in signed.items()},
    }


def _skinning(buffer: str, rows: str) -> dict[str, Contract]:
    return {
        **_pointer(buffer, "skin_ptr", rows),
        **_index(buffer, "skin_column", "#skin_ptr", "#joints"),
        "skin_weight": {"buffer": buffer, **_floats("skin_weight", "weight", "step", "#skin_ptr", "1")},
    }


def _floats(name: str, kind: str, scale: str, elements: str, floats: str) -> Contract:
    return {
        "kind": kind,
        "elements": elements,
        "width": f"{name}_width",
        "widths": CODED,
        "scale": f"{name}_{scale}",
        "floats": floats,
    }


def _codes(rule: str, *, embedded: bool | None = None) -> list[int]:
    """Codes of a rule, or of its values that go with an embedding or without one."""
    allowed: Iterable[str] = [f.name for f in families().values() if embedded in (None, f.embedded)]
    values = [v for v in rules()[rule].values if not v.families or set(v.families) & set(allowed)]
    return sorted({value.code for value in values})
