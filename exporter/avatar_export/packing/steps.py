"""How finely each attribute of an avatar is stored: one step an attribute, in the unit of the attribute."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

# Path of the array in an Avatar -> step, in its unit. Chosen by hand on the trained samples and the sample head, near
# what `search` finds for them.
STEPS: Mapping[str, float] = {
    "gaussians.mean": 5e-6,  # metres
    "gaussians.log_scale": 0.015,
    "gaussians.quat_wxyz": 4e-3,  # of unit quaternions
    "gaussians.opacity_logit": 1 / 255,  # of the opacity
    "gaussians.sh": 0.004,  # DC; times SH_REST for the higher bands
    "blendshapes.geometry.mean": 5e-5,  # metres at the largest weight of the expression's range
    "blendshapes.geometry.quat_wxyz": 8e-3,  # of unit quaternions
    "blendshapes.appearance.log_scale": 0.06,
    "blendshapes.appearance.opacity_logit": 0.1,
    "blendshapes.appearance.sh": 0.02,
    "blendshapes.correctives.mean": 4e-5,  # metres
    "blendshapes.late_morphs.mean": 4e-5,  # metres
    "skin.weight": 1 / 4095,
    "embedding.barycentric": 1 / 255,
    "embedding.displacement": 1e-5,  # metres
    "embedding.local_offset": 4e-3,  # of the triangle's size
    "embedding.local_quat_wxyz": 4e-3,  # of unit quaternions
    "embedding.canonical_vertices": 4e-6,  # metres
    "rig.vertices": 4e-6,  # metres
    "rig.morphs.position": 2e-5,  # metres at the largest weight of the expression's range
    "rig.correctives.position": 2e-5,  # metres
    "rig.late_morphs.position": 2e-5,  # metres
    "rig.skin.weight": 1 / 4095,
}
# Of unit vectors from -1 on: 0.6 degrees. No search changes it, since no image that it sees is lit.
NORMAL_STEP = 1 / 40
SH_REST = 2.0  # higher bands are seen as a whole, in one direction at a time
CLIP_STEPS = {
    "expression_weights": 1 / 4096,
    "late_weights": 1 / 4096,
    "joint_delta": 1 / 16384,  # radians, and metres
    "world_from_avatar": 1 / 16384,
}
UNSEEN_MESH = 8.0  # times coarser: a mesh that no Gaussian is bound to is for engines alone


@dataclass(frozen=True)
class Fineness:
    """The steps of a pack: STEPS times `coarseness`, times a factor an attribute."""

    coarseness: float = 1.0
    factors: Mapping[str, float] | None = None

    def step(self, path: str) -> float:
        """The step of the array at `path`."""
        return STEPS[path] * self.coarseness * (self.factors or {}).get(path, 1.0)


WEIGHTS = ("skin.weight", "rig.skin.weight")
# Never coarser than by default: users turn joints farther than a measured pose does, and small triangles of a mesh
# would have no area.
KEPT_FINE = (*WEIGHTS, "rig.vertices", "embedding.canonical_vertices")
