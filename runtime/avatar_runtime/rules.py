"""The values that a rule of the bundle may have; SPEC.md defines each by formula and source."""

from __future__ import annotations

BINDINGS = ("skin", "anchor", "joint_mix", "surface", "none")
SKIN_ROTATIONS = ("polar3", "head_bone", "none")
SURFACE_ROTATIONS = ("vertex_quaternion", "triangle_frame")
ROTATION_RULES = SKIN_ROTATIONS + SURFACE_ROTATIONS
POSITION_RULES = ("normal", "triangle_frame")
SCALE_RULES = ("none", "log_area", "triangle_linear")
TRAINED_SIGNS = ("w_positive", "largest_positive")
QUATERNION_SIGNS = (*TRAINED_SIGNS, "largest_positive_mirrored")  # the last in mirrored frames only
SH_DIRECTIONS = ("inverse_rotation", "world")
ANCHOR_RULES = ("repeats", "unique")
HEAD_POSE_IN = ("camera", "mesh")
BACKGROUNDS = ("random", "per_view")  # where it is no one colour
# (rotation, position, scale) that go together where there is an embedding
SURFACE_RULES = (
    ("vertex_quaternion", "normal", "none"),
    ("vertex_quaternion", "normal", "log_area"),
    ("triangle_frame", "triangle_frame", "triangle_linear"),
)
