"""The values that a rule of the bundle may have; SPEC.md defines each by formula and source."""

from __future__ import annotations

from itertools import product

BINDINGS = ("skin", "anchor", "joint_mix", "surface", "none")
SKIN_ROTATIONS = ("polar3", "head_bone", "none")
VERTEX_ROTATIONS = ("vertex_quaternion", "vertex_quaternion_mean")
RIGGED_ROTATIONS = ("bary_vertex_lbs",)  # of surfaces, by the joints that move the mesh
SURFACE_ROTATIONS = (*VERTEX_ROTATIONS, "triangle_frame", *RIGGED_ROTATIONS)
ROTATION_RULES = SKIN_ROTATIONS + SURFACE_ROTATIONS
NORMAL_POSITIONS = ("normal", "interpolated_normal")
POSITION_RULES = (*NORMAL_POSITIONS, "triangle_frame")
AREA_SCALES = ("none", "log_area", "linear_area")
SCALE_RULES = (*AREA_SCALES, "triangle_linear")
TRAINED_SIGNS = ("w_positive", "largest_positive")
QUATERNION_SIGNS = (*TRAINED_SIGNS, "largest_positive_mirrored")  # the last in mirrored frames only
SH_DIRECTIONS = ("inverse_rotation", "world")
ANCHOR_RULES = ("repeats", "unique")
HEAD_POSE_IN = ("camera", "mesh")
BACKGROUNDS = ("random", "per_view")  # where it is no one colour
# Rotations, positions and scales that go together where there is an embedding, in any choice within a family.
SURFACE_FAMILIES = (
    (VERTEX_ROTATIONS, NORMAL_POSITIONS, AREA_SCALES),  # SplattingAvatar, code and paper
    (("triangle_frame",), ("triangle_frame",), ("triangle_linear",)),  # GaussianAvatars
    (RIGGED_ROTATIONS, NORMAL_POSITIONS, ("none",)),  # PSAvatar
)
SURFACE_RULES = tuple(row for family in SURFACE_FAMILIES for row in product(*family))
