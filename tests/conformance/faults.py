"""Mistakes that real ports make, as replacements in a copy of the HLSL, and the case and stage that catch each."""

from __future__ import annotations

import re
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import avatar_shaders
from avatar_shaders.generate import HLSL, generate


@dataclass(frozen=True)
class Fault:
    """`before` stands once in a file of hlsl/ and becomes `after`; every stage of `stages` then fails in `case`,
    and no other stage in any case of that avatar."""

    name: str
    who: str  # whose mistake it is or was
    file: str
    before: str
    after: str
    case: str  # avatar/name of the case that catches it
    stages: tuple[str, ...]

    @property
    def avatar(self) -> str:
        """The key of avatars.AVATARS."""
        return self.case.partition("/")[0]


FAULTS: tuple[Fault, ...] = (
    Fault(
        "transposed_sh_rotation",
        "ports that turn the direction the way the splat turns",
        "project.hlsl",
        "rotate_inverse(sh_rotation, towards",
        "rotate(sh_rotation, towards",
        "skin_polar/posed",
        ("project",),
    ),
    Fault(
        "quarter_low_pass",
        "focal length of twice the pixels (viewport times P00), so that 0.3 becomes 0.075: two engine viewers",
        "project.hlsl",
        "camera.low_pass = low_pass;",
        "camera.low_pass = low_pass / 4;",
        "edges/thresholds",
        ("project",),
    ),
    Fault(
        "quaternion_xyzw",
        "glTF's and most engines' order read where wxyz is stored",
        "splat.hlsli",
        "Rows3 r = matrix_from_quat(quat_wxyz);",
        "Rows3 r = matrix_from_quat(quat_wxyz.wxyz);",
        "skin_polar/posed",
        ("project",),
    ),
    Fault(
        "quaternion_xyzw_bound",
        "the same where the binding turns the splat",
        "bind.hlsli",
        "b.quat_wxyz = quat_multiply(quat_from_matrix(rotation), quat_wxyz);",
        "b.quat_wxyz = quat_multiply(quat_from_matrix(rotation), quat_wxyz.wxyz);",
        "skin_polar/posed",
        ("bind",),
    ),
    Fault(
        "rotation_about_origin",
        "skinning of a web viewer: bones turn splats about the origin of the mesh",
        "bind.hlsli",
        "b.mean = transform_point(transform, mean) + late;",
        "b.mean = rotate(linear_part(transform), mean) + late;",
        "skin_polar/posed",
        ("bind",),
    ),
    Fault(
        "sh_not_turned",
        "viewers that evaluate SH in the rest pose",
        "bind.hlsli",
        "b.sh_rotation = rotation;",
        "b.sh_rotation = identity_rows();",
        "skin_polar/posed",
        ("bind",),
    ),
    Fault(
        "linear_blend",
        "colours made linear splat by splat before they are blended",
        "raster.hlsl",
        "splat_fragment(q.rgb, level)",
        "splat_fragment(linear_from_display(q.rgb), level)",
        "edges/blended",
        ("raster",),
    ),
    Fault(
        "distance_as_depth",
        "viewers that sort by distance from the eye",
        "project.hlsli",
        "seen.depth = p.z;",
        "seen.depth = length(p);",
        "edges/thresholds",
        ("project",),
    ),
    Fault(
        "alpha_not_clamped",
        "quads without the clamp of alpha to 0.99, which hardly shows in an image",
        "raster.hlsli",
        "min(AVATAR_ALPHA_MAX, exp2(level) * (1.0 / AVATAR_ALPHA_MIN_DENOMINATOR))",
        "exp2(level) * (1.0 / AVATAR_ALPHA_MIN_DENOMINATOR)",
        "edges/blended",
        ("raster",),
    ),
    Fault(
        "linear_scale_rule",
        "the ratio of areas applied to the scale, where the trainer applies it to its logarithm",
        "bind.hlsli",
        "return (log_scale + log_training_per_bundle) * ratio - log_training_per_bundle;",
        "return log_scale + log(ratio);",
        "surface_area/posed",
        ("bind",),
    ),
    Fault(
        "normal_made_unit",
        "the released code's normal for an avatar trained as the paper has it",
        "bind_surface.hlsl",
        "if (position_rule == AVATAR_POSITION_NORMAL)",
        "if (position_rule != AVATAR_POSITION_TRIANGLE_FRAME)",
        "surface_paper/posed",
        ("bind",),
    ),
    Fault(
        "vertex_quaternion_made_unit",
        "the same of vertex quaternions, which are then weighted alike",
        "bind_vertices.hlsl",
        "else if (rotation_rule == AVATAR_ROTATION_VERTEX_QUATERNION_MEAN)",
        "else if (false)",
        "surface_paper/posed",
        ("bind",),
    ),
    Fault(
        "area_ratio_damped",
        "the released code's damping for an avatar trained as the paper has it",
        "bind_surface.hlsl",
        "return scale_linear(log_scale, size, canonical);",
        "return scale_linear(log_scale, size + area_damping, canonical + area_damping);",
        "surface_paper/posed",
        ("bind",),
    ),
    Fault(
        "polar_left_out",
        "a sum of rotations taken for one, as PSAvatar's Eq. 11 prints it",
        "bind_surface.hlsl",
        "return quat_from_matrix(polar(blended));",
        "return quat_from_matrix(blended);",
        "surface_joints/posed",
        ("bind",),
    ),
    Fault(
        "matrices_of_another_corner",
        "corners in another order than their barycentric weights",
        "bind_surface.hlsl",
        "blended.row1 = mesh_blend(3, foot).xyz;",
        "Foot other = foot; other.weight = foot.weight.yzx; blended.row1 = mesh_blend(3, other).xyz;",
        "surface_joints/posed",
        ("bind",),
    ),
    Fault(
        "local_rotation_first",
        "PSAvatar's Eq. 10 as printed: a Gaussian then turns about axes that do not move with the mesh",
        "bind.hlsli",
        "b.quat_wxyz = quat_multiply(unit_turn, local_quat_wxyz);",
        "b.quat_wxyz = quat_multiply(local_quat_wxyz, unit_turn);",
        "surface_joints/posed",
        ("bind",),
    ),
    Fault(
        "late_morphs_negative",
        "eyelids that open where they should close, on mesh and splats",
        "skin.hlsli",
        "return posed + weight * delta;",
        "return posed - weight * delta;",
        "skin_polar/posed",
        ("skin", "bind"),
    ),
    Fault(
        "hemisphere_check",
        "vertex quaternions brought to one hemisphere, which the released code does not do",
        "bind_vertices.hlsl",
        "turn += canonical_size * Triangles[triangles + t];",
        "float4 q = Triangles[triangles + t];turn += canonical_size * (dot(turn, q) < 0 ? -q : q);",
        "surface_area/turned",
        ("bind",),
    ),
    Fault(
        "one_sign_rule",
        "one sign policy for every avatar, whatever its trainer's version had",
        "bind.hlsli",
        "bool negative = quaternion_sign == AVATAR_QUATERNION_SIGN_W_POSITIVE && turn.x < 0;",
        "bool negative = turn.x < 0;",
        "surface_world/turned",
        ("bind",),
    ),
    Fault(
        "sign_rule_not_mirrored",
        "the other frame's sign policy in a left-handed bundle",
        "bind.hlsli",
        "negative = max(turn.z, turn.w) > max(turn.x, turn.y);",
        "negative = false;",
        "surface_mirrored/turned",
        ("bind",),
    ),
    Fault(
        "cut_off_at_8_sigma2",
        "quads that end at sqrt(8) standard deviations",
        "raster.hlsli",
        "power > 0 ?",
        "power > 0 || power < -4 * LOG2_E ?",
        "edges/thresholds",
        ("raster",),
    ),
    Fault(
        "opacity_compensated",
        "antialiasing that dims thin splats, on by default in one viewer",
        "project.hlsl",
        "Projected[row] = float4(seen.centre, seen.depth, mean.w);",
        "Projected[row] = float4(seen.centre, seen.depth, mean.w * saturate(1 - seen.conic.x * low_pass));",
        "edges/thresholds",
        ("project",),
    ),
    Fault(
        "small_splats_culled",
        "viewers that drop the smallest splats",
        "project.hlsli",
        "camera.near_z && touches_image",
        "camera.near_z && radius > 3 && touches_image",
        "edges/thresholds",
        ("project",),
    ),
    Fault(
        "jacobian_not_clamped",
        "the clamp at 1.3 times the field of view left out",
        "project.hlsli",
        "float2 xy = min(limit, max(-limit, p.xy / p.z)) * p.z;",
        "float2 xy = p.xy;",
        "edges/thresholds",
        ("project",),
    ),
    Fault(
        "normal_not_turned",
        "normals left in the rest pose",
        "light.hlsl",
        "n = rotate(matrix_from_quat(Splats[count + row]), n);",
        "",
        "lit_head/studio",
        ("light",),
    ),
    Fault(
        "normal_not_turned_by_the_mesh",
        "normals that follow the joints and not the triangles",
        "light_normals.hlsl",
        "rotate(matrix_from_quat(turn), n)",
        "n",
        "lit_joints/studio",
        ("light",),
    ),
    Fault(
        "captured_light_in_the_world",
        "the light of the capture left behind when the head turns",
        "light.hlsl",
        "float3 captured = float3(dot(turn_row0.xyz, n), dot(turn_row1.xyz, n), dot(turn_row2.xyz, n));",
        "float3 captured = n;",
        "lit_head/studio",
        ("light",),
    ),
    Fault(
        "captured_light_turned_back",
        "world from head taken for head from world",
        "light.hlsl",
        "float3 captured = float3(dot(turn_row0.xyz, n), dot(turn_row1.xyz, n), dot(turn_row2.xyz, n));",
        "float3 captured = n.x * turn_row0.xyz + n.y * turn_row1.xyz + n.z * turn_row2.xyz;",
        "lit_head/studio",
        ("light",),
    ),
    Fault(
        "scene_light_on_the_head",
        "the light of the scene asked with the normal of the head's frame",
        "light.hlsl",
        "float3 scene = light_scene(n, Splats[row].xyz);",
        "float3 scene = light_scene(float3(dot(turn_row0.xyz, n), dot(turn_row1.xyz, n), dot(turn_row2.xyz, n)), "
        "Splats[row].xyz);",
        "lit_head/studio",
        ("light",),
    ),
    Fault(
        "sh_sign_of_one_row",
        "spherical harmonics without the signs of 3D Gaussian Splatting",
        "light.hlsli",
        "sh_band1(n, a1, a2, a3)",
        "sh_band1(n, -a1, a2, a3)",
        "lit_world/studio",
        ("light",),
    ),
    Fault(
        "shadow_map_mirrored",
        "a map whose columns run the other way",
        "shadow.hlsl",
        "uint(y) * AVATAR_SHADOW_SIZE + uint(x)",
        "uint(y) * AVATAR_SHADOW_SIZE + uint(last - x)",
        "lit_head/studio",
        ("shadow",),
    ),
    Fault(
        "shadow_map_read_upside_down",
        "a map read with its rows the other way",
        "light.hlsl",
        "uint(at.y) * AVATAR_SHADOW_SIZE",
        "uint(last - at.y) * AVATAR_SHADOW_SIZE",
        "lit_head/studio",
        ("light",),
    ),
    Fault(
        "linear_colours_without_the_toe",
        "a power of 2.4 for every colour, which shows in dark ones",
        "light.hlsli",
        "return raised > DISPLAY_TOE + 0.055 ? raised - 0.055",
        "return true ? raised - 0.055",
        "lit_head/lamp",
        ("light",),
    ),
)


class FaultyShaders:
    """What `avatar_shaders` is to the backend, from a copy of its HLSL in `folder` with one mistake in it."""

    def __init__(self, fault: Fault, folder: Path) -> None:
        shutil.copytree(HLSL, folder, dirs_exist_ok=True)
        file = folder / fault.file
        text = file.read_text("utf-8")
        assert text.count(fault.before) == 1, f"{fault.file} has no single {fault.before!r}"
        file.write_text(text.replace(fault.before, fault.after), "utf-8")
        self.folder, self.file = folder, fault.file

    def source(self, entry: str, language: str) -> str:
        if self.file not in included(self.folder, avatar_shaders.ENTRIES[entry].hlsl):
            return avatar_shaders.source(entry, language)
        return generate(self.folder, [entry], [language])[language, entry]

    def reflection(self, language: str) -> dict[str, Any]:
        return avatar_shaders.reflection(language)


def included(folder: Path, file: str) -> set[str]:
    """The file and all that it includes."""
    names = re.findall(r'#include "(\S+)"', (folder / file).read_text("utf-8"))
    return {file}.union(*(included(folder, name) for name in names))
