"""An ASM face in memory: a mesh with bones, the mixtures that give their skin weights, and poses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from avatar_runtime.avatar import F32, F64, I32, U32

WEIGHT_RULES = (
    "normalised",
    "softplus",
)  # Eq. 6 of the paper; the unofficial code applies softplus to each mixture first


@dataclass(frozen=True)
class Template:
    """What all fits share: a topology with bones in their first placement. Metres, +Y up, face +Z."""

    vertices: F32  # [V, 3]
    triangles: U32  # [F, 3]
    uv: F32  # [V, 2] F(v) of Eq. 4, one point per vertex in the unwrapped plane
    bone_names: tuple[str, ...]  # [J], a parent before its children
    parents: I32  # [J], -1 for the root
    rest_position: F32  # [J, 3] psi^0, the first placement of a bone
    rest_linear: F32  # [J, 3, 3] R^0 S^0 of its bind matrix; the identity in models of this project
    anchor_vertex: U32  # [J] v_t of Eq. 5 and 7, the vertex nearest to the bone
    weight_rule: str = "normalised"  # WEIGHT_RULES
    colour: F32 | None = None  # [V, 3] display-referred rgb 0..1
    landmarks: Mapping[str, int] = field(default_factory=dict)  # name -> vertex, for fits


@dataclass(frozen=True)
class Binding:
    """A person: positions of bones in the plane and mixtures of weights; 2 + 6 K numbers per bone (Table 1)."""

    zeta: F64  # [J, 2] uv
    pi: F64  # [J, K] mixture weights, which add up to 1
    mu: F64  # [J, K, 2] uv, from zeta
    covariance: F64  # [J, K, 3] of uv: xx, xy, yy

    @property
    def components(self) -> int:
        """The number of Gaussians per bone, K."""
        return int(self.pi.shape[1])


@dataclass(frozen=True)
class Take:
    """Poses tau of Eq. 2 in time, or one expression: 9 numbers per bone and frame, in the bone's own space."""

    name: str
    fps: float
    rotation_vector: F64  # [T, J, 3] radians
    translation: F64  # [T, J, 3] metres
    scale: F64  # [T, J, 3] 1 at rest


@dataclass(frozen=True)
class AsmFace:
    """A fitted face. Its first take is `neutral`, one frame."""

    name: str
    template: Template
    binding: Binding
    takes: tuple[Take, ...]
