"""SplattingAvatar (arXiv 2403.05087) as a trainable system: Gaussians embedded in a posed triangle mesh.

Trained for each Gaussian: its embedding (embedding.py), local rotation, log scale, opacity logit and
spherical harmonics. Lengths of the table are in training units, metres times 4 for heads as in the release; `splats`
gives metres. From SH degree 1 on, with rule sh_direction=inverse_rotation, the gradient of (u, v) is
incomplete: the effect of the mesh's rotation at (u, v) on the direction of view is left out
(`Splats.sh_rotation` carries no gradient).
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Generator, Tensor

from avatar_export.readers import surface
from avatar_runtime import F32, AvatarError, PoseArrays
from avatar_schema import constants
from avatar_trainer.captures.model import Capture, Frame
from avatar_trainer.captures.targets import read
from avatar_trainer.kernels import embedded_cpu
from avatar_trainer.losses import dssim_loss, l1, lpips_loss, scaling_loss
from avatar_trainer.parameters import stored
from avatar_trainer.parameters.densify import SPLIT_COPIES, SPLIT_SHRINK, Density, Plan
from avatar_trainer.parameters.table import Table
from avatar_trainer.stages.rotation import matrix_from_quat
from avatar_trainer.stages.surface import PosedMesh, surface_mesh
from avatar_trainer.systems.common.detail import detail
from avatar_trainer.systems.common.first_points import View, colours, neighbour_scale, sampled
from avatar_trainer.systems.common.rigid import moved
from avatar_trainer.systems.splatting_avatar.embedding import EMBEDDINGS, ROWS, Samples
from avatar_trainer.systems.splatting_avatar.files import Checkpoint, as_written, save
from avatar_trainer.systems.splatting_avatar.mesh import PosedMeshes, posed_vertices
from avatar_trainer.systems.splatting_avatar.phong import PhongSurface
from avatar_trainer.systems.splatting_avatar.settings import (
    RULES,
    Settings,
    scheduled,
    subject_of,
    surface_rules,
)
from avatar_trainer.systems.splatting_avatar.walk import neighbours
from avatar_trainer.tensors import Rendered, Splats

__all__ = ["RULES", "Settings", "SplattingAvatar", "create"]

SH_C0 = float(constants()["sh_c0"][0])
FIRST_OPACITY, RESET_OPACITY = 0.1, 0.01
COLOUR_FRAMES = 8


def create(capture: Capture, settings: Settings, seed: int) -> SplattingAvatar:
    """An untrained avatar: random points of the first training frame's mesh.

    Raises AvatarError for a capture without training frames, with eyelids (this system's rigs have none), or with a
    mesh that has no area.
    """
    if capture.eyelids and any(frame.pose.late_weights.any() for frame in capture.frames):
        raise AvatarError(
            "has eyelid weights that are not 0; this system has no eyelids", file=capture.folder
        )
    first = next((frame for frame in capture.frames if frame.split == "train"), None)
    if first is None:
        raise AvatarError("has no training frame", file=capture.folder)
    system = SplattingAvatar(capture, settings, posed_vertices(capture.rig, first.pose), seed)
    system.initialise()
    return system


class SplattingAvatar:
    """The system (see `avatar_trainer.systems.protocol.System`)."""

    name: ClassVar[str] = "splatting_avatar"

    def __init__(self, capture: Capture, settings: Settings, first_mesh: F32, seed: int) -> None:
        """`first_mesh` [V, 3] metres: the canonical mesh. The table is empty until `initialise`."""
        self.capture, self.settings, self.seed = capture, settings, seed
        self.subject = subject_of(settings, first_mesh)
        self.training_per_bundle = self.subject.units
        self.rules = surface_rules(settings, self.subject)
        self.triangles = capture.rig.triangles.astype(np.int64)
        # Rounded as in the files, so that training uses the values that readers get.
        self.canonical_vertices = as_written(first_mesh.astype(np.float64) * self.training_per_bundle)
        in_bundle = surface.in_metres(self.canonical_vertices, self.training_per_bundle)
        self.mesh = surface_mesh(in_bundle, capture.rig.triangles, self.training_per_bundle)
        self.meshes = PosedMeshes(capture.rig, self.mesh, self.rules)
        self.canonical = self.meshes.of_vertices(in_bundle)
        self.extent = float(np.linalg.norm(np.ptp(self.canonical_vertices, axis=0))) / 2  # training units
        self.density_settings = scheduled(settings)
        self.phong = self._phong()
        self.table = Table()
        self.sh_degree = 0
        self.crossings = 0  # edges walked over since the start

    def initialise(self) -> None:
        """The Gaussians as they begin (paper section 3, "Embedding on mesh")."""
        rng = np.random.default_rng(self.seed)
        settings, rates = self.settings, self.settings.learning_rates
        triangle, barycentric = sampled(
            self.triangles,
            self.canonical_vertices,
            settings.gaussians,
            settings.sampling,
            detail(self.capture),
            rng,
        )
        count = settings.gaussians
        self._embed(torch.from_numpy(triangle), torch.from_numpy(barycentric.astype(np.float32)))
        corner = torch.from_numpy(self.canonical_vertices[self.triangles[triangle]])
        scale = neighbour_scale((self.embedding.barycentric[:, :, None] * corner).sum(1))
        sh = torch.zeros(count, (settings.sh_degree + 1) ** 2, 3)
        sh[:, 0] = (self._first_colours() - 0.5) / SH_C0
        first = math.log(FIRST_OPACITY / (1 - FIRST_OPACITY))
        still = torch.tensor([1.0, 0.0, 0.0, 0.0])
        self.embedding.add_to(self.table, rates.position * self.extent)
        self.table.add("rotation", still.repeat(count, 1), rates.rotation, ROWS)
        self.table.add("log_scale", scale.log()[:, None].repeat(1, 3), rates.log_scale, ROWS)
        self.table.add("opacity_logit", torch.full((count,), first), rates.opacity_logit, ROWS)
        self.table.add("sh_dc", sh[:, :1], rates.sh, ROWS)
        self.table.add("sh_rest", sh[:, 1:], rates.sh / 20, ROWS)
        self.density = Density(count)

    def splats(self, pose: PoseArrays) -> Splats:
        """The avatar in one pose, metres, differentiable with respect to the table."""
        splats = self._embedded(self.meshes[pose])
        if np.array_equal(pose.world_from_avatar, np.eye(4)):
            return splats
        return moved(splats, torch.from_numpy(pose.world_from_avatar.astype(np.float32)))

    def background(self, generator: Generator) -> Tensor:
        """[3] random, which shows the silhouette."""
        return torch.rand(3, generator=generator)

    def losses(self, rendered: Rendered, target: Tensor, mask: Tensor, iteration: int) -> dict[str, Tensor]:
        """Paper Eqs. 13 and 14, D-SSIM in place of LPIPS unless the settings say otherwise."""
        settings = self.settings
        terms = {"l1": l1(rendered.colour, target)}
        if settings.dssim:
            terms["dssim"] = settings.dssim * dssim_loss(rendered.colour, target)
        if settings.lpips:
            terms["lpips"] = settings.lpips * lpips_loss(rendered.colour, target)
        if settings.scaling:
            scale = self.table["log_scale"].exp()
            terms["scaling"] = settings.scaling * scaling_loss(scale, settings.long, settings.thin_ratio)
        return terms

    def observe(self, rendered: Rendered, screen_gradient: Tensor) -> None:
        """Statistics for density control."""
        self.density.observe(rendered.radius, screen_gradient)

    def before_step(self, iteration: int) -> None:
        """The learning rate of the embedding falls exponentially, as 3DGS's of the position."""
        rates = self.settings.learning_rates
        share = min(iteration / self.settings.iterations, 1.0)
        rate = self.extent * rates.position ** (1 - share) * rates.position_final**share
        for name in self.embedding.trained:
            self.table.learning_rate(name, rate)

    def after_step(self, iteration: int, generator: Generator) -> None:
        """Walk; density control, opacity reset and SH degree when they are due."""
        self.crossings += self.embedding.after_step(self.table)
        density = self.density_settings
        if density.due(iteration):
            plan = self.density.plan(
                density,
                self.table["log_scale"],
                self.table["opacity_logit"],
                self.extent,
                judge_size=density.judges_size(iteration),
            )
            self.lay_out(plan, generator)
        if density.opacity_reset_due(iteration):
            most = math.log(RESET_OPACITY / (1 - RESET_OPACITY))
            self.table.set("opacity_logit", self.table["opacity_logit"].detach().clamp(max=most))
        self.sh_degree = min(iteration // self.settings.sh_degree_every, self.settings.sh_degree)

    @torch.no_grad()
    def lay_out(self, plan: Plan, generator: Generator) -> None:
        """Carry out a plan; copies of a split Gaussian lie at samples of it, embedded anew (paper Eq. 15).

        Raises AvatarError if none is left.
        """
        samples = self._samples(plan.split.repeat(SPLIT_COPIES), generator)
        index, fresh = plan.rows()
        if not len(index):
            raise AvatarError(
                "no Gaussian is left: all have become transparent or too large; lower density.min_opacity, raise "
                "density.max_world_scale or set density.densify_until=0"
            )
        self.table.take(ROWS, index, fresh)
        self.embedding.take(index)
        copies = slice(len(index) - len(samples.parent), len(index))
        self.table["log_scale"][copies] -= math.log(SPLIT_SHRINK)
        self.embedding.hang(self.table, copies, samples)
        self.density.reset(len(index))

    def state(self) -> dict[str, Any]:
        """Everything that `load_state` needs to continue with the same bits."""
        return {
            "table": self.table.state(),
            "density": self.density.state(),
            "triangle": self.embedding.triangle,
            "barycentric": self.embedding.barycentric,
            "sh_degree": self.sh_degree,
            "crossings": self.crossings,
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """Continue from `state`. ValueError, KeyError or TypeError for one of another mesh or of other settings."""
        self.table.load_state(state["table"])
        count = self.table.count(ROWS)
        self.density.load_state(state["density"], count)
        triangle = stored.indices(state["triangle"], "triangle", count, len(self.triangles))
        barycentric = stored.tensor(state["barycentric"], "barycentric", (count, 3))
        self._embed(triangle.clone(), barycentric.clone())
        self.sh_degree = stored.whole(state["sh_degree"], "sh_degree", self.settings.sh_degree)
        self.crossings = stored.whole(state["crossings"], "crossings")

    @torch.no_grad()
    def save(self, folder: Path, iteration: int) -> None:
        """Write the released code's layout, and rules.json, into `folder`. AvatarError for rule embedding fixed."""
        chosen = self.settings.rules
        if chosen["embedding"] == "fixed":
            raise AvatarError(
                "cannot be written: rule embedding fixed trains a shift in space, which no (k, u, v, d) holds; it is "
                "for comparison in the trainer alone",
                file=folder,
            )
        table = {name: self.table[name].detach() for name in self.table}
        mean = self._embedded(self.canonical).mean
        save(
            Checkpoint(
                vertices=self.canonical_vertices,
                triangles=self.triangles,
                vertex_normals=self.canonical.vertex_normal.numpy(),
                mean=(mean * self.training_per_bundle).numpy(),
                triangle=self.embedding.triangle.numpy(),
                barycentric=self.embedding.weights(self.table).numpy(),
                displacement=table["displacement"].numpy(),
                quat_wxyz=table["rotation"].numpy(),
                log_scale=table["log_scale"].numpy(),
                opacity_logit=table["opacity_logit"].numpy(),
                sh=torch.cat([table["sh_dc"], table["sh_rest"]], dim=1).numpy(),
                units=self.subject.units,
                frameset_type=self.subject.frameset_type,
                mesh_scaling=self.rules.scale != "none",
                inverse_sh_direction=self.rules.sh_direction == "inverse_rotation",
                rules={**chosen, "scale": self.rules.scale},
                system=self.name,
                seed=self.seed,
            ),
            folder,
            iteration,
        )

    def _embed(self, triangle: Tensor, barycentric: Tensor) -> None:
        """Gaussians in these triangles [N], at these weights [N, 3]."""
        chosen = EMBEDDINGS[self.settings.rules["embedding"]]
        self.embedding = chosen(self.phong, triangle, barycentric, self.settings.walk_decay)

    def _phong(self) -> PhongSurface:
        return PhongSurface(
            neighbours(self.triangles),
            self.triangles,
            self.canonical_vertices.astype(np.float64),
            self.canonical.vertex_normal.double().numpy(),
            self.rules.position == "normal",
        )

    def _embedded(self, posed: PosedMesh) -> Splats:
        """The avatar on a posed mesh, metres."""
        table, units = self.table, self.training_per_bundle
        splats = embedded_cpu(
            posed,
            self.mesh,
            self.embedding.triangle,
            self.embedding.weights(table),
            self.embedding.displacement(table) / units,
            table["rotation"],
            table["log_scale"] - math.log(units),
            table["opacity_logit"],
            torch.cat([table["sh_dc"], table["sh_rest"]], dim=1),
            self.rules,
        )
        mean = self.embedding.mean(table, splats, units)
        return replace(splats, mean=mean, sh_rotation=self._seen(splats))

    def _seen(self, splats: Splats) -> Tensor | None:
        """The frames in which colours are seen; one colour needs none."""
        if not self.settings.sh_degree:
            return None
        if self.rules.sh_direction == "world":
            return torch.eye(3).expand(len(splats.mean), 3, 3)
        return splats.sh_rotation

    @torch.no_grad()
    def _samples(self, parent: Tensor, generator: Generator) -> Samples:
        """A point of each of these Gaussians, drawn from it in the canonical pose; training units."""
        splats, units = self._embedded(self.canonical), self.training_per_bundle
        drawn = splats.scale[parent] * torch.randn(len(parent), 3, generator=generator)
        offset = (matrix_from_quat(splats.quat_wxyz[parent]) @ drawn[:, :, None])[:, :, 0]
        return Samples(parent, (splats.mean[parent] + offset) * units, offset * units)

    def _first_colours(self) -> Tensor:
        """[N, 3] 0..1, of the settings' kind."""
        frames = [frame for frame in self.capture.frames if frame.split == "train"]
        used = (
            frames[:: math.ceil(len(frames) / COLOUR_FRAMES)] if self.settings.init_colour == "frames" else []
        )
        return colours([self._view(frame) for frame in used], len(self.embedding.triangle))

    def _view(self, frame: Frame) -> View:
        target = read(frame)
        posed = self.meshes[frame.pose]
        weight = self.embedding.barycentric[:, :, None]
        corner = self.mesh.triangles[self.embedding.triangle]
        world = torch.from_numpy(frame.pose.world_from_avatar.astype(np.float32))
        return View(
            target.image,
            target.mask,
            frame.camera,
            (weight * posed.vertices[corner]).sum(1) @ world[:3, :3].T + world[:3, 3],
            (weight * posed.vertex_normal[corner]).sum(1) @ world[:3, :3].T,
        )
