"""The values that a rule of the bundle may have; SPEC.md defines each by formula and source."""

from __future__ import annotations

BINDINGS = ("skin", "anchor", "joint_mix", "none")
ROTATION_RULES = ("polar3", "head_bone", "none")
SH_DIRECTIONS = ("inverse_rotation", "world")
ANCHOR_RULES = ("repeats", "unique")
HEAD_POSE_IN = ("camera", "mesh")
BACKGROUNDS = ("random", "per_view")  # where it is no one colour
