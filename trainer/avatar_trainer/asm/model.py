"""ASM as tensors: skinning weights from mixtures in the uv plane, bones bound in the plane, poses with scale.

Source: ASM (arXiv 2304.09423) Eq. 1 to 7 and appendix B, Eq. 8 to 16 and Algorithm 1; the arrays' twin is
`avatar_export.asm.maths`. Everything is differentiable in all parameters, batched over leading axes, which broadcast,
and runs in the type of what it is given: float32 to fit, float64 to check. Matrices multiply columns.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np
import torch
from torch import Tensor

from avatar_export.asm import Binding, Take, Template
from avatar_runtime import F64
from avatar_trainer.asm.kernels.closest import TriangleTree, nearest, triangle_tree

POSE = ("rotation_vector", "translation", "log_scale")  # tau of Eq. 2
MIXTURE = ("pi_logit", "mu", "scale_tril")  # of Eq. 4
STILL = 1e-4  # radians squared, below which a rotation's sines are taken from their series


@dataclass(frozen=True)
class Variant:
    """What an ablation of the paper's Table 7 fits."""

    fitted: tuple[str, ...]  # fields of Face
    fixed_weights: bool = False  # the weights that bones were given first, instead of Eq. 6
    random_mixtures: bool = False  # mixtures begin at random places


VARIANTS = {
    "static": Variant(POSE, fixed_weights=True),
    "dynamic_binding": Variant((*POSE, "zeta"), fixed_weights=True),
    # Not in the paper's table: mixtures keep their shape and follow their bones.
    "moving_weights": Variant((*POSE, "zeta")),
    "random_weights": Variant((*POSE, "zeta", *MIXTURE), random_mixtures=True),
    "full": Variant((*POSE, "zeta", *MIXTURE)),
}


@dataclass(frozen=True)
class Generation:
    """Bones with equally many above them."""

    bones: Tensor  # i64 [n]
    parent: Tensor  # i64 [n] row of each one's parent in the generation before; empty for roots


@dataclass(frozen=True)
class TemplateTensors:
    """`Template` as tensors, with its bones in generations."""

    vertices: Tensor  # [V, 3] metres
    triangles: Tensor  # i64 [F, 3]
    uv: Tensor  # [V, 2]
    plane: F64  # [V, 3] uv, and 0
    plane_tree: TriangleTree  # of the triangles in `plane`
    parents: tuple[int, ...]  # [J], -1 for the root
    generations: tuple[Generation, ...]  # roots first
    place: Tensor  # i64 [J] row of each bone when all generations are concatenated
    rest_position: Tensor  # [J, 3] psi^0
    rest_linear: Tensor  # [J, 3, 3] R^0 S^0
    rest_inverse: Tensor  # [J, 3, 3] of rest_linear
    anchor_vertex: Tensor  # i64 [J]
    softplus: bool  # the weight rule of the unofficial code

    @staticmethod
    def of(template: Template, dtype: torch.dtype = torch.float32) -> TemplateTensors:
        """Tensors of `template`."""
        parents = tuple(int(p) for p in template.parents)
        generations, place = _generations(parents)
        linear = template.rest_linear.astype(np.float64)
        plane = np.pad(template.uv.astype(np.float64), ((0, 0), (0, 1)))
        return TemplateTensors(
            vertices=_tensor(template.vertices, dtype),
            triangles=_tensor(template.triangles.astype(np.int64), torch.int64),
            uv=_tensor(template.uv, dtype),
            plane=plane,
            plane_tree=triangle_tree(plane, template.triangles),
            parents=parents,
            generations=generations,
            place=place,
            rest_position=_tensor(template.rest_position, dtype),
            rest_linear=_tensor(linear, dtype),
            rest_inverse=_tensor(np.linalg.inv(linear), dtype),
            anchor_vertex=_tensor(template.anchor_vertex.astype(np.int64), torch.int64),
            softplus=template.weight_rule == "softplus",
        )


@dataclass
class Face:
    """What a fit changes, without constraints; every tensor may have leading axes of its own."""

    zeta: Tensor  # [..., J, 2] uv
    pi_logit: Tensor  # [..., J, K] softmax gives pi
    mu: Tensor  # [..., J, K, 2] uv, from zeta
    scale_tril: Tensor  # [..., J, K, 3] log L_00, log L_11, L_10 of the covariance L L^T
    rotation_vector: Tensor  # [..., J, 3] radians
    translation: Tensor  # [..., J, 3] metres
    log_scale: Tensor  # [..., J, 3]

    @staticmethod
    def of(binding: Binding, take: Take | None = None, dtype: torch.dtype = torch.float32) -> Face:
        """From stored values; the pose is the take's first frame, or the rest pose without a take.

        Raises ValueError for a weight pi or a scale that is not above 0, and for a covariance without an inverse.
        """
        xx, xy, yy = np.moveaxis(binding.covariance, -1, 0)
        left = yy - np.square(xy) / xx
        if not (np.all(binding.pi > 0) and np.all(xx > 0) and np.all(left > 0)):
            raise ValueError("pi must be above 0 and covariances positive definite")
        tril = np.stack([0.5 * np.log(xx), 0.5 * np.log(left), xy / np.sqrt(xx)], axis=-1)
        still = np.zeros((len(binding.zeta), 3))
        pose = (still, still, still)
        if take is not None:
            if not np.all(take.scale[0] > 0):
                raise ValueError(f"take {take.name}: scales must be above 0")
            pose = take.rotation_vector[0], take.translation[0], np.log(take.scale[0])
        given = (binding.zeta, np.log(binding.pi), binding.mu, tril, *pose)
        return Face(*(_tensor(array, dtype) for array in given))

    def binding(self) -> Binding:
        """The person's part, of a face without leading axes."""
        a, b, c = (part.detach().double() for part in self.scale_tril.unbind(-1))
        a, b = a.exp(), b.exp()
        covariance = torch.stack([a * a, a * c, c * c + b * b], dim=-1)
        pi = self.pi_logit.detach().double().softmax(-1)
        return Binding(_array(self.zeta), _array(pi), _array(self.mu), _array(covariance))

    def take(self, name: str, fps: float = 30.0) -> Take:
        """The pose; a leading axis, if there is one, is time."""
        joints = self.translation.shape[-2]
        pose = (self.rotation_vector, self.translation, self.log_scale.detach().double().exp())
        return Take(name, fps, *(_array(part).reshape(-1, joints, 3) for part in pose))

    def parameters(self, names: tuple[str, ...] | None = None) -> Iterator[tuple[str, Tensor]]:
        """(name, tensor) of the fields `names`; of all by default."""
        for field in fields(self):
            if names is None or field.name in names:
                yield field.name, getattr(self, field.name)


def weights(template: TemplateTensors, face: Face) -> Tensor:
    """W^g [..., V, J] of Eq. 4 and 6, each vertex's adding up to 1.

    Far from every bone, where all densities round to 0, the nearest bones share the vertex as Eq. 6 does in the limit.
    """
    log_density = _log_mixture(template.uv, face)
    if template.softplus:
        density = log_density.exp()
        soft = torch.logaddexp(density, torch.zeros_like(density))
        return soft / soft.sum(-1, keepdim=True)
    return log_density.softmax(-1)


def bone_positions(template: TemplateTensors, face: Face) -> Tensor:
    """psi [..., J, 3] metres of Eq. 7; for a zeta outside all triangles, the psi of the nearest point of the uv mesh.

    The choice of triangle has no gradient; where charts overlap, the first triangle is used.
    """
    triangle = containing_triangle(template, face.zeta)
    corner = template.triangles[triangle]  # [..., J, 3]
    barycentric = _nearest_barycentric(face.zeta, template.uv[corner])
    moved = (barycentric[..., None] * template.vertices[corner]).sum(-2)
    return moved - template.vertices[template.anchor_vertex] + template.rest_position


def skin_matrices(template: TemplateTensors, face: Face) -> Tensor:
    """T [..., J, 3, 4] of Eq. 13, rest to posed.

    With Eq. 15 and 16 a bone's matrix is its parent's times B_j M(tau_j) B_j^-1: the bone's own motion, in the mesh.
    """
    position = bone_positions(template, face)
    rotated = rotation_matrices(face.rotation_vector) * face.log_scale.exp()[..., None, :]
    linear = template.rest_linear @ rotated @ template.rest_inverse
    pushed = (template.rest_linear @ face.translation[..., None]).squeeze(-1)
    shift = position + pushed - (linear @ position[..., None]).squeeze(-1)
    shape = np.broadcast_shapes(linear.shape[:-2], shift.shape[:-1])
    own = torch.cat([linear.expand(*shape, 3, 3), shift.expand(*shape, 3)[..., None]], dim=-1)
    last = own[..., template.generations[0].bones, :, :]
    done = [last]
    for generation in template.generations[1:]:
        last = _after(last[..., generation.parent, :, :], own[..., generation.bones, :, :])
        done.append(last)
    return torch.cat(done, dim=-3)[..., template.place, :, :]


def posed(template: TemplateTensors, face: Face, fixed_weights: Tensor | None = None) -> Tensor:
    """Vertices [..., V, 3] metres of Eq. 3; `fixed_weights` [V, J] replace the weights of Eq. 6."""
    matrix = skin_matrices(template, face)
    share = weights(template, face) if fixed_weights is None else fixed_weights
    blended = share @ matrix.flatten(-2)
    blended = blended.reshape(*blended.shape[:-1], 3, 4)
    return (blended[..., :3] * template.vertices[:, None, :]).sum(-1) + blended[..., 3]


def rotation_matrices(rotation_vector: Tensor) -> Tensor:
    """Rotations [..., 3, 3] about axes by angles [..., 3] in radians (Rodrigues), smooth through 0."""
    x, y, z = rotation_vector.unbind(-1)
    squared = rotation_vector.square().sum(-1)
    small = squared < STILL
    safe = torch.where(small, torch.ones_like(squared), squared)
    angle = safe.sqrt()
    series_sin = 1 - squared / 6 * (1 - squared / 20 * (1 - squared / 42))
    series_cos = 0.5 * (1 - squared / 12 * (1 - squared / 30 * (1 - squared / 56)))
    sin = torch.where(small, series_sin, angle.sin() / angle)[..., None, None]
    cos = torch.where(small, series_cos, (1 - angle.cos()) / safe)[..., None, None]
    zero = torch.zeros_like(x)
    cross = torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], dim=-1)
    cross = cross.reshape(*x.shape, 3, 3)
    return torch.eye(3, dtype=x.dtype) + sin * cross + cos * (cross @ cross)


def containing_triangle(template: TemplateTensors, zeta: Tensor) -> Tensor:
    """i64 [..., J] rows of the triangles of the uv mesh that hold zeta [..., J, 2], or else lie nearest to it."""
    points = np.pad(_array(zeta).reshape(-1, 2), ((0, 0), (0, 1)))
    found = nearest(points, template.plane, template.plane_tree)
    return torch.from_numpy(found.triangle).reshape(zeta.shape[:-1])


def random_mixtures(face: Face, generator: torch.Generator) -> Face:
    """A copy of `face` with mixtures at random places: the paper's ablation RD (Table 7).

    Centres are uniform over the unit square, not about their bones; deviations log-uniform from 0.02 to 0.2.
    """

    def uniform(like: Tensor, low: float, high: float) -> Tensor:
        drawn = torch.rand(like.shape, generator=generator, dtype=torch.float64)
        return (low + (high - low) * drawn).to(like.dtype)

    tril = torch.cat(
        [
            uniform(face.scale_tril[..., :2], math.log(0.02), math.log(0.2)),
            torch.zeros_like(face.scale_tril[..., 2:]),
        ],
        dim=-1,
    )
    mu = uniform(face.mu, 0.0, 1.0) - face.zeta[..., None, :]
    pi = uniform(face.pi_logit, -1.0, 1.0)
    pose = (face.rotation_vector, face.translation, face.log_scale)
    return Face(face.zeta.clone(), pi, mu, tril, *(part.clone() for part in pose))


def _log_mixture(uv: Tensor, face: Face) -> Tensor:
    """log W [..., V, J] of Eq. 4."""
    from_centre = uv[:, None, None, :] - (face.mu + face.zeta[..., None, :])[..., None, :, :, :]
    log_a, log_b, c = (part[..., None, :, :] for part in face.scale_tril.unbind(-1))
    x = from_centre[..., 0] * (-log_a).exp()
    y = (from_centre[..., 1] - c * x) * (-log_b).exp()
    log_pi = face.pi_logit.log_softmax(-1)[..., None, :, :]
    log_normal = -0.5 * (x.square() + y.square()) - log_a - log_b - math.log(2 * math.pi)
    return (log_pi + log_normal).logsumexp(-1)


def _nearest_barycentric(point: Tensor, corner: Tensor) -> Tensor:
    """Barycentric [..., 3] of a point [..., 2] in its triangle [..., 3, 2]; of the nearest point of it if outside."""
    a, b, c = corner.unbind(-2)
    area = _cross(b - a, c - a)
    flat = area == 0
    safe = torch.where(flat, torch.ones_like(area), area)
    second, third = _cross(point - a, c - a) / safe, _cross(b - a, point - a) / safe
    inner = torch.stack([1 - second - third, second, third], dim=-1)
    zero = torch.zeros_like(area)
    on_edge, distance = [], []
    for k, (start, end) in enumerate(((a, b), (b, c), (c, a))):
        t = _along(point, start, end)
        shares = {k: 1 - t, (k + 1) % 3: t, (k + 2) % 3: zero}
        on_edge.append(torch.stack([shares[i] for i in range(3)], dim=-1))
        distance.append(_squared_to_edge(point, start, end))
    nearest = torch.stack(distance, dim=-1).detach().argmin(-1)[..., None, None]
    outer = torch.stack(on_edge, dim=-2).take_along_dim(nearest, dim=-2).squeeze(-2)
    inside = (inner.detach() >= 0).all(-1) & ~flat
    return torch.where(inside[..., None], inner, outer)


def _along(point: Tensor, start: Tensor, end: Tensor) -> Tensor:
    """The position on an edge of the point nearest to `point`: 0 at `start`, 1 at `end`."""
    edge = end - start
    length = edge.square().sum(-1).clamp_min(1e-30)
    return (((point - start) * edge).sum(-1) / length).clamp(0, 1)


def _squared_to_edge(point: Tensor, start: Tensor, end: Tensor) -> Tensor:
    t = _along(point, start, end)[..., None]
    return (start + t * (end - start) - point).square().sum(-1)


def _cross(a: Tensor, b: Tensor) -> Tensor:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _after(first: Tensor, then: Tensor) -> Tensor:
    """Affine maps [..., 3, 4]: `then`, and `first` of what it gives."""
    moved = first[..., :3] @ then
    return torch.cat([moved[..., :3], moved[..., 3:] + first[..., 3:]], dim=-1)


def _generations(parents: tuple[int, ...]) -> tuple[tuple[Generation, ...], Tensor]:
    """(bones by their number of ancestors, the row of each bone when all generations are concatenated)."""
    depth: list[int] = []
    for parent in parents:
        depth.append(0 if parent < 0 else depth[parent] + 1)
    rows = [[j for j, d in enumerate(depth) if d == level] for level in range(max(depth) + 1)]
    above = [[], *rows]
    found = [
        Generation(torch.tensor(bones), torch.tensor([before.index(parents[j]) for j in bones if before]))
        for before, bones in zip(above, rows, strict=False)
    ]
    order = [j for bones in rows for j in bones]
    return tuple(found), torch.tensor([order.index(j) for j in range(len(parents))])


def _tensor(array: object, dtype: torch.dtype) -> Tensor:
    return torch.tensor(np.asarray(array), dtype=dtype)


def _array(tensor: Tensor) -> F64:
    found: F64 = tensor.detach().double().numpy()
    return found
