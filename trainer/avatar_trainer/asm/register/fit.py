"""ASM faces fitted to scans (paper section 4.1 and appendix C): a face and its expressions share one binding.

Keypoints place each scan; then Adam moves scans rigidly and changes the face, until the scans' points lie on the mesh.
float32.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from avatar_export.asm import AsmFace, Binding, Take, Template
from avatar_runtime import F64, AvatarError
from avatar_trainer.asm.align import KEYPOINTS, Placement, Scan, ScanError, face_region, scan_to_mesh
from avatar_trainer.asm.kernels.closest import TriangleTree, triangle_tree
from avatar_trainer.asm.kernels.mixture import mixture_weights_cpu
from avatar_trainer.asm.model import (
    POSE,
    VARIANTS,
    Face,
    TemplateTensors,
    random_mixtures,
    skin_matrices,
    weights,
)
from avatar_trainer.asm.register.settings import RegisterSettings
from avatar_trainer.asm.register.target import Target
from avatar_trainer.asm.strain import Edges, strain_energy

# The units of steps and of Eq. 19, see RegisterSettings; 1 for values without a unit.
DECIMETRE, TENTH = 0.1, 0.1  # metres; of the uv plane
UNITS = {"translation": DECIMETRE, "zeta": TENTH, "mu": TENTH}
WIDER = 1.2  # part of the template that is fitted, in radii of the part of the scan
SQUARE_MM = 1e6  # in a square metre
NEUTRAL = "neutral"


@dataclass(frozen=True)
class Registration:
    """A face fitted to scans."""

    face: AsmFace  # take by take the scans, one frame each, the first named `neutral`
    placements: tuple[Placement, ...]  # of each scan, into the template's space, metres
    vertices: F64  # [scans, V, 3] of the face, in the template's space
    energy: F64  # [iterations]


def register(
    template: Template,
    binding: Binding,
    scan: Scan,
    settings: RegisterSettings | None = None,
    first_weights: Tensor | None = None,
) -> Registration:
    """A face fitted to one scan; see `register_takes`."""
    return register_takes(template, binding, [scan], settings, first_weights)


def register_takes(
    template: Template,
    binding: Binding,
    scans: Sequence[Scan],
    settings: RegisterSettings | None = None,
    first_weights: Tensor | None = None,
    start: Take | None = None,
) -> Registration:
    """A face fitted to scans of one person: one binding for all, poses for each; the first scan is the neutral face.

    `binding` is the first binding, and `start`, one frame, the first pose, by default rest. Variants with fixed weights
    use `first_weights` [V, J], by default those of `binding`; with others, the face's binding only resembles them, and
    only `vertices` was fitted. The same scans, template and settings give the same
    bits. Raises AvatarError for a template without the keypoints' landmarks, a scan without points in the facial
    region, and a fit that diverges.
    """
    settings = settings or RegisterSettings()
    if not scans:
        raise ValueError("a face is fitted to one scan at least")
    fit = _Fit(template, binding, scans, settings, first_weights, start)
    energy = np.array([fit.step(i) for i in range(settings.iterations)])
    return fit.result(energy)


def scan_error(registration: Registration, scan: Scan, take: int = 0) -> ScanError:
    """The scan-to-mesh error of one take, measured in the scan's own frame and unit times the placement's scale."""
    placement = registration.placements[take]
    metres = Placement(np.eye(3), np.zeros(3), placement.scale)
    keypoints = {name: metres.apply(np.asarray(at, np.float64)) for name, at in scan.keypoints.items()}
    measured = replace(scan, points=metres.apply(scan.points), keypoints=keypoints)
    back = Placement(placement.rotation, placement.translation).inverse()
    vertices = back.apply(registration.vertices[take])
    return scan_to_mesh(measured, vertices, triangle_tree(vertices, registration.face.template.triangles))


def template_keypoints(template: Template) -> dict[str, F64]:
    """The vertices of KEYPOINTS on a template. Raises AvatarError if one of their landmarks is missing."""
    missing = [landmark for landmark in KEYPOINTS.values() if landmark not in template.landmarks]
    if missing:
        raise AvatarError(f"has no {missing[0]}; fits to scans need it", field="landmarks")
    rows = {name: template.landmarks[landmark] for name, landmark in KEYPOINTS.items()}
    return {name: template.vertices[row].astype(np.float64) for name, row in rows.items()}


class _Fit:
    """A fit in progress, and one step of it."""

    def __init__(
        self,
        template: Template,
        binding: Binding,
        scans: Sequence[Scan],
        settings: RegisterSettings,
        first_weights: Tensor | None,
        start: Take | None,
    ) -> None:
        self.template, self.settings, self.variant = template, settings, VARIANTS[settings.variant]
        self.tensors = TemplateTensors.of(template)
        goal = template_keypoints(template)
        self.targets = [Target(scan, goal, settings) for scan in scans]
        self.rows, self.tree = _fitted_part(
            template, goal, settings, whole=any(t.vertex is not None for t in self.targets)
        )
        self.edges = Edges.of(self.tensors.vertices[self.rows], torch.from_numpy(self.tree.triangles))
        self.first = _begin(binding, settings, len(scans), start)
        self.face = Face(*(tensor.clone() for _, tensor in self.first.parameters()))
        self.fixed = None
        if self.variant.fixed_weights:
            self.fixed = (
                weights(self.tensors, _begin(binding, settings, 1, start))
                if first_weights is None
                else first_weights.float()
            )
        self.optimiser = self._optimiser()

    def _optimiser(self) -> torch.optim.Adam:
        rate = self.settings.learning_rate
        groups = [
            {"params": [tensor.requires_grad_()], "lr": rate * UNITS.get(name, 1.0)}
            for name, tensor in self.face.parameters(self.variant.fitted)
        ]
        if not self.settings.placed:
            groups.append({"params": [t.turn for t in self.targets], "lr": rate})
            groups.append({"params": [t.shift for t in self.targets], "lr": rate * DECIMETRE})
        return torch.optim.Adam(groups, foreach=False)

    def step(self, iteration: int) -> float:
        """One iteration; returns the energy before it. Raises AvatarError for a face that is not finite."""
        sound = bool(self.face.zeta.isfinite().all())
        posed = self._vertices(self.rows) if sound else torch.full((1,), torch.nan)
        if not bool(posed.isfinite().all()):
            raise AvatarError("the fit diverged: vertices are not finite; lower learning_rate")
        energy = self._apart(posed, self._cap(iteration)) + self.settings.prior * self._prior()
        self.optimiser.zero_grad()
        energy.backward()  # type: ignore[no-untyped-call]
        self.optimiser.step()
        return float(energy.detach())

    def _cap(self, iteration: int) -> float:
        """Square metres beyond which a point does not pull."""
        done = min(1.0, 2 * iteration / self.settings.iterations)
        first, last = self.settings.first_cap_mm, self.settings.last_cap_mm
        return float((first + done * (last - first)) ** 2 / SQUARE_MM)

    def _vertices(self, rows: Tensor) -> Tensor:
        """These vertices of the posed mesh [scans, v, 3]."""
        matrix, still = skin_matrices(self.tensors, self.face), self.tensors.vertices[rows]
        blended = self._weights(rows) @ matrix.flatten(-2)
        blended = blended.reshape(*blended.shape[:-1], 3, 4)
        moved: Tensor = (blended[..., :3] * still[:, None, :]).sum(-1) + blended[..., 3]
        return moved

    def _weights(self, rows: Tensor) -> Tensor:
        if self.fixed is not None:
            return self.fixed[rows]
        uv, face = self.tensors.uv[rows], self.face
        if self.tensors.softplus:
            return weights(replace(self.tensors, uv=uv), face)
        return mixture_weights_cpu(uv, face.pi_logit, face.mu + face.zeta[:, None], face.scale_tril)

    def _apart(self, posed: Tensor, cap: float) -> Tensor:
        """The mean over scans of their distances in mm^2 and of the weighted strain of their faces [scans, v, 3]."""
        total = torch.zeros(())
        for target, vertices in zip(self.targets, posed, strict=True):
            total = total + SQUARE_MM * target.apart(vertices, self.tree, cap, self.settings.facing)
            if self.settings.smooth > 0:
                total = total + self.settings.smooth * strain_energy(vertices, target.even(self.edges))
        return total / len(self.targets)

    def _prior(self) -> Tensor:
        """Eq. 19: squared norms over all bones and components.

        All are relative to the start, tau as the mean over the scans: radians, decimetres, log of scale; zeta and mu in
        tenths of uv, pi as weights, Sigma as its logarithmic Cholesky factor.
        """
        s, face, first = self.settings, self.face, self.first
        turn, shift, grow = (getattr(face, name) - getattr(first, name) for name in POSE)
        pose = turn.square() + (shift / DECIMETRE).square() + grow.square()
        total: Tensor = (
            s.lambda_pose * pose.sum() / len(self.targets)
            + s.lambda_zeta * ((face.zeta - first.zeta) / TENTH).square().sum()
            + s.lambda_pi * (face.pi_logit.softmax(-1) - first.pi_logit.softmax(-1)).square().sum()
            + s.lambda_mu * ((face.mu - first.mu) / TENTH).square().sum()
            + s.lambda_sigma * (face.scale_tril - first.scale_tril).square().sum()
        )
        return total

    @torch.no_grad()
    def result(self, energy: F64) -> Registration:
        """The result."""
        vertices: F64 = self._vertices(torch.arange(len(self.tensors.vertices))).double().numpy()
        if self.fixed is not None:  # the weights do not move with the bones
            self.face.mu = self.first.mu + (self.first.zeta - self.face.zeta)[:, None]
        names = [NEUTRAL, *(target.scan.name for target in self.targets[1:])]
        takes = tuple(self._pose(i).take(name) for i, name in enumerate(names))
        face = AsmFace(self.targets[0].scan.name, self.template, self.face.binding(), takes)
        return Registration(face, tuple(t.placement() for t in self.targets), vertices, energy)

    def _pose(self, scan: int) -> Face:
        return replace(self.face, **{name: getattr(self.face, name)[scan] for name in POSE})


def _begin(binding: Binding, settings: RegisterSettings, scans: int, start: Take | None) -> Face:
    face = Face.of(binding, start)
    if VARIANTS[settings.variant].random_mixtures:
        face = random_mixtures(face, torch.Generator().manual_seed(settings.seed))
    for name in POSE:
        setattr(face, name, getattr(face, name).expand(scans, -1, -1).clone())
    return face


def _fitted_part(
    template: Template, goal: dict[str, F64], settings: RegisterSettings, whole: bool
) -> tuple[Tensor, TriangleTree]:
    """(rows i64 [v] of the vertices that are fitted, the tree of the triangles between them)."""
    vertices, triangles = template.vertices.astype(np.float64), template.triangles.astype(np.int64)
    kept = np.ones(len(triangles), bool)
    if not whole:
        centre, radius = face_region(goal)
        near = np.sum((vertices - centre) ** 2, axis=1) <= (WIDER * settings.widened * radius) ** 2
        kept = near[triangles].any(axis=1)
    rows = np.arange(len(vertices)) if whole else np.unique(triangles[kept])
    if not kept.any():
        raise AvatarError("has no triangle near its facial landmarks", field="landmarks")
    place = np.full(len(vertices), -1)
    place[rows] = np.arange(len(rows))
    return torch.from_numpy(rows), triangle_tree(vertices[rows], place[triangles[kept]])
