"""The values that a rule of the bundle may have, and their codes, from the table avatar_schema/v1/rules.json.

SPEC.md defines each value by formula. Kernels take `code` at module level: it is compiled into them.
"""

from __future__ import annotations

from itertools import product

from avatar_schema import families
from avatar_schema import rules as table


def code(rule: str, name: str) -> int:
    """The number that shaders and kernels get for a value of a rule. Raises KeyError for an unknown one."""
    return table()[rule].value(name).code


def names(rule: str, family: str | None = None) -> tuple[str, ...]:
    """The values of a rule, or those that may stand in a family of the table, in the order of the schema's enum."""
    return table()[rule].names(family)


def needing(rule: str, what: str) -> tuple[str, ...]:
    """The values of a rule that need `what` of an avatar: rig, rotation_joint, displacement or local_offset."""
    return tuple(value.name for value in table()[rule].values if what in value.needs)


BINDINGS = names("binding")
ROTATION_RULES = names("rotation")
SKIN_ROTATIONS = names("rotation", "joints")
VERTEX_ROTATIONS = names("rotation", "surface_by_vertices")
RIGGED_ROTATIONS = needing("rotation", "rig")  # of surfaces, by the joints that move the mesh
JOINT_ROTATIONS = needing("rotation", "rotation_joint")
POSITION_RULES = names("position")
NORMAL_POSITIONS = needing("position", "displacement")
SCALE_RULES = names("scale")
SKIN_SCALES = names("scale", "joints")
AREA_SCALES = names("scale", "surface_by_vertices")
QUATERNION_SIGNS = names("quaternion_sign")
MIRRORED_SIGNS = {v.name: v.mirror_of for v in table()["quaternion_sign"].values if v.mirror_of}
TRAINED_SIGNS = tuple(name for name in QUATERNION_SIGNS if name not in MIRRORED_SIGNS)
SH_DIRECTIONS = names("sh_direction")
ANCHOR_RULES = names("anchor")
HEAD_POSE_IN = names("head_pose_in")
LIGHT_FRAMES = names("light_frame")
BACKGROUNDS = names("background")  # if it is not one colour
DRIVING_MODES = names("driving_mode")
# With an embedding, rotation, position and scale are of one family, in any combination.
SURFACE_FAMILIES = tuple(
    (names("rotation", family.name), names("position", family.name), names("scale", family.name))
    for family in families().values()
    if family.embedded
)
SURFACE_RULES = tuple(row for family in SURFACE_FAMILIES for row in product(*family))
